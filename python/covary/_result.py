# SPDX-License-Identifier: Apache-2.0
"""The results of combine() and render()."""
from __future__ import annotations

import html
from dataclasses import dataclass, field, fields
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import checked, flag, instance, make_last_folder, optional, path, real
from .errors import Error, UsageError

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    FloatArray = NDArray[numpy.float32]


_SAVE = "Result.save()"  # covary:command of its files begins with it, as with the name of a command


AXES = optional(instance("matplotlib's Axes", lambda value: hasattr(value, "imshow")))


def new_axes() -> Any:
    """Of matplotlib."""
    try:
        from matplotlib import pyplot  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError("plot() needs matplotlib: pip install matplotlib") from error
    return pyplot.subplots(layout="constrained")[1]


def relmse_text(value: float | None, bounds: tuple[float, float] | None, doubt: str) -> str:
    """A predicted relMSE with its 80 % interval, and whether it is in doubt; "" if it is unknown."""
    if value is None:
        return ""
    notes = [f"{bounds[0]:.2g} to {bounds[1]:.2g}"] if bounds else []
    notes += ["unsure"] if doubt else []
    return f"predicted relMSE {value:.3g}" + (f" ({'; '.join(notes)})" if notes else "")


@dataclass(frozen=True, repr=False, eq=False)
class Result:
    """An image and what is known of its error. Its repr() is one line; in notebooks it shows the image.

    image: Linear Rec. 709, [H, W, 3].
    std_error: estimated standard error of each value, [H, W, 3]; None if the estimator has none, or was not asked for
        it.
    bias: estimated bias of each value where it is significant, positive if too bright, zero elsewhere, [H, W, 3]; None
        if it is not known.
    predicted_relmse: relMSE that the standard errors predict, relative to the image itself instead of a reference.
    predicted_bounds: bounds between which the relMSE lies in 80 of 100 renders; None if they are not known, or cannot
        be given.
    prediction_doubt: why the prediction is not reliable, such as bounds farther than a factor of 1.5 from it, few
        samples, or few pixels that hold most of the error; why there is none, of images that were to have one; "" if it
        is reliable.
    warnings: warnings of the checks of the inputs, or of the render.
    nonfinite_pixels: pixels with a value that is not finite in an input; they have the mean of their finite groups.
    estimator: name and options of the estimator, as in `covary:estimator` of files.
    samples_per_pixel: samples per pixel of all images together, on average; None if arrays do not know them.
    aovs: further images by name, [H, W, 3]: layers, which add up to the image, and auxiliary images if they were asked
        for or guided a denoiser: "Albedo", "N", "P", and "DenoisingAlbedo" and "DenoisingNormal", which are seen in
        mirrors and through glass.
    bias_share: for denoised images: the fraction of predicted_relmse that is squared bias; None for others.
    risks: for denoised images: the relMSE that the mean of the samples and each denoised image alone would have had, by
        name.
    network: name and version of the neural network that was used; "" without one.
    """

    image: FloatArray = field(repr=False)
    std_error: FloatArray | None = field(repr=False)
    bias: FloatArray | None = field(repr=False)
    predicted_relmse: float | None
    predicted_bounds: tuple[float, float] | None
    prediction_doubt: str
    warnings: list[str]
    nonfinite_pixels: int
    estimator: str
    samples_per_pixel: float | None
    aovs: dict[str, FloatArray] = field(repr=False)
    bias_share: float | None
    risks: dict[str, float]
    network: str

    @checked(path=path, overwrite=flag)
    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> None:
        """Writes the image in the format of the extension: .exr .pfm .tif .hdr .png .jpg. EXR also holds std_error,
        bias, aovs and the predicted error, and of a render its seed and its scene's hash.

        overwrite: replace any file. Without it only what save() wrote is replaced: EXR files that say so, and PNG, TIFF
        and JPEG files that are covary's.

        Raises UsageError for another file of this name, and IoError.
        """
        file = Path(path)
        if not overwrite and file.is_file() and not _covary.is_made_by(fspath(path), _SAVE):
            raise UsageError(f"path: '{fspath(path)}' already exists, and save() did not make it; give another name, "
                             "or overwrite=True to replace it")
        make_last_folder(path)
        attributes = {f"covary:{name}": value for name, value in self._attributes().items()}
        if Path(path).suffix.lower() == ".exr":
            _covary.write_result(fspath(path), self.image, self.std_error, self.bias, self.aovs, attributes)
        else:
            _covary.write_image(fspath(path), self.image, attributes)

    def _attributes(self) -> dict[str, str]:
        """Of files, as programs write them."""
        known = {"estimator": self.estimator, "command": f"covary {_SAVE} of Python", "version": _covary.version}
        if self.network:
            known["denoiser"] = self.network
        if self.samples_per_pixel is not None:
            known["samples"] = f"{self.samples_per_pixel:g}"
        if self.predicted_bounds is not None:
            known["predicted_relmse_80"] = " ".join(f"{bound:.4g}" for bound in self.predicted_bounds)
        if self.prediction_doubt:
            known["prediction_doubt"] = self.prediction_doubt
        return known

    def to_dict(self) -> dict[str, Any]:
        """What is known of the image, without images: a row for `pandas.DataFrame([result.to_dict(), …])`."""
        height, width = self.image.shape[:2]
        facts: dict[str, Any] = {"width": width, "height": height}
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, (bool, int, float, str)) or value is None:
                facts[each.name] = value
        for name in ("std_error", "bias", "predicted_bounds"):  # None, where they are not known
            facts.pop(name, None)
        low, high = self.predicted_bounds or (None, None)
        return {**facts, "predicted_low": low, "predicted_high": high}

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        samples = "" if self.samples_per_pixel is None else f"{self.samples_per_pixel:g} samples per pixel"
        facts = [f"{width} x {height}", samples, self.estimator,
                 relmse_text(self.predicted_relmse, self.predicted_bounds, self.prediction_doubt),
                 "" if getattr(self, "until_reached", True) is not False else "until not reached",
                 f"{len(self.warnings)} warning{'s' if len(self.warnings) > 1 else ''}" if self.warnings else ""]
        return f"<covary.{type(self).__name__} {', '.join(fact for fact in facts if fact)}>"

    def _repr_html_(self) -> str:
        from .notebook import view

        try:
            return view({"image": self})._repr_html_()
        except (Error, OSError, ValueError) as error:  # such as an image without pixels, or a full disk: the cell stays
            return f"<pre>{html.escape(repr(self))}\n{html.escape(str(error))}</pre>"

    @checked(exposure=real(), axes=AXES)
    def plot(self, exposure: float = 0.0, axes: Any = None) -> Any:
        """Draws the image, 2^exposure times as bright and in sRGB, into axes of matplotlib, by default new ones, and
        returns them."""
        import numpy

        axes = new_axes() if axes is None else axes
        linear = numpy.clip(numpy.nan_to_num(self.image * 2.0 ** exposure), 0, 1)
        shown = numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        axes.imshow(shown)
        axes.set_axis_off()
        axes.set_title(relmse_text(self.predicted_relmse, self.predicted_bounds, self.prediction_doubt)
                       or self.estimator)
        return axes


