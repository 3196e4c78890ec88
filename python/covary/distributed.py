# SPDX-License-Identifier: Apache-2.0
"""Rendering on a Dask cluster (`pip install distributed`): tiles and ranges of samples on workers, which may join,
leave and crash.

A part is a tile of the frame and a seed. These alone determine what a worker renders. So any worker can render a part
that was lost with another, with the same bits, and each part enters the film once. The tiles make up the same film as
on one machine, bit for bit; merge_films() merges films of several seeds. With a folder, parts are saved as they arrive,
and a restarted render uses them."""
from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import array, check_some, checked, function, mapping_of, optional, path, real, text, whole
from ._cluster import CLIENT, SceneFiles, check_versions, dask, make_plugin, results
from ._combine import PROGRESS, check_options, combine, features_of
from ._experiment import experiment, main
from ._frames import frames
from ._options import DEFAULT, check_no_passes, estimators_of_films, option_texts, passes_of
from ._parts import Part, PartFolder, Rendered
from ._render import SCENE, SEED, SPP, Scene, report_bad_samples
from ._render import render as render_here
from ._result import BadSample, RenderResult, Result, fields_of
from .errors import Error, InputError, IoError, UsageError
from .film import Film, merge_films
from .progress import Progress, steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import ImageOptions
    from ._result import FloatArray
    from .estimators import Estimator

__all__ = ["ClusterResult", "SceneFiles", "experiment", "frames", "main", "render"]

_ESTIMATORS = estimators_of_films()
#: Those of one pass.
_OF_ONE_IMAGE = (None, *(name for name in _ESTIMATORS if passes_of(name) != "pair"))
#: Options of an image made from one pass.
_OF_ONE_PASS = ("denoise", "oidn")
#: Keywords of covary.render() that say what is sampled.
_SETTINGS = ("filter", "sampling", "sampler", "groups", "split")


@dataclass(frozen=True)
class _Job:
    """What all parts share."""

    scene_folder: str
    file: str
    path: str  #: where the caller has it
    loading: dict[str, Any]
    settings: dict[str, Any]


_scenes: dict[tuple[str, str], Scene] = {}


def _render_part(job: _Job, part: Part) -> Rendered | Error:
    """Runs on a worker; returns a part's result, or an error that all parts share, so that Dask does not retry."""
    from distributed import get_worker  # type: ignore[import-not-found,import-untyped,unused-ignore]

    folder = Path(get_worker().local_directory) / job.scene_folder
    key = (str(folder / job.file), repr(sorted(job.loading.items())))
    try:
        if key not in _scenes:
            _scenes.clear()  # one scene in memory at a time
            _scenes[key] = Scene(key[0], job.loading)
            _scenes[key]._path = job.path  # what commands name
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the caller tells them
            made = render_here(_scenes[key], crop=part.crop, seed=part.seed, films_only=True, progress=False,
                               **job.settings)
        told = made.warnings[:-1] if made.bad_samples else made.warnings  # the last is about them
        return Rendered(made.films, made.aovs, tuple(told), made.not_finite_samples, made.negative_samples,
                        tuple(made.bad_samples))
    except (InputError, UsageError) as error:
        return error


def _tiles(width: int, height: int, side: int) -> Iterator[tuple[int, int, int, int]]:
    for y in range(0, height, side):
        for x in range(0, width, side):
            yield x, y, min(side, width - x), min(side, height - y)


def _first_of_each_film(samples: list[BadSample]) -> list[BadSample]:
    """The first few by pixel and sample, as many as a render of the whole frame reports."""
    kept: dict[str, list[BadSample]] = {}
    for bad in sorted(samples, key=lambda bad: (bad.y, bad.x, bad.sample)):
        of_film = kept.setdefault(bad.film, [])
        if len(of_film) < 10:
            of_film.append(bad)
    return [bad for film in sorted(kept) for bad in kept[film]]


