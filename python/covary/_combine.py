# SPDX-License-Identifier: Apache-2.0
"""Images of any renderer, as arrays or films, made into one with less noise."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import (
    Rule, array, check_names, check_some, checked, either, empty_or, flag, function, images, mapping_of, optional, path,
    text, whole,
)
from ._images import doubts_of_features
from ._options import DEFAULT, DEFAULT_OF_PAIRS, check_no_passes, declared_rules, text_options
from ._result import Result
from .errors import InputError, UsageError, _warn
from .progress import Progress, steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import DenoiseMode, EstimatorOptions
    from .estimators import PairEstimator
    from .film import Film

DENOISE = declared_rules(_covary.combine_options())["denoise"]
OIDN = empty_or(path)
PROGRESS = optional(either("a function, True or False", flag, function))
#: The module checks these together with their pixels.
IMAGE = Rule("a covary.Film, an array, or a list of arrays of the same shape", images.convert)
_LAYERS = optional(mapping_of(IMAGE, "a mapping from names to arrays"))


@checked(crn=IMAGE, independent=IMAGE, estimator=text, light=IMAGE, counts=array,
         samples=optional(whole(1, _covary.most_samples)), denoise=DENOISE, albedo=images, normal=images,
         denoising_albedo=images, denoising_normal=images, position=images, clean_features=flag, layers=_LAYERS,
         oidn=OIDN, device=text, std_error=optional(flag), force=flag, progress=PROGRESS)
def combine(crn: Any, independent: Any, estimator: PairEstimator = DEFAULT, *, light: Film | None = None,
            counts: Any = None, samples: int | None = None, denoise: DenoiseMode | None = None, albedo: Any = None,
            normal: Any = None, denoising_albedo: Any = None, denoising_normal: Any = None, position: Any = None,
            clean_features: bool = False, layers: Mapping[str, Any] | None = None, oidn: str | PathLike[str] = "",
            device: str = "cpu", std_error: bool | None = None, force: bool = False, progress: Progress | None = None,
            **options: Unpack[EstimatorOptions]) -> Result:
    """Combines `crn`, whose pixels share their random numbers, and `independent`, whose pixels do not, into one image.

    Each is a float32 array [T, H, W, 3], the means of T groups of samples (renders with different seeds), from NumPy,
    PyTorch or anything with DLPack or the buffer protocol, with any strides, on a GPU, too; a list of T arrays; or a
    Film. Values are linear; 12 groups are recommended. The memory order [H, W, T, 3], as from read_groups() and
    Film.groups, is read in place; an array of that shape, of more than 64 x 64 pixels, is recognised, with a warning.
    Without crn (None), `independent` alone is denoised, from two groups on.

    estimator: the default mixes denoised images into the combined one where held-out samples prefer them; "iicv" does
        not denoise, and the others are there to compare with. Options follow as keywords (typed in covary.estimators);
        without an estimator they are those of "iicv".
    light: the film of light paths (pass "light"), to add to the result.
    counts: samples per pixel of the independent image over all groups, if they vary: whole numbers [H, W]; a Film
        knows its own.
    samples: samples per pixel of the CRN image, for counts, if that is an array, and for estimators that need them.
        Without crn, of the independent image, over all groups together; weights are better if it is known.
    denoise: for the least error ("auto", "error"), for little bias ("bias"), balanced, or "none"; by default "auto",
        or "none" if another estimator is named. albedo, normal, position: features [H, W, 3], the others only with the
        albedo; denoising_albedo, denoising_normal: features seen through mirrors and glass (from render():
        aovs["Albedo"], "N", "P", "DenoisingAlbedo", "DenoisingNormal"). Features of the picture's own samples have
        noise, which would pass for detail: give those of each render, [T, H, W, 3] or a list. Lamps in the picture,
        which renderers give the albedo of their material, become black in it. clean_features: they are
        nearly noise-free, as those of render() are, whose image `films` then give again; oidn: Open Image Denoise's
        library or its folder, by default searched for; "off": not used.
    layers: parts of `independent` by name, such as direct light, in the same groups: denoised with it, they are in the
        result's aovs, and add up to its image with "Rest".
    device: "cpu"; "auto", the first GPU, and the processor if there is none or it fails; "cuda" or "opencl", or one of
        these devices, "opencl:1" (`covary info --devices`).
    std_error: estimate the error, too; by default if the estimator can.
    force: combine even if the checks of the inputs find errors.
    progress: True for a line of text, or a function, called with (done, total) steps.

    Warnings of the checks are in the result, and issued as covary.CovaryWarning. The result has the bits of
    `covary combine`. Raises InputError if the inputs do not match, UsageError for options that the estimator does not
    have.
    """
    found = doubts_of_features(albedo, normal)
    crn, independent = _groups_first("crn", crn, found), _groups_first("independent", independent, found)
    if crn is None and not hasattr(independent, "samples_per_pixel"):
        counts, samples = _alone(independent, counts, samples)
    check_names(options, combine.rules)  # type: ignore[attr-defined]
    check_no_passes(options, "here are images that are rendered: counts= tells the samples that their pixels have")
    if estimator == DEFAULT and options:
        estimator = DEFAULT_OF_PAIRS  # type: ignore[assignment]  # whose options they are
    texts = text_options(options, estimator)
    try:
        made = _covary.combine(crn, independent, None if counts is None else _counts(counts), light, albedo, normal,
                               denoising_albedo, denoising_normal, position, clean_features, dict(layers or {}),
                               estimator, texts,
                               denoise or "", fspath(oidn), device, force, std_error, samples,
                               steps(progress, "combining", shown=False))
    except InputError as error:
        raise InputError(f"{error}{_how_read(crn=crn, independent=independent)}") from None
    for text in found + made["warnings"]:
        _warn(text)
    return Result(**made | {"warnings": found + made["warnings"]})


def _alone(independent: Any, counts: Any, samples: int | None) -> tuple[Any, int | None]:
    """The counts and samples of an array without a CRN image. Raises InputError if it has one group."""
    import numpy

    shape = tuple(getattr(independent, "shape", ()))
    if len(shape) == 4 and shape[0] == 1:
        raise InputError("independent: found 1 group; at least 2 are needed, as their differences tell the noise "
                         "(covary.denoise() takes a single image)")
    if samples is None or counts is not None or len(shape) != 4:
        return counts, samples
    return numpy.full(shape[1:3], samples, numpy.uint32), None


#: No image has more groups than this and fewer columns; arrays that seem to are [H, W, T, 3].
_MANY_GROUPS, _FEW_COLUMNS = 64, 32


def _how_read(**images: Any) -> str:
    """For errors about arrays whose groups may be last: how their shapes were read. "" for others."""
    texts = []
    for name, image in images.items():
        shape = tuple(getattr(image, "shape", ()))
        if _may_be_last(shape):
            texts.append(f"; {_reading(name, shape)}")
    return texts[0] if texts else ""


def _may_be_last(shape: tuple[int, ...]) -> bool:
    """Whether an array could have its groups last: it has more groups, and rows, than columns."""
    return len(shape) == 4 and shape[2] < min(shape[:2])


def _reading(name: str, shape: tuple[int, ...]) -> str:
    return (f"{name}: the shape {list(shape)} was read as [T, H, W, 3], {shape[0]} groups of {shape[2]} x {shape[1]} "
            "pixels, so that arrays [H, W, T, 3] need .transpose(2, 0, 1, 3)")


def _groups_first(name: str, image: Any, found: list[str]) -> Any:
    """The array with its groups first, as [T, H, W, 3], and a warning in `found` if they were last, or may be."""
    shape = tuple(getattr(image, "shape", ()))
    turn = getattr(image, "permute", None) or getattr(image, "transpose", None)
    if not _may_be_last(shape) or shape[2] > _FEW_COLUMNS or turn is None:
        return image
    if min(shape[:2]) <= _MANY_GROUPS:
        found.append(_reading(name, shape))
        return image
    found.append(f"{name}: the shape {list(shape)} was taken for [H, W, T, 3]; expected [T, H, W, 3]")
    return turn(2, 0, 1, 3)


def features_of(aovs: Mapping[str, Any]) -> dict[str, Any]:
    """Auxiliary images by the names of combine()'s features; None for missing ones."""
    return {name: aovs.get(layer) for name, layer in (("albedo", "Albedo"), ("normal", "N"),
                                                      ("denoising_albedo", "DenoisingAlbedo"),
                                                      ("denoising_normal", "DenoisingNormal"), ("position", "P"))}


