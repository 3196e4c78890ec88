# SPDX-License-Identifier: Apache-2.0
"""Mitsuba 3 (`pip install mitsuba`, its LLVM and CUDA variants) as the renderer of the images."""
from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ._arguments import checked, either, flag, instance, optional, path, text, whole
from ._combine import PROGRESS, check_options, combine, features_of
from ._covary import max_groups
from ._options import DEFAULT
from ._render import SEED, SPP
from ._result import Result, fields_of
from .errors import UsageError
from .film import Film, film_from_groups
from .progress import Progress, steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import ImageOptions
    from ._result import FloatArray
    from .estimators import PairEstimator

#: Maximum number of lanes that Mitsuba traces at once, and of groups traced together; one group may have more.
_MOST_LANES = 1 << 32
_LANES_OF_STACK = 1 << 24
#: Maximum number of rows of groups traced together: positions of samples, 32-bit floats, resolve 1/4096 of a pixel.
_ROWS_OF_STACK = 4096
#: Maximum number of specular surfaces that features follow.
_FOLLOWED_BOUNCES = 8
_FEATURES = ("Albedo", "N", "DenoisingAlbedo", "DenoisingNormal")
_defined: dict[str, None] = {}


@dataclass(frozen=True, repr=False, eq=False)
class MitsubaResult(Result):
    """The result of render()."""

    #: "independent", and "crn" for estimators of two images, to try others:
    #: `covary.combine(films.get("crn"), films["independent"], …)`.
    films: dict[str, Film] = field(repr=False)
    render_seconds: float
    estimate_seconds: float


def _module() -> Any:
    """Mitsuba with a suitable variant."""
    try:
        import mitsuba  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError("covary.mitsuba needs Mitsuba 3: pip install mitsuba") from error
    variant = mitsuba.variant()
    vectorised = [name for name in mitsuba.variants() if name.startswith(("llvm", "cuda"))]
    if variant is None:
        raise UsageError("no variant of Mitsuba is chosen; call mitsuba.set_variant() with one of "
                         f"{', '.join(vectorised)} first")
    if variant not in vectorised:
        raise UsageError(f"the variant '{variant}' of Mitsuba takes samples one by one, which a sampler in Python is "
                         f"too slow for; expected one of {', '.join(vectorised)}")
    return mitsuba


def _common_numbers(mi: Any, drjit: Any) -> Any:
    """The class of the CRN sampler."""
    class CommonNumbers(mi.Sampler):  # type: ignore[misc,unused-ignore]
        """Numbers that depend on the seed and the index of the sample, but not on the pixel. Mitsuba traces the samples
        of a pixel side by side: lane i is sample i mod n, with n samples per pixel in a pass. `pixels`: size of the
        film, in which groups of `group_pixels` pixels and `sample_count` samples lie one below the other."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.pixels = properties.get("pixels", 1)
            self.group_pixels = properties.get("group_pixels", 1)
            self.first = properties.get("first", 0)

        def seed(self, seed: Any, wavefront_size: int) -> None:
            super().seed(seed, wavefront_size)
            self.seed_value, self.size, self.passes = seed, wavefront_size, 0
            self._start()

        def _start(self) -> None:
            in_pass = max(self.size // self.pixels, 1)
            # Opaque: these change from group to group, for which the kernel is not compiled again.
            first = drjit.opaque(mi.UInt64, self.first + self.passes * in_pass)
            state = mi.UInt64(self.seed_value) * 0x9e3779b97f4a7c15
            drjit.make_opaque(state)
            lane = drjit.arange(mi.UInt64, self.size)
            group = lane // in_pass // drjit.opaque(mi.UInt64, self.group_pixels)
            sample = lane % in_pass + first + group * drjit.opaque(mi.UInt64, self.sample_count())
            self.random = mi.PCG32(initstate=state, initseq=sample)

        def advance(self) -> None:
            super().advance()
            self.passes += 1
            self._start()

        def schedule_state(self) -> None:
            super().schedule_state()
            drjit.schedule(self.random)

        def next_1d(self, active: Any = True) -> Any:
            return self.random.next_float32(active)

        def next_2d(self, active: Any = True) -> Any:
            return mi.Point2f(self.next_1d(active), self.next_1d(active))

        def fork(self) -> Any:
            properties = mi.Properties()
            properties["pixels"], properties["first"] = self.pixels, self.first
            properties["group_pixels"] = self.group_pixels
            other = CommonNumbers(properties)
            other.set_sample_count(self.sample_count())
            return other

        def clone(self) -> Any:
            other = self.fork()
            if hasattr(self, "random"):
                other.seed_value, other.size, other.passes = self.seed_value, self.size, self.passes
                other.random = mi.PCG32(self.random)
            return other

    return CommonNumbers


def _sensor_around(mi: Any, drjit: Any) -> Any:
    """The class of the wrapper sensor."""
    class Around(mi.Sensor):  # type: ignore[misc,unused-ignore]
        """Gives another sensor its own film and sampler. With `groups`, the film holds that many frames, one below the
        other, each followed by a row that is discarded."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.inner, self.groups = properties["inner"], properties.get("groups", 0)

        def _of_frame(self, position: Any) -> Any:
            """The position in the frame. Rounding may have moved it across an edge of the frame: across the bottom into
            the upper half of the row between frames, or across the top into the lower half."""
            if self.groups == 0:
                return position
            height = _size(self.inner)[1]
            y = mi.Float64(position.y) * (self.groups * (height + 1))
            row = y - drjit.floor(y / (height + 1)) * (height + 1)
            row = drjit.select(row >= height + 0.5, 0.0, drjit.minimum(row, height))
            return mi.Point2f(position.x, mi.Float(row / height))

        def sample_ray(self, time: Any, wavelength: Any, position: Any, aperture: Any, active: Any = True) -> Any:
            return self.inner.sample_ray(time, wavelength, self._of_frame(position), aperture, active)

        def sample_ray_differential(self, time: Any, wavelength: Any, position: Any, aperture: Any,
                                    active: Any = True) -> Any:
            return self.inner.sample_ray_differential(time, wavelength, self._of_frame(position), aperture, active)

        def bbox(self) -> Any:
            return self.inner.bbox()

    return Around


