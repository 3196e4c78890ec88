# SPDX-License-Identifier: Apache-2.0
"""Scenes and rendering."""
from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Literal, Union

from . import _covary
from ._combine import DenoiseMode, Progress
from ._options import OptionValue, text_options
from ._result import RenderResult
from .errors import UsageError

if TYPE_CHECKING:
    from .estimators import Estimator

PathOrScene = Union[str, "PathLike[str]", "Scene"]


class Scene:
    """A scene in memory, with the integrator that it is rendered by. Made by Scene.load()."""

    def __init__(self, path: str, loading: dict[str, Any]) -> None:
        self._path, self._loading = path, loading
        self._loaded = _covary.load_scene(path, **loading)

    @staticmethod
    def load(path: str | PathLike[str], *, resolution: tuple[int, int] | None = None, integrator: str = "",
             min_depth: int | None = None, max_depth: int | None = None,
             integrator_options: Mapping[str, bool | int | float | str] | None = None,
             defines: Mapping[str, object] | None = None) -> Scene:
        """Reads a Mitsuba XML scene.

        resolution: (width, height) of the full frame in place of the scene's.
        integrator: "path", "bdpt", … in place of the scene's.
        min_depth, max_depth: fewest and most edges of a path; -1 for no limit.
        integrator_options: properties of the <integrator> element, in place of the file's or beside them.
        defines: values of the scene's <default> names, `-D` of the command line.
        Raises InputError with every problem of the file.
        """
        texts = {name: str(value) for name, value in (defines or {}).items()}
        return Scene(fspath(path), {"defines": texts, "resolution": resolution, "integrator": integrator,
                                    "min_depth": min_depth, "max_depth": max_depth,
                                    "integrator_options": dict(integrator_options or {})})

    def with_integrator(self, integrator: str) -> Scene:
        """The scene, read again where it has another integrator than this."""
        if integrator in ("", self._loading["integrator"]):
            return self
        return Scene(self._path, {**self._loading, "integrator": integrator})

    @property
    def path(self) -> str:
        return self._path

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height of the full frame."""
        return self._loaded.width, self._loaded.height

    @property
    def spp(self) -> int:
        """Samples per pixel of the scene's sampler."""
        return self._loaded.spp

    @property
    def integrator(self) -> str:
        """Name of the integrator; "" where the file has none and none was asked for."""
        name: str = self._loading["integrator"] or self._loaded.integrator
        return name

    @property
    def warnings(self) -> list[str]:
        return list(self._loaded.warnings)

    @property
    def files(self) -> list[str]:
        """All files that the scene's file names and that were read."""
        return list(self._loaded.files)

    @property
    def content_hash(self) -> str:
        """Of the scene's XML, the defines and all files it reads."""
        return self._loaded.content_hash

    def __repr__(self) -> str:
        return f"<covary.Scene {self._path!r}, {self.resolution[0]} x {self.resolution[1]}>"


def render(scene: PathOrScene, spp: int | None = None, estimator: Estimator = "iicv", *, integrator: str = "",
           until: float | None = None, until_p95: float | None = None, time: float | None = None, seed: int = 0,
           denoise: DenoiseMode = "none", oidn: str | PathLike[str] = "",
           output: str | PathLike[str] | None = None, passes: str | PathLike[str] | None = None, resume: bool = False,
           overwrite: bool = False, checkpoint: float = 0, preview: bool = False, aovs: bool = False,
           path_lengths: bool = False, crop: tuple[int, int, int, int] | None = None,
           filter: Literal["box", "tent", "gaussian"] | None = None,
           sampling: Literal["independent", "crn"] = "independent",
           sampler: Literal["independent", "sobol"] | None = None,
           crn_part: Literal["both", "camera", "light"] = "both", groups: int | None = None,
           split: tuple[float, float] | None = None, films_only: bool = False,
           save_training: str | PathLike[str] | None = None,
           load_training: str | PathLike[str] | None = None, progress: Progress | None = None,
           **options: OptionValue) -> RenderResult:
    """Renders a scene, or the file of one, as `covary render` does; the values are the same in every bit.

    spp: samples per pixel of all passes together; by default the scene's, or no limit with `until` or `time`.
    estimator: "iicv" takes half of the samples with common random numbers; "none" is the mean. Its options follow as
        keywords.
    integrator: in place of the scene's.
    until: adds samples until the predicted relMSE is this; until_p95: until 95 % of the blocks of 16 x 16 pixels have
        no more.
    time: seconds for rendering and estimating together.
    denoise, oidn: as combine() has them; the guides are rendered.
    output: EXR file of the result; preview: also a PNG beside it.
    passes: folder that keeps the films; resume: continues those that are there; overwrite: replaces them;
        checkpoint: seconds between writing unfinished films.
    aovs: also the images Albedo, N and P; path_lengths: also images of paths of each length, by controlled-path.
    crop: x, y, width and height in the frame.
    sampling: of the one pass of estimator "none".
    sampler: "sobol" for Owen-scrambled Sobol' points in each group of samples; by default the scene's.
    groups: of samples whose means films keep; split: parts of the samples for the CRN and the independent pass.
    films_only: take the passes and make no image of them; result.image is then the mean of all samples.
    progress: called with (done, total) samples, up to 20 times a second.

    Ctrl-C ends the render within a tile; with `output` or `passes` what there is was kept, and `resume=True` continues.
    """
    chosen = scene if isinstance(scene, Scene) else Scene.load(scene, integrator=integrator)
    chosen = chosen.with_integrator(integrator)
    names = {"output": output, "passes": passes, "save_training": save_training, "load_training": load_training}
    request: dict[str, Any] = {name: None if path is None else fspath(path) for name, path in names.items()}
    request |= {"spp": spp, "seed": seed, "until": until, "seconds": time, "resume": resume, "overwrite": overwrite,
                "checkpoint": float(checkpoint), "preview": preview, "aovs": aovs, "crop": crop, "filter": filter,
                "sampler": sampler, "crn_part": crn_part, "path_lengths": path_lengths}
    if until_p95 is not None:
        if until is not None:
            raise UsageError("found until and until_p95; accepted is one of them")
        request |= {"until": until_p95, "until_in_blocks": True}
    made = _covary.render(chosen._loaded, estimator, text_options(options), denoise, fspath(oidn), sampling, groups,
                          split, films_only, request, progress)
    return RenderResult(**made)


def set_threads(n: int) -> None:
    """Limits the processors that covary uses in this process; 0: all. Raises ValueError for less."""
    _covary.set_threads(n)
