# SPDX-License-Identifier: Apache-2.0
"""Image files, and Open Image Denoise."""
from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import (
    array, attribute_texts, checked, either, empty_or, flag, is_elsewhere, list_of, make_last_folder, optional, path,
    text,
)
from .errors import _warn

if TYPE_CHECKING:
    from ._result import FloatArray

_MUCH, _MANY = 1.5, 0.2  # a value of a feature, and a share of them, that cannot be right (on metal, Mitsuba's are)
_FILES = either("the name of a file, or a list of them", path, list_of(path, "a list of names of files"))


@checked(path=path, layer=text, accept_changed=flag)
def read_image(path: str | PathLike[str], layer: str = "", *, accept_changed: bool = False) -> FloatArray:
    """Reads linear RGB [H, W, 3] from a file of any format; `layer` selects a layer of an EXR: "N", "Albedo", …

    accept_changed: accept an EXR of covary that another program changed, so that its checksums do not match.
    """
    image: FloatArray = _covary.read_image(fspath(path), layer, accept_changed)
    return image


@checked(path=path, image=array, attributes=optional(attribute_texts))
def write_image(path: str | PathLike[str], image: Any, attributes: dict[str, str] | None = None) -> None:
    """Writes linear RGB [H, W, 3] in the format of the extension: .exr .pfm .tif .hdr .png .jpg. A file of
    that name is replaced. float64 is rounded. Raises UsageError for other names."""
    make_last_folder(path)
    is_double = str(getattr(image, "dtype", "")) == "float64"
    _covary.write_image(fspath(path), image.astype("float32") if is_double else image, attributes or {})


@checked(paths=_FILES, layer=text)
def read_groups(paths: str | PathLike[str] | Iterable[str | PathLike[str]], layer: str = "") -> FloatArray:
    """Groups [T, H, W, 3] for combine() from EXR files of any renderer: one file with a layer for each group, or one
    file for each."""
    names = [fspath(paths)] if isinstance(paths, (str, PathLike)) else [fspath(path) for path in paths]
    if not names:
        raise ValueError("paths: found none; one file or more are needed")
    groups: FloatArray = _covary.read_groups(names, layer)
    return groups


def doubts_of_features(albedo: Any, normal: Any) -> list[str]:
    """Of images that are something else, such as another render, or normals of 8 bits."""
    import numpy

    doubts = []
    for name, image, within in (("albedo", albedo, "0 and 1"), ("normal", normal, "-1 and 1")):
        values = numpy.zeros(1) if image is None or is_elsewhere(image) else numpy.asarray(image)
        beyond = float(numpy.mean(numpy.abs(values) > _MUCH)) if values.dtype.kind in "fiu" else 0  # else refused later
        if beyond > _MANY:
            doubts.append(f"{name}: {beyond:.0%} of its values are far from between {within}; expected features of "
                          "surfaces, not another render")
    return doubts


@checked(image=array, albedo=array, normal=array, oidn=empty_or(path))
def denoise(image: Any, albedo: Any = None, normal: Any = None, *, oidn: str | PathLike[str] = "") -> FloatArray:
    """Denoises the image [H, W, 3] with Open Image Denoise, if installed (`pip install pyoidn`). Biased.

    albedo, normal: features [H, W, 3], the normal only together with the albedo.
    oidn: its file or folder, as `covary denoise --oidn` takes it.

    Several renders of other seeds are denoised, with their error, by `combine(None, [first, second])`, which is what
    the command `covary denoise first.exr second.exr` does.
    """
    for doubt in doubts_of_features(albedo, normal):
        _warn(f"{doubt}. Several renders are denoised by combine(None, [first, second])")
    denoised: FloatArray = _covary.denoise(image, albedo, normal, fspath(oidn))
    return denoised
