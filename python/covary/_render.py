# SPDX-License-Identifier: Apache-2.0
"""Scenes and rendering."""
from __future__ import annotations

import inspect
import shlex
import textwrap
from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Union

from . import _covary
from ._arguments import (
    check_names, check_some, checked, either, empty_or, flag, function, instance, mapping_of, optional, path, real,
    scalar, several, text, whole,
)
from ._combine import DENOISE
from ._options import DEFAULT, declared_rules, option_texts, text_options, underscored
from ._page import LivePage
from ._result import BadSample, RenderResult, text_of_bad_samples
from .errors import BadSamplesWarning, UsageError, _warn
from .progress import Line, Phases, RenderProgress, _phases, ended
from .scenes import _file_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import DenoiseMode, Filter, RenderOptions
    from .estimators import Estimator

PathOrScene = Union[str, "PathLike[str]", "Scene"]

_SCALARS = optional(mapping_of(scalar, "a mapping from names to True, False, numbers or texts"))
_CHECKPOINT_SECONDS = 300.0  # as the program


#: How Scene.load() and, of a file, render() and render_frames() see the scene.
VIEW_RULES = {
    "resolution": optional(several("(width, height), each from 1 to 65536", whole(1, 65536), whole(1, 65536))),
    "environment": either("a name or a file", path),
    "background": optional(either("a grey, or (R, G, B), linear numbers", real(0),
                                  several("", real(0), real(0), real(0)))),
    "camera": either("a name or a number from 1", text, whole(1)),
}


def view_options(environment: str | PathLike[str], background: object, camera: str | int) -> dict[str, str]:
    """As options of the program; without those at their defaults."""
    return option_texts({"environment": None if environment == "auto" else fspath(environment),
                         "background": background, "camera": None if camera == "" else str(camera)})


class Scene:
    """A scene in memory, with its integrator. Made by Scene.load()."""

    def __init__(self, path: str, loading: dict[str, Any]) -> None:
        self._path, self._loading = path, loading
        self._loaded = _covary.load_scene(path, **loading)

    @staticmethod
    @checked(path=path, **VIEW_RULES, integrator=text, min_depth=optional(whole(0, 1 << 30)),
             max_depth=optional(whole(-1, 1 << 30)), integrator_options=_SCALARS, defines=_SCALARS, ignore_unknown=flag)
    def load(path: str | PathLike[str], *, resolution: tuple[int, int] | None = None, integrator: str = "",
             min_depth: int | None = None, max_depth: int | None = None,
             integrator_options: Mapping[str, bool | int | float | str] | None = None,
             defines: Mapping[str, object] | None = None, environment: str | PathLike[str] = "auto",
             background: float | tuple[float, float, float] | None = None, camera: str | int = "",
             ignore_unknown: bool = False) -> Scene:
        """Reads a scene: Mitsuba XML, pbrt or glTF; or "room" and the other scenes.names() that come with the package.

        resolution: (width, height) of the full frame, instead of the scene's.
        integrator: "path", "bdpt", …, instead of the scene's.
        min_depth, max_depth: minimum and maximum edges of a path; -1 for no limit.
        integrator_options: properties of the <integrator> element, which override the file's.
        defines: values of the scene's <default> names, as by -D on the command line.
        environment: light from all around instead of the scene's own: "studio", "sky", "white", an image file, or
            "none"; "auto" is a studio with a floor if the scene has no light, or, in glTF, none that matters.
        background: linear colour where the camera sees no surface; it sheds no light.
        camera: name or number, from 1, of one of the scene's cameras; "auto" frames everything.
        ignore_unknown: unknown plugins and parameters are warnings; an unknown BSDF becomes grey.
        Raises InputError with every problem of the file.
        """
        texts = {name: str(value) for name, value in (defines or {}).items()}
        view = view_options(environment, background, camera)
        return Scene(_file_of(fspath(path)), {"defines": texts, "resolution": resolution, "integrator": integrator,
                                    "min_depth": min_depth, "max_depth": max_depth,
                                    "integrator_options": dict(integrator_options or {}), "view": view,
                                    "ignore_unknown": ignore_unknown})

    @checked(integrator=text)
    def with_integrator(self, integrator: str) -> Scene:
        """The scene, read again if its integrator is a different one."""
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
        """Name of the integrator; "" if neither the file nor the caller names one."""
        name: str = self._loading["integrator"] or self._loaded.integrator
        return name

    @property
    def warnings(self) -> list[str]:
        return list(self._loaded.warnings)

    @property
    def files(self) -> list[str]:
        """All files named by the scene file that were read."""
        return list(self._loaded.files)

    @property
    def content_hash(self) -> str:
        """Hash of the scene's XML, the defines and all files that it reads."""
        return self._loaded.content_hash

    def __repr__(self) -> str:
        return f"<covary.Scene {self._path!r}, {self.resolution[0]} x {self.resolution[1]}>"


