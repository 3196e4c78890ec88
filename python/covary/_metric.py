# SPDX-License-Identifier: Apache-2.0
"""One error of an image, by name."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import array, checked, flag, text
from .errors import _warn

if TYPE_CHECKING:
    from ._result import FloatArray


_WITH_NOISE = ("relmse", "mse")
_MAX_NOISE = 0.1  # of an error, as `covary compare` warns


@dataclass(frozen=True)
class MetricResult:
    """An error of an image."""

    #: The error: the mean over the finite pixels.
    value: float
    n_pixels: int
    #: Pixels with a value that is not finite in the image or a reference; they are left out.
    n_non_finite: int
    #: The error of each pixel, [H, W].
    map: FloatArray = field(repr=False)
    #: Standard error of relmse and mse by the noise of two references. None if it is not known: for other errors, and
    #: for a single reference, all of whose noise counts as the image's error.
    reference_error: float | None = None


@checked(name=text, image=array, reference=array, reference2=array, denominator=array, low_dynamic_range=flag)
def compute(name: str, image: Any, reference: Any, reference2: Any = None, *,
            denominator: Any = None, low_dynamic_range: bool = False) -> MetricResult:
    """The error `name` ("relmse", "flip", …) of an image [H, W, 3] against one reference, or two independent ones.

    denominator: with two references, an image [H, W, 3] with little noise that "relmse" and "relmse-trimmed" are
    relative to; default: the denoised references. low_dynamic_range: clamp to [0, 1] for FLIP.

    Warns (covary.CovaryWarning) if the two references are the same, or too noisy to tell the error.
    """
    value, n, n_bad, errors, noise = _covary.metric(name, image, reference, reference2, denominator, low_dynamic_range)
    is_known = reference2 is not None and name in _WITH_NOISE
    result = MetricResult(value, n, n_bad, errors, noise if is_known else None)
    if reference2 is not None and noise == 0 and _are_equal(reference, reference2):
        _warn("reference, reference2: these are the same image; the noise of two renders of other seeds would cancel")
    elif result.reference_error is not None and result.reference_error > _MAX_NOISE * abs(result.value):
        _warn(f"the noise of the references makes the {name} of {result.value:.3g} uncertain by "
              f"±{result.reference_error:.2g}; references with more samples would tell more")
    return result


def _are_equal(first: Any, second: Any) -> bool:
    import numpy

    return first is second or bool(numpy.array_equal(first, second))