def _surface_features(mi: Any, drjit: Any) -> Any:
    """The class of the integrator of features."""
    class SurfaceFeatures(mi.SamplingIntegrator):  # type: ignore[misc,unused-ignore]
        """Albedo and normal of the first surface, then of the first one that is not purely specular, tinted by the
        mirrors and the glass in front of it (src/integrators/aov.h)."""

        def aov_names(self) -> list[str]:
            return [f"{name}.{c}" for name in _FEATURES for c in "RGB"]

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            hit = scene.ray_intersect(ray, active)
            first = self._features(hit, mi.Color3f(1.0))
            context = mi.BSDFContext()

            def follow(n: Any, tint: Any, hit: Any, sampler: Any) -> Any:
                turn, weight = hit.bsdf().sample(context, hit, sampler.next_1d(), sampler.next_2d())
                ray = hit.spawn_ray(hit.to_world(turn.wo))
                return n + 1, tint * self._colour(weight), scene.ray_intersect(ray, turn.pdf > 0.0), sampler

            _, tint, behind, _ = drjit.while_loop(
                (mi.UInt32(0), mi.Color3f(1.0), hit, sampler),
                lambda n, tint, hit, sampler: self._single(hit) & (n < _FOLLOWED_BOUNCES), follow)
            return mi.Spectrum(0.0), mi.Bool(True), [*first, *self._features(behind, tint)]

        def _single(self, hit: Any) -> Any:
            """Whether the surface is purely specular."""
            flags = hit.bsdf().flags()
            return hit.is_valid() & ~mi.has_flag(flags, mi.BSDFFlags.Smooth) & mi.has_flag(flags, mi.BSDFFlags.Delta)

        def _colour(self, values: Any) -> Any:
            """The mean of a spectrum."""
            return mi.Color3f(values if len(values) == 3 else drjit.mean(values))

        def _features(self, hit: Any, tint: Any) -> list[Any]:
            """Albedo and normal, zero if there is no surface."""
            found = hit.is_valid()
            albedo = tint * self._colour(hit.bsdf().eval_diffuse_reflectance(hit, found))
            return [*drjit.select(found, drjit.clip(albedo, 0.0, 1.0), 0.0),
                    *drjit.select(found, mi.Vector3f(hit.sh_frame.n), 0.0)]

    return SurfaceFeatures


def _define_plugins(mi: Any) -> None:
    """Registers the classes, once for each variant."""
    if mi.variant() in _defined:
        return
    import drjit  # type: ignore[import-not-found,import-untyped,unused-ignore]
    mi.register_sampler("covary_common_numbers", _common_numbers(mi, drjit))
    mi.register_sensor("covary_around", _sensor_around(mi, drjit))
    mi.register_integrator("covary_features", _surface_features(mi, drjit))
    _defined[mi.variant()] = None


