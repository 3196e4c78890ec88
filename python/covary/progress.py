# SPDX-License-Identifier: Apache-2.0
"""Progress for `progress=`: a line of text, `progress=True`, or a bar of tqdm. A function gets (done, total); one of
three arguments also gets the phase of a render, "auxiliary images", "samples", "denoising" …, and is called from its
beginning on. The numbers are pixels of auxiliary images, and samples; in later phases they stay."""
from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable
from typing import Any, Union

#: Called with the samples done, their total (0 if unknown), and the phase.
Phases = Callable[[int, int, str], object]
RenderProgress = Union[Callable[[int, int], object], Phases, bool]

_BEFORE = ("short trials", "training", "auxiliary images")  # functions of two arguments do not hear of these
_SHOWN = ("training", "auxiliary images", "samples")  # phases with numbers of their own


def line() -> Phases:
    """A line on standard error, "samples 41 %"; what `progress=True` stands for. Without a terminal, a new line for
    each phase."""
    shown = [""]

    def update(done: int, total: int, phase: str) -> None:
        if sys.stderr.isatty():
            text = f"{phase} {done / total:.0%}" if total and phase in _SHOWN else phase
            end = "\r\033[K" if phase == "writing" else ""  # the last
            print(f"\r{text}\033[K", end=end, file=sys.stderr, flush=True)
        elif phase != shown[0]:
            print(phase, file=sys.stderr, flush=True)
        shown[0] = phase

    return update


def tqdm(**options: Any) -> Any:
    """A bar of tqdm (`pip install tqdm`), which takes the options: `render(…, progress=covary.progress.tqdm())`."""
    try:
        bar = importlib.import_module("tqdm.auto").tqdm(**options)
    except ImportError as error:
        raise ImportError("covary.progress.tqdm() needs the package tqdm: pip install tqdm") from error

    def update(done: int, total: int, phase: str = "") -> None:
        if phase:
            bar.set_description(phase, refresh=False)
        bar.total = total or None
        bar.n = done
        bar.refresh()
        if phase == "writing" or (not phase and done >= total):
            bar.close()

    return update


def _phases(progress: RenderProgress | None) -> Phases | None:
    """The function that a render calls."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return line()
    function: Any = progress
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):  # of built-in functions
        parameters = []
    places = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    if len(places) >= 3 or any(p.kind is p.VAR_POSITIONAL for p in parameters):
        return function  # type: ignore[no-any-return]

    def counted(done: int, total: int, phase: str) -> None:
        if phase not in _BEFORE and total:
            function(done, total)

    return counted
