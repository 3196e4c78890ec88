# SPDX-License-Identifier: Apache-2.0
"""Rendering on a cluster by Dask (`pip install distributed`): tiles and ranges of samples on workers, which may come,
go and die.

A part is a tile of the frame and a seed. What a worker renders follows from the part alone, so a part that is lost with
its worker is rendered again with the same bits, on any other, and each part enters the film once. Tiles are put
together to the film of one machine in every bit; films of several seeds are merged as merge_films() does it."""
from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._cluster import SceneFiles, check_versions, dask, make_plugin
from ._combine import Progress, combine
from ._experiment import experiment, main
from ._options import OptionValue, check_no_passes, text_options
from ._render import Scene
from ._render import render as render_here
from ._result import Result, fields_of
from .errors import Error, InputError, UsageError
from .film import Film, merge_films

if TYPE_CHECKING:
    from ._result import FloatArray
    from .estimators import Estimator

__all__ = ["ClusterResult", "SceneFiles", "experiment", "main", "render"]

#: Estimators that look at films after the passes, and do not change what passes take.
_ESTIMATORS = ("iicv", "cv-baseline", "iduw", "none")
_RETRIES = 5  # of a part that an error of the machine ended; dead workers are counted by Dask (allowed-failures)


@dataclass(frozen=True)
class _Part:
    crop: tuple[int, int, int, int]
    seed: int
    number: int


@dataclass(frozen=True)
class _Job:
    """What all parts have in common."""

    scene_folder: str
    file: str
    loading: dict[str, Any]
    settings: dict[str, Any]
    folder: str = field(default="")


_scenes: dict[tuple[str, str], Scene] = {}


@dataclass(frozen=True)
class _Rendered:
    """Of a part: the films of its passes, and the images that guide a denoiser where one is wanted."""

    films: dict[str, Film]
    aovs: dict[str, FloatArray] = field(default_factory=dict)


def _render_part(job: _Job, part: _Part) -> _Rendered | Error:
    """On a worker: what a part leaves behind, or what is wrong with all parts, so that Dask does not try again."""
    from distributed import get_worker  # type: ignore[import-not-found,import-untyped,unused-ignore]

    folder = Path(job.folder or get_worker().local_directory) / job.scene_folder
    key = (str(folder / job.file), repr(sorted(job.loading.items())))
    try:
        if key not in _scenes:
            _scenes.clear()  # one scene in memory at a time
            _scenes[key] = Scene(key[0], job.loading)
        made = render_here(_scenes[key], crop=part.crop, seed=part.seed, films_only=True, **job.settings)
        return _Rendered(made.films, made.aovs)
    except (InputError, UsageError) as error:
        return error


def _tiles(width: int, height: int, side: int) -> Iterator[tuple[int, int, int, int]]:
    for y in range(0, height, side):
        for x in range(0, width, side):
            yield x, y, min(side, width - x), min(side, height - y)


