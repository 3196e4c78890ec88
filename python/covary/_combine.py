# SPDX-License-Identifier: Apache-2.0
"""Images of any renderer, as arrays or films, made into one with less noise."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _covary
from ._options import OptionValue, text_options
from ._result import Result

if TYPE_CHECKING:
    from .estimators import PairEstimator

Progress = Callable[[int, int], object]


def combine(crn: Any, independent: Any, estimator: PairEstimator = "iicv", *, std_error: bool | None = None,
            samples: int | None = None, force: bool = False, progress: Progress | None = None,
            **options: OptionValue) -> Result:
    """One image of two: `crn`, whose pixels share their random numbers, and `independent`, whose pixels do not.

    Each is an array of float32 [T, H, W, 3], the means of T groups of samples (renders with different seeds), of NumPy,
    PyTorch or anything with DLPack or the buffer protocol and with any strides; or a Film. Values are linear; 12 groups
    are recommended. Memory that is [H, W, T, 3], as of read_groups() and Film.groups, is read where it lies.

    estimator: "iicv", or a comparator; its options follow as keywords (covary.estimators has each with its types).
    std_error: estimate the error, too; by default where the estimator can.
    samples: samples per pixel of the CRN image, for estimators that need them.
    force: combine even where the checks of the inputs find errors.
    progress: called with (done, total) steps.

    The values are those of `covary combine` in every bit. Raises InputError where the inputs do not fit, UsageError for
    options that the estimator does not have.
    """
    return Result(*_covary.combine(crn, independent, estimator, text_options(options), force, std_error, samples,
                                   progress))


@dataclass(frozen=True)
class InputReport:
    """What check_inputs() found. Correlations are (value, standard error), or None where they cannot be measured."""

    #: Why combine() refuses the images, with the setting to change in the renderer that made them.
    errors: list[str]
    warnings: list[str]
    notes: list[str]
    #: Rank correlation of the errors of neighbours: 0.3 to 0.9 in a CRN image, 0 in an independent one.
    crn_horizontal: tuple[float, float] | None
    crn_vertical: tuple[float, float] | None
    independent_horizontal: tuple[float, float] | None
    independent_vertical: tuple[float, float] | None
    #: Of the errors of the same pixel in both images: 0.
    crn_independent: tuple[float, float] | None
    crn_mean: float
    independent_mean: float

    @property
    def ok(self) -> bool:
        """Whether combine() takes the images."""
        return not self.errors


def check_inputs(crn: Any, independent: Any) -> InputReport:
    """Whether two images are what combine() assumes: finite and linear, with common random numbers in the one and
    independent ones in the other, of one scene. Takes what combine() takes."""
    return InputReport(**_covary.check_inputs(crn, independent))