#: Rules of arguments that several functions have.
SCENE = either("a covary.Scene, as Scene.load() makes it, or the name of its file",
               instance("a covary.Scene", lambda value: isinstance(value, Scene)), path)
SEED = whole(0, (1 << 64) - 1)
SPP = whole(1, _covary.most_samples)
PROGRESS = optional(either("a function, or True", flag, function))


def _check_together(given: Mapping[str, Any]) -> None:
    """Raises UsageError for arguments that have no effect in this combination."""
    def needs(names: tuple[str, ...], others: tuple[str, ...], what: str) -> None:
        for name in names:
            if given[name] and not any(given[other] is not None for other in others):
                raise UsageError(f"{name}: found {given[name]!r} without {what}, where it has no effect")

    needs(("resume", "overwrite", "checkpoint"), ("output", "passes"), "output or passes")
    needs(("preview",), ("output",), "output")
    if given["exposure"] is not None and not given["preview"]:
        raise UsageError(f"exposure: found {given['exposure']!r} without preview=True, where it has no effect")
    if given["estimator"] == "none" and given["denoise"] in (None, "none"):
        for name, without in (("device", "cpu"), ("aov_samples", None)):
            if given[name] != without and not (name == "aov_samples" and (given["aovs"] or given["alpha"])):
                raise UsageError(f"{name}: found {given[name]!r} with estimator='none', where it has no effect"
                                 + (" without aovs=True or alpha=True" if name == "aov_samples" else ""))
    for first, second in (("resume", "overwrite"), ("until", "until_p95"),
                          ("until", "until_relative"), ("until_p95", "until_relative")):
        if given[first] and given[second]:
            raise UsageError(f"found {first} and {second}; expected one of them")


def _check_scene_arguments(scene: PathOrScene, options: Mapping[str, Any], view: Mapping[str, Any]) -> None:
    """Raises UsageError for arguments of Scene.load() among the options, with those that it shares."""
    found = sorted(set(options).intersection(Scene.load.rules))  # type: ignore[attr-defined]
    if found:
        check_some(Scene.load, options)
        moved = {**{name: options[name] for name in found}, **view}
        load = ", ".join([repr(getattr(scene, "path", scene)), *(f"{name}={value!r}" for name, value in moved.items())])
        raise UsageError(f"{', '.join(found)}: not of render(), but of Scene.load(): render(Scene.load({load}), …)")


def _loaded(scene: PathOrScene, integrator: str, view: dict[str, Any], shown: Phases | None) -> Scene:
    """The scene with the integrator, seen so."""
    if isinstance(shown, Line):
        shown(0, 0, "loading")
    if not isinstance(scene, Scene):
        return Scene.load(scene, integrator=integrator, **view)
    if view:
        load = ", ".join([repr(scene.path), *(f"{name}={value!r}" for name, value in view.items())])
        raise UsageError(f"{', '.join(view)}: the scene is loaded already; give it to Scene.load({load})")
    return scene.with_integrator(integrator)


