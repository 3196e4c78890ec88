# SPDX-License-Identifier: Apache-2.0
"""The program covary, which combines the groups in a separate process. Uses only the standard library."""
from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from .errors import UsageError

#: Where scripts/blender_addon puts a copy of the program, if it is given one.
OWN = Path(__file__).parent / "program" / "covary" / "bin" / "covary"
DENOISE = ("auto", "none", "bias", "balanced", "error")


def find(named: str, own: Path = OWN) -> Path:
    """The program named in the preferences, the add-on's own copy, or one on the search path."""
    if named:
        path = Path(named).expanduser()
        if not path.is_file():
            raise UsageError(f"there is no program '{named}', which the add-on's preferences name")
        return path
    if own.is_file():
        own.chmod(own.stat().st_mode | 0o111)  # what unpacks add-ons forgets it
        return own
    found = shutil.which("covary")
    if not found:
        raise UsageError("the program covary is missing: install it (pip install covary, or make install), or name it "
                         "in the add-on's preferences (Edit, Preferences, Add-ons, covary)")
    return Path(found)


def check(program: Path) -> str:
    """Its version. Raises UsageError if it does not run, so that this is known before the groups are rendered."""
    try:
        run = subprocess.run([program, "--version"], capture_output=True, text=True, check=False, env=environment())
    except OSError as error:
        raise UsageError(f"'{program}' does not run: {error.strerror}") from error
    words = run.stdout.split()
    if run.returncode or not words:
        raise UsageError(f"'{program}' does not run: {reason(run.stderr) or f'exit code {run.returncode}'}")
    return words[min(1, len(words) - 1)]


def environment() -> dict[str, str]:
    """This process's environment without Blender's settings for its own Python and libraries."""
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONHOME", "PYTHONPATH")}


def command(program: Path, files: Mapping[str, Sequence[str]], output: str, denoise: str,
            statistics: str) -> list[str]:
    """Makes one image of files of groups, by their kind. Errors of its checks are only warnings here: the add-on
    rendered these files correctly, and a white world only looks like clipped values."""
    if "crn" not in files:
        return [str(program), "denoise", "--force", "--overwrite", *files["independent"], "-o", output, "--json",
                statistics]
    return [str(program), "combine", "--force", "--overwrite", "--crn", *files["crn"], "--independent",
            *files["independent"], "-o", output, "--denoise", denoise, "--json", statistics]


def comparison(program: Path, image: str, other: str) -> list[str]:
    """Compares two groups; read_error() takes what it prints."""
    return [str(program), "compare", image, "--reference", other, "--metric", "relmse", "--json", "-"]


def read_error(printed: str, groups: int) -> float | None:
    """The relMSE of the mean of as many groups, from the relMSE of two of them, which is twice that of one; None if
    there is no number. The noise of a group is in the denominator, too, so this is a rough one."""
    try:
        return float(json.loads(printed)["relmse"]) / (2 * groups)
    except (KeyError, TypeError, ValueError):
        return None


def remaining(seconds: float) -> str:
    """75 -> "1:15 left", 4000 -> "1:06:40 left"."""
    whole = max(0, round(seconds))
    minutes = f"{whole // 60 % 60:02}:{whole % 60:02}" if whole >= 3600 else f"{whole // 60}:{whole % 60:02}"
    return (f"{whole // 3600}:{minutes}" if whole >= 3600 else minutes) + " left"


def reason(messages: str) -> str:
    """The last line of a program's output, without the program's name."""
    lines = messages.strip().splitlines()
    return lines[-1].strip().removeprefix("covary: ").removeprefix("error: ") if lines else ""


def warnings(messages: str) -> list[str]:
    """The warnings among the program's messages."""
    return [line.removeprefix("warning: ") for line in messages.splitlines() if line.startswith("warning: ")]


def verdict(statistics: str) -> str:
    """The program's measurements in a sentence; "" if there are none."""
    try:
        values = json.loads(Path(statistics).read_text())
    except (OSError, ValueError):
        return ""
    ours = values.get("predicted_relmse")
    # Of a pair, half of the samples are independent.
    theirs = values.get("independent_predicted_relmse", 0) / 2 or values.get("risks", {}).get("mean")
    return "" if ours is None or theirs is None else sentence(ours, theirs)


def sentence(ours: float, plain: float) -> str:
    """Compares the predicted error with that of as many independent samples, half of which were rendered. A plain
    Cycles render has less error than independent groups: up to a third less was measured."""
    if ours < plain / 1.5:
        return f"Predicted error (relMSE) {ours:.2g}; independent samples would have {plain:.2g}."
    gain = "nothing" if ours >= plain else "little"
    return (f"Predicted error (relMSE) {ours:.2g}; independent samples would have {plain:.2g}: {gain} is gained here, "
            "and Cycles alone may be as good.")
