# SPDX-License-Identifier: Apache-2.0
"""What Cycles must render for covary: groups of samples, and the scene settings they need (docs/blender.md).

Uses only the standard library: the Blender add-on includes this file and errors.py, but no compiled part."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from .errors import UsageError

OLDEST = (3, 4, 0)
#: Groups of each image.
GROUPS = 12
#: The images that methods need.
PAIR, INDEPENDENT = ("crn", "independent"), ("independent",)


def blender() -> Any:
    """The module bpy."""
    try:
        import bpy  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError("covary.blender needs Blender's Python: run it in Blender, or pip install bpy") from error
    if bpy.app.version < OLDEST:
        raise UsageError(f"found Blender {bpy.app.version_string}; {'.'.join(map(str, OLDEST[:2]))} or newer is needed")
    return bpy


def pattern() -> str:
    """The pattern whose scrambling distance can make numbers common; its name changed with Blender 3.5."""
    return "TABULATED_SOBOL" if blender().app.version >= (3, 5, 0) else "PROGRESSIVE_MULTI_JITTER"


def compositor(scene: Any) -> tuple[Any, str, Any, str]:
    """The entry of needed() that turns it off: from Blender 5.0 on, a compositor exists if it has nodes."""
    reason = "the compositor would change the pixels of each group"
    if hasattr(scene, "compositing_node_group"):
        return scene.render, "use_compositing", False, reason if scene.compositing_node_group else ""
    return scene, "use_nodes", False, reason


def blue_noise(cycles: Any) -> str:
    """Why the scene's pattern is not kept, if that changes more than the order of the same points."""
    lost = "a group's errors would be arranged over its pixels, and its numbers could not be common"
    return lost if getattr(cycles, "sampling_pattern", "") == "BLUE_NOISE" else ""


def view_layer(scene: Any) -> Any:
    """The view layer whose auxiliary images guide the denoising; None if several make up the picture."""
    used = [layer for layer in scene.view_layers if layer.use]
    return used[0] if len(used) == 1 else None


def features_needed(scene: Any) -> list[tuple[Any, str, Any, str]]:
    """As needed(), for groups that bring albedo and normal with them. Before the settings of needed()."""
    layer, image = view_layer(scene), scene.render.image_settings
    if layer is None:
        return []
    return [(layer.cycles, "denoising_store_passes", True, ""), (image, "media_type", "MULTI_LAYER_IMAGE", ""),
            (image, "file_format", "OPEN_EXR_MULTILAYER", "")]


def needed(scene: Any) -> list[tuple[Any, str, Any, str]]:
    """(owner, name, value, reason) of each setting that all images need; reason "" if the picture stays the same."""
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
        (cycles, "sampling_pattern", pattern(), blue_noise(cycles)),
        (cycles, "time_limit", 0.0, ""),
        compositor(scene),
        (scene.render, "use_sequencer", False, ""),
        (scene.render, "use_border", False, "the image would be a part of the frame"),
        (scene.render, "use_multiview", False, "groups are of one view"),
        (scene.render, "use_motion_blur", scene.render.use_motion_blur, ""),
        (image, "media_type", "IMAGE", ""),  # from Blender 5.0 on; it decides which formats there are
        (image, "file_format", "OPEN_EXR", ""),
        (image, "color_mode", "RGB", ""),
        (image, "color_depth", "32", ""),
    ]


def changed(scene: Any) -> list[tuple[str, Any, Any, str]]:
    """(name, value, value while groups render, reason) of the settings that change the picture."""
    return [(name, getattr(owner, name), value, reason) for owner, name, value, reason in needed(scene)
            if reason and hasattr(owner, name) and getattr(owner, name) != value]


@contextmanager
def settings(scene: Any, features: bool = False) -> Iterator[None]:
    """Applies the required settings; afterwards restores everything, including what a group changes."""
    wanted = [*needed(scene), *(features_needed(scene) if features else [])]
    cycles, more = scene.cycles, ("samples", "sample_offset", "seed", "scrambling_distance", "use_sample_subset",
                                  "sample_subset_length")
    kept = [(owner, name, getattr(owner, name)) for owner, name, _, _ in wanted if hasattr(owner, name)]
    kept += [(cycles, name, getattr(cycles, name)) for name in more if hasattr(cycles, name)]
    kept.append((scene.render, "filepath", scene.render.filepath))
    try:
        for owner, name, value, _ in wanted:
            if hasattr(owner, name):
                setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in kept:  # the format of files before its depths
            setattr(owner, name, value)


@contextmanager
def kept_in_memory(scene: Any) -> Iterator[None]:
    """For the groups of one picture: Cycles prepares the scene once, not for each group."""
    render = scene.render
    before, render.use_persistent_data = render.use_persistent_data, True
    try:
        yield
    finally:
        render.use_persistent_data = before


def check(scene: Any, spp: int, groups: int = GROUPS, kinds: Sequence[str] = PAIR) -> None:
    """Raises UsageError for a scene whose groups cannot be rendered, and for an old Blender."""
    blender()
    if scene.render.engine != "CYCLES":
        raise UsageError(f"found the engine {scene.render.engine}; only Cycles has common random numbers: "
                         "scene.render.engine = 'CYCLES'")
    if scene.camera is None:
        raise UsageError(f"the scene '{scene.name}' has no camera: Add, Camera")
    if spp % (len(kinds) * groups):
        raise UsageError(f"spp: found {spp} samples in {groups} groups; a multiple of " + (
            "the number of groups is needed" if len(kinds) == 1 else
            "twice the number of groups is needed, half of it with common random numbers"))


@dataclass(frozen=True)
class Group:
    """Samples of one of the images that Cycles takes in a single render."""

    #: "crn", with common random numbers, or "independent".
    kind: str
    samples: int
    seed: int
    #: Whether albedo and normal are rendered, too, if view_layer() has them.
    features: bool = False

    @contextmanager
    def settings(self, scene: Any, path: str) -> Iterator[None]:
        """Those of the scene that write this group into a file."""
        cycles = scene.cycles
        with settings(scene, self.features):
            cycles.scrambling_distance = 0.0 if self.kind == "crn" else 1.0
            cycles.seed = self.seed
            # Samples n … 2 n - 1 of the pattern: its sample 0 lies at the pixel's centre for every seed.
            cycles.sample_offset = self.samples
            if hasattr(cycles, "use_sample_subset"):
                cycles.use_sample_subset, cycles.sample_subset_length = True, self.samples
                cycles.samples = 2 * self.samples
            else:
                cycles.samples = self.samples
            scene.render.filepath = path
            yield


def groups_of(spp: int, groups: int, seed: int, kinds: Sequence[str] = PAIR) -> list[Group]:
    """The groups of one picture, each with its own seed: of a PAIR, half of the samples have common random numbers;
    otherwise all are INDEPENDENT, and bring what guides their denoising."""
    return [Group(kind, spp // (len(kinds) * groups), (len(kinds) * seed + number) * groups + group, len(kinds) == 1)
            for number, kind in enumerate(kinds) for group in range(groups)]
