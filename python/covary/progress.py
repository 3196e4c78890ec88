# SPDX-License-Identifier: Apache-2.0
"""Progress for `progress=`: a line of text, True, which is the default on a terminal and in a notebook; False for none;
or a bar of tqdm. A function gets (done, total); one of three arguments also gets the phase of a render, "auxiliary
images", "samples", "denoising" …, and is called from its beginning on. The numbers are pixels of auxiliary images, and
samples; in later phases they stay."""
from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

#: Called with the samples done, their total (0 if unknown), and the phase.
Phases = Callable[[int, int, str], object]
RenderProgress = Union[Callable[[int, int], object], Phases, bool]
#: Called with (done, total) steps.
Counted = Callable[[int, int], object]
Progress = Union[Counted, bool]

__all__ = ["line", "tqdm"]

_BEFORE = ("short trials", "training", "auxiliary images")  # functions of two arguments do not hear of these
_SHOWN = ("training", "auxiliary images", "samples")  # phases with numbers of their own


def in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return shell is not None and hasattr(shell, "kernel")


def is_watched() -> bool:
    """Whether somebody sees standard error now."""
    return in_notebook() or (sys.stderr is not None and sys.stderr.isatty())


class Line:
    """A line on standard error, drawn again in place; where nobody watches, a new line for each phase."""

    def __init__(self) -> None:
        self._phase, self._length = "", 0

    def __call__(self, *told: Any) -> None:
        """(done, total, phase), or a text."""
        if len(told) == 1:
            if is_watched():
                self.show(str(told[0]))
            return
        done, total, phase = told
        text = f"{phase} {done / total:.0%}" if total and phase in _SHOWN else phase
        if is_watched():
            self.show("" if phase == "writing" else text)  # the last
        elif phase != self._phase:
            print(phase, file=sys.stderr, flush=True)
        self._phase = phase

    def show(self, text: str) -> None:
        """Draws this text; over what is longer, blanks, which notebooks know, too."""
        if text or self._length:
            print(f"\r{text:<{self._length}}" + ("" if text else "\r"), end="", file=sys.stderr, flush=True)
        self._length = len(text)

    def end(self) -> None:
        self.show("")


@contextmanager
def ended(shown: Any) -> Iterator[None]:
    """Removes the line, if it is one, however the work ends."""
    try:
        yield
    finally:
        if isinstance(shown, Line):
            shown.end()


def line() -> Phases:
    """A line on standard error, "samples 41 %"; what `progress=True` stands for. Without a terminal, a new line for
    each phase."""
    return Line()


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


def is_default(progress: Any) -> bool:
    """Whether no function was given, and a line is wanted: True, or None where somebody watches."""
    return progress is True or (progress is None and is_watched())


def _phases(progress: RenderProgress | None) -> Phases | None:
    """The function that a render calls."""
    if is_default(progress):
        return line()
    if progress is None or isinstance(progress, bool):
        return None
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


def steps(progress: Progress | None, words: str, *, shown: bool | None = None) -> Counted | None:
    """The function that work in steps calls; `words`: what they are, "frames". `shown`: whether there is a line without
    being asked for, by default where somebody watches."""
    if progress is True or (progress is None and (is_watched() if shown is None else shown)):
        lines = Line()

        def show(done: int, total: int) -> None:
            text = f"{words}: {done} of {total}"
            if not is_watched():
                print(text, file=sys.stderr, flush=True)
            else:
                lines.show(text if done < total else "")

        return show
    return None if isinstance(progress, bool) else progress
