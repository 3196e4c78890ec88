# SPDX-License-Identifier: Apache-2.0
"""The exceptions of covary, with the command line's messages. Wrong types and shapes of arguments raise TypeError and
ValueError; Ctrl-C raises KeyboardInterrupt."""


class Error(Exception):
    """Any error of covary."""


class UsageError(Error, ValueError):
    """An option or a combination of options is wrong; exit code 2 of the command line."""


class InputError(Error, ValueError):
    """The content of a file or an image is wrong or not supported."""


class IoError(Error, OSError):
    """A file cannot be opened, read or written."""


class InternalError(Error, RuntimeError):
    """A bug in covary."""


class BadSamplesWarning(UserWarning):
    """Samples of a render were not finite, or negative although they must not be; they count as black."""