def _integrator(mi: Any, scene: Any, given: Any) -> Any:
    integrator = scene.integrator() if given is None else given
    if integrator is None:  # of a scene made by load_dict(); files get the same one
        integrator = "path"
    if isinstance(integrator, str):
        integrator = {"type": integrator}
    if isinstance(integrator, dict):
        integrator = mi.load_dict(integrator)
    name = type(integrator).__name__
    if isinstance(integrator, mi.AdjointIntegrator):
        raise UsageError(f"the integrator {name} follows light to pixels anywhere, so that no random numbers belong to "
                         "a pixel; expected an integrator that begins at the camera, such as path")
    if ".ad" in type(integrator).__module__ or name.lower().startswith("prb"):
        raise UsageError(f"the integrator {name} is made for derivatives, which the combination of two images does not "
                         "have; use path or another one for images")
    # Its tensor then begins with the first of these channels in place of a colour.
    if name == "AOVIntegrator" and "Integrator[" not in str(integrator)[len("AOVIntegrator["):]:
        raise UsageError(f"the integrator aov has channels {', '.join(integrator.aov_names())} and no image; put an "
                         'integrator into it, as in <integrator type="aov">…<integrator type="path"/></integrator>')
    return integrator


def _size(sensor: Any) -> tuple[int, int]:
    width, height = sensor.film().crop_size()
    return int(width), int(height)


def _around(mi: Any, sensor: Any, sampler: dict[str, Any], groups: int = 0) -> Any:
    """A wrapper sensor for the pixels of another, or for several groups of them."""
    width, height = _size(sensor)
    return mi.load_dict({
        "type": "covary_around", "inner": sensor, "sampler": sampler, "groups": groups,
        "film": {"type": "hdrfilm", "width": width, "height": max(1, groups) * (height + (groups > 0)),
                 "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"}})


def _check_sensor(sensor: Any) -> list[str]:
    """The changes to the sensor, with reasons. Raises if they are impossible."""
    if sensor.needs_aperture_sample() or sensor.shutter_open_time() > 0:
        raise UsageError(f"the sensor {type(sensor).__name__} draws points on its lens or in time, which the sensor "
                         "around it would not; expected a pinhole camera with a closed shutter")
    warnings = []
    sampler = repr(sensor.sampler()).split("[")[0].strip()
    if sampler != "IndependentSampler":
        warnings.append(f"the sensor's sampler {sampler} was replaced by independent numbers and common ones, because "
                        "control variates need both; covary.render(scene, spp, sampler=\"sobol\") of the same file, "
                        "or covary render --sampler sobol, has stratified samples")
    rfilter = type(sensor.film().rfilter()).__name__
    if "Box" not in repr(sensor.film().rfilter()):
        warnings.append(f"the film's filter {rfilter} was replaced by a box one pixel wide, because a wider one mixes "
                        "the errors of neighbouring pixels, which control variates take for independent")
    return warnings


_ANY = "a mitsuba.Scene or the name of its file"
_SCENE = either(_ANY, path, instance(_ANY, lambda value: hasattr(value, "sensors")))
_INTEGRATOR = optional(instance("an Integrator of Mitsuba, its name, or a dictionary for mitsuba.load_dict()",
                                lambda value: isinstance(value, (str, dict)) or hasattr(value, "render")))


@checked(scene=_SCENE, spp=SPP, seed=SEED, integrator=_INTEGRATOR, sensor=whole(0), groups=whole(3, max_groups),
         estimator=text, aovs=flag, progress=PROGRESS)
