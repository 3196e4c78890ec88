# SPDX-License-Identifier: Apache-2.0
"""What covary raises, with the texts of the command line. Wrong types and shapes of arguments raise TypeError and
ValueError; Ctrl-C raises KeyboardInterrupt."""


class Error(Exception):
    """Any error of covary."""


class UsageError(Error, ValueError):
    """An option or a combination of options is wrong; exit code 2 of the command line."""


class InputError(Error, ValueError):
    """What a file or an image holds is wrong or not supported."""


class IoError(Error, OSError):
    """A file cannot be opened, read or written."""


class InternalError(Error, RuntimeError):
    """A bug in covary."""


class BadSamplesWarning(UserWarning):
    """Samples of a render were not finite, or negative where none may be; they count as black."""
