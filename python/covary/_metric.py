# SPDX-License-Identifier: Apache-2.0
"""One error of an image, by name."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import array, checked, flag, text

if TYPE_CHECKING:
    from ._result import FloatArray


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
    #: Standard error of relmse and mse by the noise of two references; otherwise 0.
    reference_error: float = 0.0


@checked(name=text, image=array, reference=array, reference2=array, denominator=array, low_dynamic_range=flag)
def compute(name: str, image: Any, reference: Any, reference2: Any = None, *,
            denominator: Any = None, low_dynamic_range: bool = False) -> MetricResult:
    """The error `name` ("relmse", "flip", …) of an image [H, W, 3] against one reference, or two independent ones.

    denominator: with two references, an image [H, W, 3] with little noise that "relmse" and "relmse-trimmed" are
    relative to; default: the denoised references. low_dynamic_range: clamp to [0, 1] for FLIP.
    """
    return MetricResult(*_covary.metric(name, image, reference, reference2, denominator, low_dynamic_range))
