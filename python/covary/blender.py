# SPDX-License-Identifier: Apache-2.0
"""Blender's Cycles as the renderer of both images: an add-on, and a function for scripts and `pip install bpy`.

What is set and why is in docs/blender.md."""
from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import checked, flag, function, instance, optional, text, whole
from ._combine import Progress, check_options, combine
from ._options import OptionValue
from ._render import SEED, SPP
from ._result import Result, fields_of
from .errors import UsageError
from .film import Film, film_from_groups

if TYPE_CHECKING:
    from .estimators import PairEstimator

bl_info = {"name": "covary", "author": "covary", "version": (0, 1, 0), "blender": (4, 2, 0), "category": "Render",
           "description": "Less noise from the same samples by common random numbers and control variates"}
_OLDEST = (4, 2, 0)


@dataclass(frozen=True)
class BlenderResult(Result):
    """What has become of render()."""

    #: "crn" and "independent", for other estimators.
    films: dict[str, Film] = field(repr=False)
    render_seconds: float


def _module() -> Any:
    try:
        import bpy  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError("covary.blender needs Blender's Python: run it in Blender, or pip install bpy") from error
    if bpy.app.version < _OLDEST:
        raise UsageError(f"found Blender {bpy.app.version_string}; 4.2 or newer is needed")
    return bpy


def _compositor(scene: Any) -> tuple[Any, str, Any, str]:
    """The entry of _needed() that turns it off: from Blender 5.0 on there is one where it has nodes."""
    reason = "the compositor would change the pixels of each group"
    if hasattr(scene, "compositing_node_group"):
        return scene.render, "use_compositing", False, reason if scene.compositing_node_group else ""
    return scene, "use_nodes", False, reason


def _needed(scene: Any) -> list[tuple[Any, str, Any, str]]:
    """(owner, name, value, reason) of each setting that both images need; "" for those that leave the picture as it
    is."""
    cycles, image = scene.cycles, scene.render.image_settings
    mixes = "it mixes the errors of neighbouring pixels, which control variates take for independent"
    clamps = "what it clamps is missing from the mean, differently in both images"
    return [
        (cycles, "use_adaptive_sampling", False, "counts would follow from the values of samples"),
        (cycles, "use_denoising", False, mixes),
        (cycles, "pixel_filter_type", "BOX", mixes),
        (cycles, "filter_width", 1.0, ""),
        (cycles, "sample_clamp_direct", 0.0, clamps),
        (cycles, "sample_clamp_indirect", 0.0, clamps),
        (cycles, "use_guiding", False, "it learns while it renders, so that samples depend on each other"),
        (cycles, "use_animated_seed", False, ""),
        (cycles, "auto_scrambling_distance", False, ""),
        (cycles, "sampling_pattern", "TABULATED_SOBOL", ""),
        (cycles, "time_limit", 0.0, ""),
        _compositor(scene),
        (scene.render, "use_sequencer", False, ""),
        (scene.render, "use_border", False, "the image would be a part of the frame"),
        (scene.render, "use_motion_blur", scene.render.use_motion_blur, ""),
        (image, "file_format", "OPEN_EXR", ""),
        (image, "color_mode", "RGB", ""),
        (image, "color_depth", "32", ""),
    ]


@checked(scene=instance("a bpy.types.Scene", lambda value: hasattr(value, "cycles")))
def changes(scene: Any) -> list[str]:
    """What of the scene's settings render() changes while it renders and that changes the picture, with reasons."""
    return [f"{name} is {getattr(owner, name)!r} and was rendered with {value!r}: {reason}"
            for owner, name, value, reason in _needed(scene)
            if reason and hasattr(owner, name) and getattr(owner, name) != value]


@contextmanager
def _settings(scene: Any) -> Iterator[None]:
    """The scene as it must be; everything is put back afterwards, also what a group changes."""
    cycles, more = scene.cycles, ("samples", "sample_offset", "seed", "scrambling_distance", "use_sample_subset",
                                  "sample_subset_length")
    kept = [(owner, name, getattr(owner, name)) for owner, name, _, _ in _needed(scene) if hasattr(owner, name)]
    kept += [(cycles, name, getattr(cycles, name)) for name in more if hasattr(cycles, name)]
    kept.append((scene.render, "filepath", scene.render.filepath))
    try:
        for owner, name, value, _ in _needed(scene):
            if hasattr(owner, name):
                setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in kept:  # the format of files before its depths
            setattr(owner, name, value)


