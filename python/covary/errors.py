# SPDX-License-Identifier: Apache-2.0
"""The exceptions and warnings of covary, with the command line's messages. Wrong types and shapes of arguments raise
TypeError and ValueError; Ctrl-C raises KeyboardInterrupt."""


import os
import sys
import warnings
from typing import Any


class Error(Exception):
    """Any error of covary."""

    #: Of experiment(), if runs failed: an Experiment of those that did not.
    experiment: Any = None


class UsageError(Error, ValueError):
    """An option or a combination of options is wrong; exit code 2 of the command line."""


class InputError(Error, ValueError):
    """The content of a file or an image is wrong or not supported, or a run of experiment() failed."""


class IoError(Error, OSError):
    """A file cannot be opened, read or written."""


class InternalError(Error, RuntimeError):
    """A bug in covary."""


class CovaryWarning(UserWarning):
    """Any warning of covary."""


class BadSamplesWarning(CovaryWarning):
    """Samples of a render were not finite, or negative although they must not be; they count as black."""


def _warn(text: str, category: type[CovaryWarning] = CovaryWarning) -> None:
    """Warns at the line outside the package that led to this."""
    level, frame = 2, sys._getframe(1)
    while os.path.dirname(frame.f_code.co_filename) == os.path.dirname(__file__) and frame.f_back is not None:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)
