# SPDX-License-Identifier: Apache-2.0
"""Renders that are seen while they run."""
from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ._arguments import checked, optional, text
from ._render import SCENE, SPP, PathOrScene, render
from ._result import RenderResult
from .progress import _phases

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from ._keywords import RenderArguments
    from .estimators import Estimator

    FloatArray = NDArray[numpy.float32]


@dataclass(frozen=True, eq=False)
class Step:
    """An image on the way, and what is known of its error.

    image: Linear Rec. 709, [H, W, 3]: the mean of the samples so far or, after an estimate, what it made of them.
    std_error: estimated standard error of each value, [H, W, 3]; None if there are too few samples to tell.
    samples_per_pixel: over all passes, on average.
    predicted_relmse: relMSE that the standard errors predict; None without them.
    predicted_bounds: bounds between which the relMSE lies in 80 of 100 renders; None if they are not known.
    result: of render(), in the last step; None before.
    """

    image: FloatArray = field(repr=False)
    std_error: FloatArray | None = field(repr=False)
    samples_per_pixel: float
    predicted_relmse: float | None
    predicted_bounds: tuple[float, float] | None
    result: RenderResult | None = field(repr=False, default=None)


class _Closed(Exception):
    """The caller wants no more steps."""


class _Watcher:
    """render()'s `progress`, which also takes steps; the newest replaces one that was not fetched."""

    def __init__(self, progress: Any) -> None:
        self._progress = None if progress is None else _phases(progress)  # steps are seen, too
        self._changed = threading.Condition()
        self._step: Step | None = None
        self._closed = self._ended = False
        self.error: BaseException | None = None

    def __call__(self, done: int, total: int, phase: str) -> None:
        if self._closed:
            raise _Closed
        if self._progress is not None:
            self._progress(done, total, phase)

    def step(self, *values: Any) -> None:
        """Called by the extension module."""
        self.put(Step(*values))

    def put(self, step: Step) -> None:
        with self._changed:
            self._step = step
            self._changed.notify()

    def end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()

    def close(self) -> None:
        self._closed = True

    def next(self) -> Step | None:
        """Waits for a step; None after the last one."""
        with self._changed:
            while self._step is None and not self._ended:
                self._changed.wait(0.1)
            step, self._step = self._step, None
            return step


@checked(scene=SCENE, spp=optional(SPP), estimator=optional(text))
def render_progressively(scene: PathOrScene, spp: int | None = None, estimator: Estimator | None = None,
                         **arguments: Unpack[RenderArguments]) -> Iterator[Step]:
    """Renders as render() does, with its arguments and to the same bits, and yields images on the way:

        for step in covary.render_progressively("room", until=1e-3):
            print(step.samples_per_pixel, step.predicted_relmse)

    Steps come when they cost little, first often and then more rarely, and the last one has the `result`. Leaving the
    loop ends the render. Raises what render() raises.
    """
    keywords: dict[str, Any] = dict(arguments)
    watcher = _Watcher(keywords.pop("progress", None))

    def run() -> None:
        try:
            result = render(scene, spp, estimator, progress=watcher, **keywords)
            watcher.put(Step(result.image, result.std_error, result.samples_per_pixel or 0.0, result.predicted_relmse,
                             result.predicted_bounds, result))
        except BaseException as error:  # noqa: BLE001  raised again in the caller's thread
            watcher.error = error
        finally:
            watcher.end()

    thread = threading.Thread(target=run, name="covary.render_progressively", daemon=True)
    thread.start()
    try:
        while (step := watcher.next()) is not None:
            yield step
    finally:
        watcher.close()
        thread.join()
    if watcher.error is not None:
        raise watcher.error