def render(scene: Any, spp: int, seed: int = 0, integrator: Any = None, sensor: int = 0, *, groups: int = 12,
           estimator: PairEstimator = DEFAULT, aovs: bool = False, progress: Progress | None = None,
           **options: Unpack[ImageOptions]) -> MitsubaResult:
    """Renders a scene with Mitsuba and takes its noise out. By default all samples are independent, and the image is
    made as by covary.render(); for estimators of two images, half of the samples have common random numbers.

    scene: a mitsuba.Scene, or the name of an XML file.
    spp: samples per pixel, of both images together.
    integrator: instead of the scene's; an Integrator, its name, or a dictionary for mitsuba.load_dict(). A scene
        without one is rendered by "path", as Mitsuba does with files.
    sensor: its index in the scene.
    groups: number of groups of samples in each image; fewer if there are fewer samples.
    aovs: also render albedo and shading normals, "Albedo" and "N", and those seen in mirrors and through glass,
        "DenoisingAlbedo" and "DenoisingNormal". Where the image is denoised they are always rendered, and guide it.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) groups.
    options: of the estimator.

    The film's filter is replaced by a box, and a sampler other than `independent` by that one, with warnings. As many
    groups as fit are traced at once. Raises UsageError for what cannot work: a scalar variant, and integrators that
    compute derivatives or trace light paths alone.
    """
    check_options(estimator, options)
    mi = _module()
    _define_plugins(mi)
    loaded = mi.load_file(str(scene)) if not isinstance(scene, mi.Scene) else scene
    if sensor >= len(loaded.sensors()):
        raise UsageError(f"sensor: found {sensor}; the scene has {len(loaded.sensors())}, counted from 0")
    camera = loaded.sensors()[sensor]
    warnings = _check_sensor(camera)
    chosen = _integrator(mi, loaded, integrator)
    kinds = ("independent",) if estimator == DEFAULT else ("crn", "independent")
    count = spp // len(kinds)
    if estimator == DEFAULT and count < 2:
        raise UsageError(f"spp: found {spp} sample per pixel; 2 or more are needed to tell noise from the picture")
    if estimator != DEFAULT and (spp % 2 or count < 3):
        raise UsageError(f"spp: found {spp} samples per pixel; an even number, 6 or more, is needed: half of the "
                         "samples have common random numbers")
    groups = min(groups, count)

    started = time.perf_counter()
    total = len(kinds) * groups
    done = 0
    shown = steps(progress, "groups")

    def finished(number: int) -> None:
        nonlocal done
        done += number
        if shown is not None:
            shown(done, total)

    films = {name: _film(mi, loaded, camera, chosen, name, count, groups, seed, finished)
             for name in kinds}
    denoises = (options.get("denoise") or ("auto" if estimator == DEFAULT else "none")) != "none"
    features = _features(mi, loaded, camera, seed) if aovs or denoises else {}
    rendered = time.perf_counter()
    known: dict[str, Any] = (features_of(features) if denoises else {}) | options
    result = combine(films.get("crn"), films["independent"], estimator, **known)
    estimated = time.perf_counter()
    given = fields_of(result) | {"warnings": warnings + result.warnings, "aovs": features}
    return MitsubaResult(**given, films=films, render_seconds=rendered - started,
                         estimate_seconds=estimated - rendered)


def _stacks(count: int, groups: int, width: int, height: int) -> Iterator[tuple[int, int]]:
    """Batches of groups that are traced together: how many, and samples of each; sizes differ by at most one."""
    for size, number in ((count // groups + 1, count % groups), (count // groups, groups - count % groups)):
        lanes = width * (height + 1) * size
        together = max(1, min(_LANES_OF_STACK // lanes, _ROWS_OF_STACK // (height + 1)))
        if lanes * together >= _MOST_LANES:
            raise UsageError(f"{width} x {height} pixels with {size} samples in a group are more than Mitsuba traces "
                             f"at once; use more groups than {groups}")
        for first in range(0, number, together):
            yield min(together, number - first), size


def _film(mi: Any, scene: Any, camera: Any, integrator: Any, sampling: str, count: int, groups: int, seed: int,
          finished: Callable[[int], None]) -> Film:
    """One of the two images."""
    import numpy

    width, height = _size(camera)
    images: list[Any] = []
    first = 0
    for number, size in _stacks(count, groups, width, height):
        pixels = width * (height + 1)
        common = {"type": "covary_common_numbers", "pixels": pixels * number, "group_pixels": pixels, "first": first,
                  "sample_count": size}
        sampler = common if sampling == "crn" else {"type": "independent", "sample_count": size}
        own = 2 * seed if sampling == "crn" else (2 * seed + 1) * 4096 + len(images)
        made = integrator.render(scene, _around(mi, camera, sampler, number), seed=own % (1 << 32), spp=size)
        values = numpy.array(made, dtype=numpy.float32)[..., :3]
        if values.shape[-1] == 1:  # of variants without colours
            values = numpy.repeat(values, 3, -1)
        images.extend(values.reshape(number, height + 1, width, 3)[:, :height])
        first += number * size
        finished(number)
    return film_from_groups(numpy.stack(images), count, sampling=sampling)


def _features(mi: Any, scene: Any, camera: Any, seed: int) -> dict[str, FloatArray]:
    import numpy

    around = _around(mi, camera, {"type": "independent", "sample_count": 16})
    integrator = mi.load_dict({"type": "covary_features"})
    image = integrator.render(scene, around, seed=((2 * seed + 1) * 4096 + 4095) % (1 << 32), spp=16)
    values = numpy.array(image, dtype=numpy.float32)[..., -3 * len(_FEATURES):]
    return {name: numpy.ascontiguousarray(values[..., 3 * i:3 * i + 3]) for i, name in enumerate(_FEATURES)}