def _counts(counts: Any) -> Any:
    """As the module takes them. Raises TypeError and ValueError for invalid numbers of samples."""
    import numpy

    numbers = numpy.asarray(counts)
    if numbers.dtype.kind not in "ui" or numbers.ndim != 2:
        found = f"{numbers.dtype} {list(numbers.shape)}" if numbers.ndim else repr(counts)
        raise TypeError(f"counts: found {found}; expected whole numbers, [H, W]")
    if numbers.size and not 0 <= int(numbers.min()) <= int(numbers.max()) <= _covary.most_samples:
        raise ValueError(f"counts: found {numbers.min()} to {numbers.max()}; expected 0 to {_covary.most_samples}")
    return numpy.ascontiguousarray(numbers, numpy.uint32)


def check_options(estimator: str, options: Mapping[str, Any]) -> None:
    """Raises what combine() would for its keywords, for callers that render the images first. Keywords about the images
    are not accepted."""
    given = check_some(combine, options)
    known = {name: given[name] for name in ("denoise", "oidn", "force", "std_error") if name in given}
    if len(known) < len(given):
        raise UsageError(f"{min(set(given) - set(known))}: is not accepted where the images are rendered")
    rest = {name: value for name, value in options.items() if name not in known}
    check_no_passes(rest, "here both images have the same number in all pixels")
    _covary.check_pair_estimator(estimator, text_options(rest, estimator), known.get("denoise") or "",
                                 known.get("oidn", ""))


@dataclass(frozen=True)
class InputReport:
    """The findings of check_inputs(). Correlations are (value, standard error), or None if they cannot be measured.

    errors, warnings, notes: why combine() refuses the images, and what to change in the renderer that made them.
    crn_horizontal, crn_vertical, independent_horizontal, independent_vertical: rank correlation of the errors of
        neighbours: 0.3 to 0.9 in a CRN image, 0 in an independent one.
    crn_independent, crn_mean, independent_mean: rank correlation of the errors of the same pixel in both images: 0.
    """

    errors: list[str]
    warnings: list[str]
    notes: list[str]
    crn_horizontal: tuple[float, float] | None
    crn_vertical: tuple[float, float] | None
    independent_horizontal: tuple[float, float] | None
    independent_vertical: tuple[float, float] | None
    crn_independent: tuple[float, float] | None
    crn_mean: float
    independent_mean: float

    @property
    def ok(self) -> bool:
        """Whether combine() takes the images."""
        return not self.errors


@checked(crn=IMAGE, independent=IMAGE)
def check_inputs(crn: Any, independent: Any) -> InputReport:
    """Checks whether two images meet combine()'s assumptions: finite and linear, of one scene, one with common and the
    other with independent random numbers. Takes what combine() takes."""
    found: list[str] = []
    crn, independent = _groups_first("crn", crn, found), _groups_first("independent", independent, found)
    made = _covary.check_inputs(crn, independent)
    return InputReport(**made | {"warnings": found + made["warnings"]})