def _set_samples(cycles: Any, size: int) -> None:
    """Samples size … 2 size - 1 of the pattern: its sample 0 lies at the pixel's centre for every seed."""
    if hasattr(cycles, "use_sample_subset"):
        cycles.use_sample_subset = True
        cycles.sample_offset, cycles.sample_subset_length = size, size
        cycles.samples = 2 * size
    else:
        cycles.samples, cycles.sample_offset = size, size


def _check(scene: Any, spp: int, groups: int) -> None:
    if scene.render.engine != "CYCLES":
        raise UsageError(f"found the engine {scene.render.engine}; only Cycles has common random numbers: "
                         "scene.render.engine = 'CYCLES'")
    if spp % (2 * groups):
        raise UsageError(f"spp: found {spp} samples in {groups} groups; a multiple of twice the number of groups is "
                         "needed, half of it with common random numbers")


def _groups(bpy: Any, scene: Any, spp: int, groups: int, seed: int) -> Generator[tuple[str, Any], None, None]:
    """Renders one group after the other: its kind and image."""
    cycles, size = scene.cycles, spp // (2 * groups)
    with tempfile.TemporaryDirectory(prefix="covary-blender-") as folder:
        path = str(Path(folder) / "group.exr")
        for number, (kind, distance) in enumerate((("crn", 0.0), ("independent", 1.0))):
            for group in range(groups):
                with _settings(scene):
                    _set_samples(cycles, size)
                    cycles.scrambling_distance = distance
                    cycles.seed = (2 * seed + number) * groups + group
                    scene.render.filepath = path
                    bpy.ops.render.render(write_still=True, scene=scene.name)
                yield kind, _covary.read_image(path, "")



_SCENE = optional(instance("a bpy.types.Scene", lambda value: hasattr(value, "cycles")))


@checked(scene=_SCENE, spp=SPP, seed=SEED, groups=whole(3, _covary.most_groups), estimator=text, change=flag,
         progress=optional(function))
def render(scene: Any = None, spp: int = 192, seed: int = 0, *, groups: int = 12, estimator: PairEstimator = "iicv",
           change: bool = True, progress: Progress | None = None, **options: OptionValue) -> BlenderResult:
    """Renders a scene of Blender by Cycles, half of the samples with common random numbers and half with independent
    ones, and combines both. All settings of the scene are as before afterwards.

    scene: a bpy.types.Scene; by default that of the context.
    spp: samples per pixel of both images together, a multiple of 2 * groups.
    seed: another one, other samples.
    change: render also where settings of the scene must be changed in a way that changes the picture (clamping, the
        denoiser, …), and say so in `warnings`; without it raise UsageError.
    progress: called with (done, total) groups.
    """
    check_options(estimator, options)
    bpy = _module()
    scene = scene or bpy.context.scene
    _check(scene, spp, groups)
    changed = changes(scene)
    if changed and not change:
        raise UsageError(f"settings that cannot stay: {'; '.join(changed)}")
    started = time.perf_counter()
    images = _collect(_groups(bpy, scene, spp, groups, seed), 2 * groups, progress)
    return _combined(images, spp, estimator, options, changed, time.perf_counter() - started)


def _collect(groups: Iterator[tuple[str, Any]], total: int, progress: Progress | None) -> dict[str, list[Any]]:
    images: dict[str, list[Any]] = {"crn": [], "independent": []}
    for done, (kind, image) in enumerate(groups, 1):
        images[kind].append(image)
        if progress is not None:
            progress(done, total)
    return images