def fields_of(result: Result) -> dict[str, Any]:
    """The fields of Result itself, by name, for derived results."""
    return {each.name: getattr(result, each.name) for each in fields(Result)}


@dataclass(frozen=True)
class BadSample:
    """A sample whose value is not finite, or negative although it must not be. It counts as black.

    film: name of its film in the result's `films`.
    x, y: its pixel in the full frame.
    sample: its index in the pixel, or that of the light path if `light_path` is set.
    value: red, green and blue.
    light_path: whether it is one.
    replay: the command that renders this sample alone and prints it.
    """

    film: str
    x: int
    y: int
    sample: int
    value: tuple[float, float, float]
    light_path: bool
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


@dataclass(frozen=True, repr=False, eq=False)
class RenderResult(Result):
    """The result of a render.

    films: films of the passes by name: "crn", "independent", …
    render_seconds, estimate_seconds: of the passes and auxiliary images, and of what is made of them.
    complete: whether all passes have the planned samples.
    until_reached: whether the predicted error is at most the target; None without a target.
    time_choice: after a time limit: what the clock decided, as options of the program, which make the same image again;
        None without one, or if pixels may differ in their numbers of samples.
    predicted_relmse_p95: the predicted error that 95 % of the blocks of 16 x 16 pixels do not exceed; None if
        predicted_relmse is.
    not_finite_samples, negative_samples: samples of all passes that were not finite, or negative although they must not
        be. They count as black.
    bad_samples: the first such samples of each pass, with the commands that replay them.
    """

    films: dict[str, _covary.Film] = field(repr=False)
    render_seconds: float
    estimate_seconds: float
    complete: bool
    until_reached: bool | None
    time_choice: str | None
    predicted_relmse_p95: float | None
    not_finite_samples: int
    negative_samples: int
    bad_samples: list[BadSample]

    def _attributes(self) -> dict[str, str]:
        of_film = next(iter(self.films.values())).attributes if self.films else {}
        known: dict[str, str] = {name: of_film[name] for name in ("seed", "scene_hash", "settings", "version")
                                 if name in of_film}
        if "Albedo" in self.aovs:
            known["clean_features"] = "true"
        return super()._attributes() | known
