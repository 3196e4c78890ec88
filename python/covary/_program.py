# SPDX-License-Identifier: Apache-2.0
"""The program `covary` that comes with the package."""
from __future__ import annotations

import os
import shutil
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from . import _covary
from .errors import Error, InputError, InternalError, IoError, UsageError

_LOOK_SECONDS = 0.2


def program() -> Path:
    """Path of the program: COVARY_PROGRAM if set, or else the package's own, or one on the search path."""
    named = os.environ.get("COVARY_PROGRAM")
    own = Path(__file__).parent / "bin" / "covary"
    found = named or (str(own) if own.exists() else shutil.which("covary"))
    if not found:
        raise Error("the program 'covary' is not installed: it is neither in the package nor on the search path, and "
                    "COVARY_PROGRAM does not name it")
    return Path(found)


def run_program(*words: str | os.PathLike[str],
                progress: Callable[[str], object] | None = None) -> tuple[int, str, str]:
    """Exit code, standard output and error of the program, which is ended if this process ends in any way. `progress`
    is called with its lines of progress, from another thread."""
    command = ["/usr/bin/env", "COVARY_EXIT_CODES=1", str(program()), *(os.fspath(word) for word in words)]
    if progress is None:
        return _covary.run_program(command)
    with tempfile.TemporaryDirectory(prefix="covary-progress-") as folder:
        file = Path(folder) / "lines"
        file.touch()
        command.insert(1, f"COVARY_PROGRESS={file}")
        end = threading.Event()
        watcher = threading.Thread(target=_tell_lines, args=(file, progress, end), daemon=True)
        watcher.start()
        try:
            return _covary.run_program(command)
        finally:
            end.set()
            watcher.join()


def _tell_lines(file: Path, progress: Callable[[str], object], end: threading.Event) -> None:
    """Tells the newest line of the file, and all that tell of failures, as often as there are any, until the end."""
    with file.open(encoding="utf-8", errors="replace") as lines:
        told = ""
        while True:
            is_last = end.wait(_LOOK_SECONDS)
            new = [line.rstrip("\n") for line in lines.readlines()]
            for line in [line for line in new[:-1] if line.startswith(FAILED)] + new[-1:]:
                if line != told:
                    told = line
                    progress(line)
            if is_last:
                return


#: How a line begins that tells of a failed run.
FAILED = "failed: "

#: Of exit codes; the last three as in sysexits.h.
_CLASSES = {2: UsageError, 65: InputError, 74: IoError, 70: InternalError}


def failure(code: int, errors: str, usual: type[Error] = Error) -> Error:
    """The exception that stands for the program's exit code and messages."""
    return _CLASSES.get(code, usual)(errors.strip().removeprefix("covary: "))