class _Canvas:
    """Unfinished films of the whole frame, one for each pass and seed."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.arrays: dict[tuple[int, str], tuple[Any, Any, dict[str, str]]] = {}
        self.aovs: dict[str, FloatArray] = {}
        self.parts: set[int] = set()
        self.not_finite_samples = self.negative_samples = 0
        self.bad_samples: list[BadSample] = []
        self.warnings: dict[str, None] = {}  # each once, in the order of arrival

    def add(self, part: Part, rendered: Rendered) -> None:
        import numpy

        if part.number in self.parts:
            raise RuntimeError(f"part {part.number} came twice")
        self.parts.add(part.number)
        self.not_finite_samples += rendered.not_finite_samples
        self.negative_samples += rendered.negative_samples
        self.bad_samples = _first_of_each_film(self.bad_samples + list(rendered.bad_samples))
        self.warnings.update(dict.fromkeys(rendered.warnings))
        x, y, width, height = part.crop
        for name, image in rendered.aovs.items():
            frame = self.aovs.setdefault(name, numpy.zeros((self.height, self.width, *image.shape[2:]), numpy.float32))
            frame[y:y + height, x:x + width] = image
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
        """The mean of all samples so far, black without samples."""
        import numpy

        total = numpy.zeros((self.height, self.width, 3))
        samples = numpy.zeros((self.height, self.width, 1))
        for values, counts, _ in self.arrays.values():
            total += values.mean(axis=2) * counts[..., None]
            samples += counts[..., None]
        return (total / numpy.maximum(samples, 1)).astype(numpy.float32)


@dataclass(frozen=True, repr=False, eq=False)
class ClusterResult(Result):
    """The result of render()."""

    films: dict[str, Film] = field(repr=False)
    #: Number of parts of the frame, and how many of them were already in the folder.
    parts: int
    parts_kept: int
    #: Seconds from the first part to the last.
    render_seconds: float
    #: As in RenderResult; the first bad samples of each part.
    not_finite_samples: int
    negative_samples: int
    bad_samples: list[BadSample]


@dataclass(frozen=True)
class _Plan:
    """A checked render: what workers do, and what is made of it."""

    scene: Scene
    estimator: str | None
    options: dict[str, Any]  #: for combine(), or for the image of one pass
    settings: dict[str, Any]  #: for covary.render()
    parts: list[Part]


def _plan(scene: Scene, spp: int, estimator: str | None, seed: int, sample_ranges: int, tile: int,
          settings: Mapping[str, Any], options: Mapping[str, Any]) -> _Plan:
    """Raises every error that any part, or the estimate at the end, would cause, before rendering."""
    if estimator is not None and estimator not in _ESTIMATORS:
        raise UsageError(f"estimator '{estimator}' looks at other pixels or samples while it renders; on a cluster "
                         f"expected one of {', '.join(_ESTIMATORS)}")
    check_no_passes([*options, *settings], "it looks at the whole frame, of which a worker has a tile")
    if unknown := set(settings) - set(_SETTINGS):
        raise UsageError(f"settings: found {min(unknown)!r}; expected one of {', '.join(_SETTINGS)}")
    settings = check_some(render_here, settings, "settings")
    if spp % sample_ranges or seed + sample_ranges > 1 << 64:
        raise UsageError(f"sample_ranges: found {sample_ranges} with {spp} samples and seed {seed}; the ranges divide "
                         "the samples, and each has a seed of its own from `seed` on")
    if scene.integrator not in ("path", ""):
        raise UsageError(f"the integrator '{scene.integrator}' trains or traces light over the whole frame; on a "
                         "cluster use path")
    if estimator is None or estimator in _OF_ONE_IMAGE:
        check_some(render_here, options)
        if unknown := set(options) - set(_OF_ONE_PASS):
            raise UsageError(f"{min(unknown)}: is not an argument of estimator {estimator or DEFAULT!r}; expected "
                             f"one of {', '.join(_OF_ONE_PASS)}")
    else:
        check_options(estimator, options)
    of_combine = {"force", "std_error"}
    passed = {"spp": spp // sample_ranges, "estimator": estimator, **settings,
              **{name: value for name, value in options.items() if name not in of_combine}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # One pixel meets all the rest.
        render_here(scene, crop=(0, 0, 1, 1), seed=seed, films_only=True, progress=False, **passed)
    places = [(crop, seed + r) for r in range(sample_ranges) for crop in _tiles(*scene.resolution, tile)]
    return _Plan(scene, estimator, dict(options), passed,
                 [Part(crop, own_seed, number) for number, (crop, own_seed) in enumerate(places)])


@checked(client=CLIENT, scene=SCENE, spp=SPP, estimator=optional(text), seed=SEED, sample_ranges=whole(1, 1 << 20),
         tile=whole(1, 65536), folder=optional(path), progress=PROGRESS, on_image=optional(function),
         image_seconds=real(0), settings=optional(mapping_of(array, "a mapping from keywords of covary.render()")))
def render(client: Any, scene: Scene | str | os.PathLike[str], spp: int, estimator: Estimator | None = None, *,
           seed: int = 0, sample_ranges: int = 1, tile: int = 128, folder: str | os.PathLike[str] | None = None,
           progress: Progress | None = None, on_image: Callable[[FloatArray], object] | None = None,
           image_seconds: float = 5.0, settings: Mapping[str, Any] | None = None,
           **options: Unpack[ImageOptions]) -> ClusterResult:
    """Renders on the workers of a dask.distributed.Client.

    spp: samples per pixel of all passes and ranges together.
    estimator: as in covary.render().
    sample_ranges: number of seeds, from `seed` on, among which the samples are divided; their films are merged.
        With 1 the result has the bits of `covary.render(scene, spp, estimator, seed=seed)`, with more those of
        merge_films() of such renders, for any number of workers, even if some fail.
    tile: side of a tile, in pixels.
    folder: where this machine saves each part as it arrives; a later render with the same scene and settings uses what
        is there, even if this process has died.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) parts.
    on_image: called with the mean of all samples so far, at most every `image_seconds`.
    settings: further keywords of covary.render() for the passes: filter, sampling, sampler, groups, split.
    options: of the estimator, and denoise and oidn, whose features are rendered, too.

    Before anything is rendered, raises UsageError for estimators and integrators whose passes look beyond a tile, and
    for all errors in options. Raises IoError when the scheduler dies.
    """
    from distributed.comm.core import CommClosedError  # type: ignore[import-not-found,import-untyped,unused-ignore]

    chosen = scene if isinstance(scene, Scene) else Scene.load(scene)
    plan = _plan(chosen, spp, estimator, seed, sample_ranges, tile, settings or {}, options)
    check_versions(client)
    files = SceneFiles(chosen)
    kept = None if folder is None else PartFolder(fspath(folder), {
        "scene": files.hash, "file": files.file, "loading": chosen._loading, "settings": plan.settings})
    client.register_plugin(make_plugin(files))
    job = _Job(files.folder, files.file, chosen.path, chosen._loading, plan.settings)
    canvas = _Canvas(*chosen.resolution)
    last_image = started = time.monotonic()
    shown = steps(progress, "parts")

    def show() -> None:
        nonlocal last_image
        if shown is not None:
            shown(len(canvas.parts), len(plan.parts))
        if on_image is not None and time.monotonic() - last_image >= image_seconds:
            on_image(canvas.image())
            last_image = time.monotonic()

    left = _take_kept(kept, plan.parts, canvas)
    n_kept = len(canvas.parts)
    if n_kept:
        show()
    try:
        for part, rendered in results(client, _render_part, ((part, (job, part)) for part in left)):
            if isinstance(rendered, Error):
                raise rendered
            if kept is not None:
                kept.keep(part, rendered)
            canvas.add(part, rendered)
            show()
    except (dask().CancelledError, CommClosedError) as error:
        if isinstance(error, dask().CancelledError) and client.status == "running":
            raise  # by the caller
        rest = ("without folder= they are lost" if folder is None else
                f"they are kept in {fspath(folder)!r}: with a new client the same call asks for the others only")
        raise IoError(f"Dask's scheduler {client.scheduler.address} is gone after {len(canvas.parts)} of "
                      f"{len(plan.parts)} parts; {rest}") from error
    return _result(canvas, plan, n_kept, time.monotonic() - started)


def _take_kept(kept: PartFolder | None, parts: list[Part], canvas: _Canvas) -> list[Part]:
    """Puts parts of the folder into the canvas; returns the others."""
    left = []
    for part in parts:
        rendered = kept.load(part) if kept is not None else None
        if rendered is None:
            left.append(part)
        else:
            canvas.add(part, rendered)
    return left


def _result(canvas: _Canvas, plan: _Plan, n_kept: int, seconds: float) -> ClusterResult:
    made: Result
    films = canvas.films()
    samples = sum(film.samples_per_pixel for film in films.values())
    if plan.estimator in _OF_ONE_IMAGE:
        values = option_texts({"estimator": plan.estimator, **plan.options})
        made = RenderResult(**_covary.image_of_films(values, {}, films, canvas.aovs))
    else:
        made = combine(films["crn"], films["independent"], plan.estimator,  # type: ignore[arg-type]
                       **{"force": True, **features_of(canvas.aovs), "clean_features": "Albedo" in canvas.aovs,
                          **plan.options})
    given = fields_of(made) | {"warnings": list(canvas.warnings), "samples_per_pixel": samples,
                               "not_finite_samples": canvas.not_finite_samples,
                               "negative_samples": canvas.negative_samples, "bad_samples": canvas.bad_samples}
    report_bad_samples(given)
    return ClusterResult(**given, films=films, parts=len(canvas.parts), parts_kept=n_kept, render_seconds=seconds)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
