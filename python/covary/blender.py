# SPDX-License-Identifier: Apache-2.0
"""Blender's Cycles as the renderer of the images, for scripts and `pip install bpy`.

docs/blender.md has the settings with reasons, and describes the add-on."""
from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary, _cycles
from ._arguments import checked, flag, instance, optional, text, whole
from ._combine import PROGRESS, check_options, combine
from ._cycles import Group
from ._options import DEFAULT
from ._render import SEED, SPP
from ._result import Result, fields_of
from .errors import UsageError
from .film import Film, film_from_groups
from .progress import Counted, Progress, steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import ImageOptions
    from .estimators import PairEstimator


@dataclass(frozen=True, repr=False, eq=False)
class BlenderResult(Result):
    """The result of render()."""

    #: "independent", and "crn" for estimators of two images, to try others.
    films: dict[str, Film] = field(repr=False)
    render_seconds: float


@checked(scene=instance("a bpy.types.Scene", lambda value: hasattr(value, "cycles")))
def changes(scene: Any) -> list[str]:
    """Scene settings that render() changes while it renders and that affect the picture, with reasons."""
    return [f"{name} is {value!r} and was rendered with {other!r}: {reason}"
            for name, value, other, reason in _cycles.changed(scene)]


def _layers_of(scene: Any, group: Group) -> dict[str, str]:
    """Layers of a group's file by what they are; "" is that of a file with one layer."""
    layer = _cycles.view_layer(scene)
    if not group.features or layer is None:
        return {group.kind: ""}
    return {group.kind: f"{layer.name}.Combined", "albedo": f"{layer.name}.Denoising Albedo",
            "normal": f"{layer.name}.Denoising Normal"}


def _images(bpy: Any, scene: Any, groups: list[Group]) -> Iterator[dict[str, Any]]:
    """Renders one group after the other: its image by its kind, and its features."""
    with tempfile.TemporaryDirectory(prefix="covary-blender-") as folder, _cycles.kept_in_memory(scene):
        path = str(Path(folder) / "group.exr")
        for group in groups:
            with group.settings(scene, path):
                bpy.ops.render.render(write_still=True, scene=scene.name)
            yield {name: _covary.read_image(path, layer) for name, layer in _layers_of(scene, group).items()}


_SCENE = optional(instance("a bpy.types.Scene", lambda value: hasattr(value, "cycles")))


@checked(scene=_SCENE, spp=SPP, seed=SEED, groups=whole(3, _covary.max_groups), estimator=text, change=flag,
         progress=PROGRESS)
def render(scene: Any = None, spp: int = 192, seed: int = 0, *, groups: int = 12, estimator: PairEstimator = DEFAULT,
           change: bool = True, progress: Progress | None = None, **options: Unpack[ImageOptions]) -> BlenderResult:
    """Renders a Blender scene with Cycles and takes its noise out. By default all samples are independent, and the
    image is made as by covary.render(), guided by Cycles' albedo and normal; for estimators of two images, half of the
    samples have common random numbers. Afterwards, all settings of the scene are restored.

    scene: a bpy.types.Scene; by default that of the context.
    spp: samples per pixel, a multiple of `groups`, or of 2 * groups for two images.
    seed: different seeds give different samples.
    change: render even if settings of the scene must be changed in a way that affects the picture (clamping, the
        denoiser, …), and say so in `warnings`; otherwise raise UsageError.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) groups.
    """
    check_options(estimator, options)
    bpy = _cycles.blender()
    scene = scene or bpy.context.scene
    kinds = _cycles.INDEPENDENT if estimator == DEFAULT else _cycles.PAIR
    _cycles.check(scene, spp, groups, kinds)
    changed = changes(scene)
    if changed and not change:
        raise UsageError(f"settings that cannot stay: {'; '.join(changed)}")
    started = time.perf_counter()
    images = _collect(_images(bpy, scene, _cycles.groups_of(spp, groups, seed, kinds)),
                      len(kinds) * groups, steps(progress, "groups"))
    return _combined(images, spp, estimator, options, changed, time.perf_counter() - started)


def _collect(groups: Iterator[dict[str, Any]], total: int, progress: Counted | None) -> dict[str, list[Any]]:
    images: dict[str, list[Any]] = {}
    for done, made in enumerate(groups, 1):
        for name, image in made.items():
            images.setdefault(name, []).append(image)
        if progress is not None:
            progress(done, total)
    return images


def _combined(images: dict[str, list[Any]], spp: int, estimator: str, options: ImageOptions,
              changed: list[str], seconds: float) -> BlenderResult:
    import numpy

    kinds = [kind for kind in images if kind in _cycles.PAIR]
    films = {kind: film_from_groups(numpy.stack(images[kind]), spp // len(kinds), sampling=kind) for kind in kinds}
    features = {name: numpy.mean(images[name], axis=0) for name in ("albedo", "normal") if name in images}
    # What looks like a mistake of who rendered them is none, and only a warning: a white world seems clipped.
    forced: dict[str, Any] = {"force": True} | features | options
    result = combine(films.get("crn"), films["independent"], estimator, **forced)  # type: ignore[arg-type]
    given = fields_of(result) | {"warnings": changed + result.warnings}
    return BlenderResult(**given, films=films, render_seconds=seconds)


@checked(result=instance("what render() returns", lambda value: isinstance(value, Result)), name=text)
def show(result: Result, name: str = "covary") -> Any:
    """The result as a Blender image (float, linear) for the image editor; replaces an image of the same name."""
    import numpy

    bpy = _cycles.blender()
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
