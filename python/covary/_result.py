# SPDX-License-Identifier: Apache-2.0
"""The results of combine() and render()."""
from __future__ import annotations

from dataclasses import dataclass, field, fields
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import checked, path

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    FloatArray = NDArray[numpy.float32]


@dataclass(frozen=True)
class Result:
    """An image and what is known of its error."""

    #: Linear Rec. 709, [H, W, 3].
    image: FloatArray = field(repr=False)
    #: Estimated standard error of each value, [H, W, 3]; None if the estimator has none, or was not asked for it.
    std_error: FloatArray | None = field(repr=False)
    #: Estimated bias of each value where it is significant, positive if too bright, zero elsewhere, [H, W, 3]; None if
    #: it is not known.
    bias: FloatArray | None = field(repr=False)
    #: relMSE that the standard errors predict, relative to the image itself instead of a reference.
    predicted_relmse: float | None
    #: Bounds between which the relMSE lies in 80 of 100 renders; None if they are not known, or cannot be given.
    predicted_bounds: tuple[float, float] | None
    #: Why the prediction is not reliable, such as bounds farther than a factor of 1.5 from it, few samples, or few
    #: pixels that hold most of the error; "" if it is.
    prediction_doubt: str
    #: Warnings of the checks of the inputs, or of the render.
    warnings: list[str]
    #: Pixels with a value that is not finite in an input; they have the mean of their finite groups.
    nonfinite_pixels: int
    #: Name and options of the estimator, as in `covary:estimator` of files.
    estimator: str
    #: Samples per pixel of all images together, on average; None if arrays do not know them.
    samples_per_pixel: float | None
    #: Further images by name, [H, W, 3]: layers, which add up to the image, and auxiliary images if they were asked for
    #: or guided a denoiser: "Albedo", "N", "P", and "DenoisingAlbedo" and "DenoisingNormal", which are seen in mirrors
    #: and through glass.
    aovs: dict[str, FloatArray] = field(repr=False)

    @checked(path=path)
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the image in the format of the extension: .exr .pfm .tif .hdr .png .jpg."""
        attributes = {"covary:estimator": self.estimator}
        if self.samples_per_pixel is not None:
            attributes["covary:samples"] = f"{self.samples_per_pixel:g}"
        _covary.write_image(fspath(path), self.image, attributes)

    def _repr_html_(self) -> str:
        from .notebook import view

        return view({"image": self})._repr_html_()


def fields_of(result: Result) -> dict[str, Any]:
    """The fields of Result itself, by name, for derived results."""
    return {each.name: getattr(result, each.name) for each in fields(Result)}


@dataclass(frozen=True)
class BadSample:
    """A sample whose value is not finite, or negative although it must not be. It counts as black."""

    #: Name of its film in the result's `films`.
    film: str
    #: Its pixel in the full frame.
    x: int
    y: int
    #: Its index in the pixel, or that of the light path if `light_path` is set.
    sample: int
    value: tuple[float, float, float]
    light_path: bool
    #: The command that renders this sample alone and prints it.
    replay: str

    def __str__(self) -> str:
        kind = "light path" if self.light_path else "sample"
        red, green, blue = self.value
        return f"pixel ({self.x}, {self.y}), {kind} {self.sample}: ({red:g}, {green:g}, {blue:g})"


def text_of_bad_samples(not_finite: int, negative: int, samples: list[BadSample]) -> str:
    """The program's report about them; "" if there are none."""
    if not samples:
        return ""
    lines = [f"{not_finite} samples were not finite and {negative} negative; they count as black. The first:"]
    return "\n".join([*lines, *(f"  {sample}\n    {sample.replay}" for sample in samples)])


@dataclass(frozen=True)
class RenderResult(Result):
    """The result of a render."""

    #: Films of the passes by name: "crn", "independent", …
    films: dict[str, _covary.Film] = field(repr=False)
    render_seconds: float
    estimate_seconds: float
    #: Whether all passes have the planned samples.
    complete: bool
    #: Whether the predicted error is at most the target; None without a target.
    until_reached: bool | None
    #: After a time limit: what the clock decided, as options of the program, which make the same image again; None
    #: without one, or if pixels may differ in their numbers of samples.
    time_choice: str | None
    #: For denoised images: the fraction of predicted_relmse that is squared bias, and by name the relMSE that the mean
    #: of the samples and each denoised image alone would have had.
    bias_share: float | None
    risks: dict[str, float]
    #: Name and version of the neural network that was used; "" without one.
    network: str
    #: The predicted error that 95 % of the blocks of 16 x 16 pixels do not exceed; None if predicted_relmse is.
    predicted_relmse_p95: float | None
    #: Samples of all passes that were not finite, or negative although they must not be. They count as black.
    not_finite_samples: int
    negative_samples: int
    #: The first such samples of each pass, with the commands that replay them.
    bad_samples: list[BadSample]