class _Canvas:
    """Films of the whole frame in the making, one for each pass and seed."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.arrays: dict[tuple[int, str], tuple[Any, Any, dict[str, str]]] = {}
        self.aovs: dict[str, FloatArray] = {}
        self.parts: set[int] = set()

    def add(self, part: _Part, rendered: _Rendered) -> None:
        import numpy

        if part.number in self.parts:
            raise RuntimeError(f"part {part.number} came twice")
        self.parts.add(part.number)
        x, y, width, height = part.crop
        for name, image in rendered.aovs.items():
            whole = self.aovs.setdefault(name, numpy.zeros((self.height, self.width, 3), numpy.float32))
            whole[y:y + height, x:x + width] = image
        for name, film in rendered.films.items():
            groups = film.groups
            if (part.seed, name) not in self.arrays:
                self.arrays[part.seed, name] = (
                    numpy.zeros((self.height, self.width, groups.shape[0], 3), numpy.float32),
                    numpy.zeros((self.height, self.width), numpy.uint32), dict(film.attributes))
            values, counts, _ = self.arrays[part.seed, name]
            values[y:y + height, x:x + width] = groups.transpose(1, 2, 0, 3)
            counts[y:y + height, x:x + width] = film.counts

    def films(self) -> dict[str, Film]:
        made: dict[str, list[Film]] = {}
        for (_, name), (values, counts, attributes) in sorted(self.arrays.items()):
            film = Film._from_parts((self.width, self.height), (0, 0, self.width, self.height), values, counts,
                                    attributes)
            made.setdefault(name, []).append(film)
        return {name: merge_films(films) if len(films) > 1 else films[0] for name, films in made.items()}

    def image(self) -> FloatArray:
        """The mean of all samples so far, black where there are none."""
        import numpy

        total = numpy.zeros((self.height, self.width, 3))
        samples = numpy.zeros((self.height, self.width, 1))
        for values, counts, _ in self.arrays.values():
            total += values.mean(axis=2) * counts[..., None]
            samples += counts[..., None]
        return (total / numpy.maximum(samples, 1)).astype(numpy.float32)


@dataclass(frozen=True)
class ClusterResult(Result):
    """What has become of render()."""

    films: dict[str, Film] = field(repr=False)
    #: Parts that were rendered, and seconds from the first to the last.
    parts: int
    render_seconds: float


def render(client: Any, scene: Scene | str | os.PathLike[str], spp: int, estimator: Estimator = "iicv", *,
           seed: int = 0, sample_ranges: int = 1, tile: int = 128, progress: Progress | None = None,
           on_image: Callable[[FloatArray], object] | None = None, image_seconds: float = 5.0,
           settings: Mapping[str, Any] | None = None, **options: OptionValue) -> ClusterResult:
    """Renders on the workers of a dask.distributed.Client.

    spp: samples per pixel of all passes and ranges together.
    sample_ranges: into how many seeds, `seed` and those that follow, the samples are divided; their films are merged.
        With 1 the result has the bits of `covary.render(scene, spp, estimator, seed=seed)`, with more those of
        merge_films() of such renders, for any number of workers and whatever becomes of them.
    tile: side of the tiles that are parts, in pixels.
    progress: called with (done, total) parts.
    on_image: called with the mean of all samples so far, at most every `image_seconds`.
    settings: further keywords of covary.render() for the passes: filter, groups, split, ….
    options: of the estimator, and denoise and oidn of combine(), whose guides are rendered, too.

    Raises UsageError for estimators and integrators whose passes look beyond a tile.
    """
    distributed = dask()
    if estimator not in _ESTIMATORS:
        raise UsageError(f"estimator '{estimator}' looks at other pixels or samples while it renders; on a cluster "
                         f"accepted are {', '.join(_ESTIMATORS)}")
    texts = text_options(options)
    check_no_passes([*options, *(settings or {})], "it looks at the whole frame, of which a worker has a tile")
    if tile < 1 or sample_ranges < 1 or spp % sample_ranges:
        raise UsageError(f"found tile {tile} and {spp} samples in {sample_ranges} ranges; tiles have one pixel or "
                         "more, and the ranges divide the samples")
    chosen = scene if isinstance(scene, Scene) else Scene.load(scene)
    if chosen.integrator not in ("path", ""):
        raise UsageError(f"the integrator '{chosen.integrator}' trains or traces light over the whole frame; on a "
                         "cluster accepted is path")
    check_versions(client)
    files = SceneFiles(chosen)
    client.register_plugin(make_plugin(files))
    passed = {"spp": spp // sample_ranges, "estimator": estimator, **(settings or {}),
              **{name.replace("-", "_"): value or True for name, value in texts.items()}}
    job = _Job(files.folder, files.file, chosen._loading, passed)
    width, height = chosen.resolution
    parts = [_Part(crop, seed + r, 0) for r in range(sample_ranges) for crop in _tiles(width, height, tile)]
    parts = [_Part(part.crop, part.seed, number) for number, part in enumerate(parts)]
    canvas = _Canvas(width, height)
    started = last_image = time.monotonic()
    futures = {client.submit(_render_part, job, part, pure=False, retries=_RETRIES): part for part in parts}
    try:
        for future in distributed.as_completed(futures):
            rendered = future.result()
            if isinstance(rendered, Error):
                raise rendered
            canvas.add(futures[future], rendered)
            future.release()
            if progress is not None:
                progress(len(canvas.parts), len(parts))
            if on_image is not None and time.monotonic() - last_image >= image_seconds:
                on_image(canvas.image())
                last_image = time.monotonic()
    except BaseException:
        client.cancel(list(futures))
        raise
    seconds = time.monotonic() - started
    return _result(canvas, estimator, options, len(parts), seconds)


def _result(canvas: _Canvas, estimator: str, options: Mapping[str, Any], parts: int, seconds: float) -> ClusterResult:
    films = canvas.films()
    samples = sum(film.samples_per_pixel for film in films.values())
    if estimator == "none":
        made = Result(next(iter(films.values())).mean, None, None, None, [], 0, "none", samples)
    else:
        made = combine(films["crn"], films["independent"], estimator, force=True,  # type: ignore[arg-type]
                       albedo=canvas.aovs.get("Albedo"), normal=canvas.aovs.get("N"), **options)
    given = fields_of(made) | {"warnings": [], "samples_per_pixel": samples}
    return ClusterResult(**given, films=films, parts=parts, render_seconds=seconds)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