_OPTIONS = declared_rules(_covary.render_options())
FILTER = _OPTIONS["rfilter"]
#: Options that are keywords as declared, without those that are arguments by another name or of Scene.load(), too.
_DECLARED = {name: rule for name, rule in _OPTIONS.items()
             if name not in ("rfilter", "no_preview", "resolution", "environment", "background", "camera")}


@checked(_DECLARED,
         scene=SCENE, spp=optional(SPP), estimator=optional(text), integrator=text, until=optional(real(0, above=True)),
         until_p95=optional(real(0, above=True)), until_relative=optional(real(0, above=True)),
         time=optional(real(0, above=True)), seed=SEED,
         denoise=DENOISE, oidn=empty_or(path), device=text, output=optional(path), passes=optional(path), resume=flag,
         overwrite=flag, checkpoint=optional(real(0)), preview=flag,
         **VIEW_RULES,
         crop=optional(several("(x, y, width, height) in pixels", whole(0, 65535), whole(0, 65535), whole(1, 65536),
                               whole(1, 65536))),
         filter=FILTER,
         split=optional(several("(CRN, independent), two numbers above 0", real(0, above=True), real(0, above=True))),
         films_only=flag, live=either("True, False or a port from 1 to 65535", flag, whole(1, 65535)),
         threads=whole(0, 4096), progress=PROGRESS)
def render(scene: PathOrScene, spp: int | None = None, estimator: Estimator | None = None, *, integrator: str = "",
           until: float | None = None, until_p95: float | None = None, until_relative: float | None = None,
           time: float | None = None, seed: int = 0,
           denoise: DenoiseMode | None = None, oidn: str | PathLike[str] = "", device: str = "cpu",
           output: str | PathLike[str] | None = None, passes: str | PathLike[str] | None = None, resume: bool = False,
           overwrite: bool = False, checkpoint: float | None = None, preview: bool = False,
           resolution: tuple[int, int] | None = None, environment: str | PathLike[str] = "auto",
           background: float | tuple[float, float, float] | None = None, camera: str | int = "",
           crop: tuple[int, int, int, int] | None = None, filter: Filter | None = None,
           split: tuple[float, float] | None = None, films_only: bool = False, live: bool | int = False,
           threads: int = 0, progress: RenderProgress | None = None, **options: Unpack[RenderOptions]) -> RenderResult:
    """Renders a scene, or a scene file, as `covary render` does, to the same bits.

    spp: samples per pixel over all passes; by default the scene's, or no limit with `until` or `time`.
    estimator: the default is the mean of independent samples, with denoised images mixed in where held-out samples
        prefer them; "none" is the mean alone, "iicv" uses common random numbers for half of the samples. Its options
        are keywords, too.
    integrator: instead of the scene's.
    until: add samples until the predicted relMSE is this; until_p95: until it is in 95 % of the blocks of 16 x 16
        pixels; until_relative: until the relative error of each pixel (3 sigma) is, with `adaptive` or dependent-tests.
    time: seconds for rendering and estimating together.
    denoise, oidn, device: as for combine(); the features are rendered. The default of denoise is "auto", or "none" if
        an estimator or `sampling` is given.
    output: EXR file of the result; preview: write a PNG beside it.
    passes: folder to keep the films in; resume: continue existing films; overwrite: replace them;
        checkpoint: seconds between saving unfinished films, by default 300 with `output` or `passes`; 0: never.
    resolution, environment, background, camera: as for Scene.load(), if the scene is a file.
    crop: x, y, width and height in the frame.
    split: ratio of the samples of the CRN and the independent pass.
    films_only: render the passes only; result.image is then the mean of all samples.
    live: shows the image, its error and the time left in the notebook, or in the browser at an address that is
        printed, with buttons; a number is the page's port. docs/live.md
    threads: at most so many processors; 0: all that set_threads() allows.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        up to 20 times a second with (done, total) samples; one of three arguments also gets the phase, and is called
        from the beginning (covary.progress).
    {declared}
    Ctrl-C ends the render within a tile; with `output` or `passes` samples are kept, and `resume=True` continues.
    """
    keywords: dict[str, Any] = dict(options)
    view = {name: value for name, value in (("resolution", resolution), ("environment", environment),
                                            ("background", background), ("camera", camera))
            if value not in (None, "auto" if name == "environment" else "")}
    _check_scene_arguments(scene, keywords, view)
    check_names(keywords, render.rules)  # type: ignore[attr-defined]
    _check_together({"resume": resume, "overwrite": overwrite, "checkpoint": checkpoint, "preview": preview,
                     "output": output, "passes": passes, "until": until, "until_p95": until_p95,
                     "until_relative": until_relative, "estimator": estimator, "denoise": denoise, "device": device,
                     **{name: keywords.get(name) for name in ("exposure", "aov_samples", "aovs", "alpha")}})
    declared = {name.replace("_", "-"): keywords.pop(name) for name in _DECLARED if name in keywords}
    texts = text_options(keywords, estimator or DEFAULT)
    _covary.check_output("" if output is None else fspath(output))
    shown = _phases(progress)
    with ended(shown):
        chosen = _loaded(scene, integrator, view, shown)
    if checkpoint is None:
        checkpoint = _CHECKPOINT_SECONDS if output is not None or passes is not None else 0
    loading = chosen._loading
    until_words = {"relmse": until, "relmse-p95": until_p95, "relative": until_relative}
    values = option_texts({
        "output": output, "spp": spp, "time": time, "seed": seed,
        "until": next((f"{name}={error!r}" for name, error in until_words.items() if error is not None), None),
        "integrator": loading["integrator"] or None, "estimator": estimator, "denoise": denoise,
        "oidn": fspath(oidn) or None, "device": device, "resolution": loading["resolution"], "crop": crop,
        "passes": passes, "resume": resume, "overwrite": overwrite, "checkpoint": checkpoint,
        "no-preview": not preview, "split": split, "rfilter": filter, **loading["view"], **declared})
    properties = {"min_depth": loading["min_depth"], "max_depth": loading["max_depth"], **loading["integrator_options"]}
    of_integrator = {name.replace("_", "-"): {"True": "on", "False": "off"}.get(str(value), str(value))
                     for name, value in properties.items() if value is not None}
    with LivePage(live, chosen.path, None if output is None else fspath(output)) as page, ended(shown):
        made = _covary.render(chosen._loaded, values, of_integrator, texts, films_only, threads, shown, page,
                              getattr(progress, "step", None))
    made["bad_samples"] = [_bad_sample(chosen, bad) for bad in made["bad_samples"]]
    for text in made["warnings"]:
        _warn(text)
    report_bad_samples(made)
    return RenderResult(**made)