def _combined(images: dict[str, list[Any]], spp: int, estimator: str, options: dict[str, OptionValue],
              changed: list[str], seconds: float) -> BlenderResult:
    import numpy

    films = {kind: film_from_groups(numpy.stack(members), spp // 2, sampling=kind) for kind, members in images.items()}
    result = combine(films["crn"], films["independent"], estimator, **options)  # type: ignore[arg-type]
    given = fields_of(result) | {"warnings": changed + result.warnings}
    return BlenderResult(**given, films=films, render_seconds=seconds)


@checked(result=instance("what render() returns", lambda value: isinstance(value, Result)), name=text)
def show(result: Result, name: str = "covary") -> Any:
    """The result as an image of Blender (float, linear), in place of one of this name, for the image editor."""
    import numpy

    bpy = _module()
    height, width = result.image.shape[:2]
    old = bpy.data.images.get(name)
    if old is not None:
        bpy.data.images.remove(old)
    image = bpy.data.images.new(name, width, height, float_buffer=True, alpha=False)
    pixels = numpy.ones((height, width, 4), numpy.float32)
    pixels[..., :3] = result.image[::-1]
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


def _define() -> tuple[Any, ...]:
    """The classes of the add-on."""
    bpy = _module()

    class RENDER_OT_covary(bpy.types.Operator):  # type: ignore[misc,name-defined,unused-ignore]
        bl_idname = "render.covary"
        bl_label = "Render with covary"
        bl_description = "Render groups with common and with independent random numbers, and combine them; Esc ends it"

        def execute(self, context: Any) -> set[str]:
            """Without a window: in one go."""
            try:
                result = render(context.scene, context.scene.covary_samples)
            except Exception as error:  # noqa: BLE001  Blender shows the text
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            return self._finish(context, result)

        def invoke(self, context: Any, event: Any) -> set[str]:
            """With one: a group at a time, so that Esc is seen between groups."""
            scene = context.scene
            try:
                _check(scene, scene.covary_samples, 12)
            except UsageError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            self.changed, self.started = changes(scene), time.perf_counter()
            self.images: dict[str, list[Any]] = {"crn": [], "independent": []}
            self.groups = _groups(bpy, scene, scene.covary_samples, 12, 0)
            self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
            context.window_manager.progress_begin(0, 24)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}

        def modal(self, context: Any, event: Any) -> set[str]:
            if event.type == "ESC":
                self._end(context)
                self.report({"INFO"}, "covary: ended; the settings are as before")
                return {"CANCELLED"}
            if event.type != "TIMER":
                return {"PASS_THROUGH"}
            try:
                kind, image = next(self.groups)
                self.images[kind].append(image)
                context.window_manager.progress_update(sum(map(len, self.images.values())))
                return {"RUNNING_MODAL"}
            except StopIteration:
                self._end(context)
                seconds = time.perf_counter() - self.started
                return self._finish(context, _combined(self.images, context.scene.covary_samples, "iicv", {},
                                                       self.changed, seconds))

        def _end(self, context: Any) -> None:
            self.groups.close()
            context.window_manager.event_timer_remove(self.timer)
            context.window_manager.progress_end()

        def _finish(self, context: Any, result: BlenderResult) -> set[str]:
            image = show(result)
            for area in context.screen.areas if context.screen else ():
                if area.type == "IMAGE_EDITOR":
                    area.spaces.active.image = image
            for warning in result.warnings:
                self.report({"WARNING"}, warning)
            self.report({"INFO"}, f"covary: predicted relMSE {result.predicted_relmse:.3g}, image '{image.name}'")
            return {"FINISHED"}

    class RENDER_PT_covary(bpy.types.Panel):  # type: ignore[misc,name-defined,unused-ignore]
        bl_label = "covary"
        bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"

        def draw(self, context: Any) -> None:
            self.layout.prop(context.scene, "covary_samples")
            self.layout.operator(RENDER_OT_covary.bl_idname)
            for text in changes(context.scene):
                self.layout.label(text=text, icon="INFO")

    return RENDER_OT_covary, RENDER_PT_covary


_registered: list[Callable[[], None]] = []


def register() -> None:
    """Adds the operator render.covary, its panel and the property covary_samples of scenes."""
    bpy = _module()
    for cls in _define():
        bpy.utils.register_class(cls)
        _registered.append(lambda cls=cls: bpy.utils.unregister_class(cls))  # type: ignore[misc]
    bpy.types.Scene.covary_samples = bpy.props.IntProperty(
        name="Samples", default=192, min=72, step=24, description="Per pixel of both images; a multiple of 24")


def unregister() -> None:
    """Takes them away."""
    bpy = _module()
    while _registered:
        _registered.pop()()
    del bpy.types.Scene.covary_samples
