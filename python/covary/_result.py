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
    #: Estimated standard error of each value, [H, W, 3]; None if the estimator has none, or was not asked.
    std_error: FloatArray | None = field(repr=False)
    #: Estimated bias of each value where it is significant, positive where too bright, zero elsewhere, [H, W, 3]; None
    #: where it is not known.
    bias: FloatArray | None = field(repr=False)
    #: relMSE that the standard errors predict, with the image in place of a reference.
    predicted_relmse: float | None
    #: Between which it is in 80 of 100 renders; None where that is not known, or cannot be given.
    predicted_bounds: tuple[float, float] | None
    #: Why it is not reliable, such as bounds that are further than a factor of 1.5 from it, few samples, or few pixels
    #: that hold most of it; "" where nothing speaks against it.
    prediction_doubt: str
    #: What the checks of the inputs, or the render, warned of.
    warnings: list[str]
    #: Pixels with a value that is not finite in an input; the mean of their finite groups stands there.
    nonfinite_pixels: int
    #: Name and options, as `covary:estimator` of files has them.
    estimator: str
    #: Samples per pixel of all images together, on average; None where arrays do not tell.
    samples_per_pixel: float | None
    #: Images beside it by name, [H, W, 3]: layers, which add up to it, and auxiliary images where they were asked for,
    #: or guided a denoiser: "Albedo", "N", "P", and of what is seen behind mirrors and glass "DenoisingAlbedo",
    #: "DenoisingNormal".
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
    #: Its number in the pixel, or of the light path where `light_path` says so.
    sample: int
    value: tuple[float, float, float]
    light_path: bool
    #: The command that takes it again, alone, and prints it.
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
    #: Whether all passes have the samples that were planned.
    complete: bool
    #: Whether the predicted error is at most the wanted one, where one was.
    until_reached: bool | None
    #: Of denoised images: the part of predicted_relmse that is squared bias, and the relMSE that the mean of the
    #: samples and each denoised image alone would have had, by name.
    bias_share: float | None
    risks: dict[str, float]
    #: Name and version of the neural network that took part; "" without one.
    network: str
    #: What 95 % of the blocks of 16 x 16 pixels do not exceed of the predicted error; None as predicted_relmse.
    predicted_relmse_p95: float | None
    #: Samples of all passes that were not finite, and that were negative where none may be. They count as black.
    not_finite_samples: int
    negative_samples: int
    #: The first of them in each pass, with the commands that replay them.
    bad_samples: list[BadSample]