render.__doc__ = inspect.cleandoc(render.__doc__ or "").replace("{declared}\n", "".join(
    textwrap.fill(f"{underscored(option['name'])}: {option['help']}.", 120, subsequent_indent=" " * 4) + "\n"
    for option in _covary.render_options()
    if underscored(option["name"]) in _DECLARED.keys() - inspect.signature(inspect.unwrap(render)).parameters) + "\n")


def report_bad_samples(made: dict[str, Any]) -> None:
    """Warns about them, and adds the text to the result's warnings."""
    report = text_of_bad_samples(made["not_finite_samples"], made["negative_samples"], made["bad_samples"])
    if report:
        made["warnings"] = [*made["warnings"], report]
        _warn(report, BadSamplesWarning)


def _bad_sample(scene: Scene, bad: dict[str, Any]) -> BadSample:
    """The sample with the command that replays it: the options of the scene and its random numbers, without outputs."""
    defines = [word for name, value in scene._loading["defines"].items() for word in ("-D", f"{name}={value}")]
    if scene._loading["ignore_unknown"]:
        defines.append("--ignore-unknown")
    replay = shlex.join(["covary", "render", scene.path, *defines, *bad["replay"]])
    return BadSample(**{**bad, "replay": replay})


@checked(n=whole(0, 4096))
def set_threads(n: int) -> None:
    """Limits the processors that covary uses in this process; 0: all."""
    _covary.set_threads(n)
