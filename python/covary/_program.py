# SPDX-License-Identifier: Apache-2.0
"""The program `covary` that comes with the package."""
from __future__ import annotations

import os
import shutil
from pathlib import Path

from . import _covary
from .errors import Error


def program() -> Path:
    """Path of the program: COVARY_PROGRAM if set, or else the package's own, or one on the search path."""
    named = os.environ.get("COVARY_PROGRAM")
    own = Path(__file__).parent / "bin" / "covary"
    found = named or (str(own) if own.exists() else shutil.which("covary"))
    if not found:
        raise Error("the program 'covary' is not installed: it is neither in the package nor on the search path, and "
                    "COVARY_PROGRAM does not name it")
    return Path(found)


def run_program(*words: str | os.PathLike[str]) -> tuple[int, str, str]:
    """Exit code, standard output and error of the program, which is ended if this process ends in any way."""
    return _covary.run_program([str(program()), *(os.fspath(word) for word in words)])
