# SPDX-License-Identifier: Apache-2.0
"""The comparer of `covary view` in a notebook."""
from __future__ import annotations

import html
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from . import _covary
from ._arguments import Rule, checked, flag, path, text, whole
from ._program import program
from .errors import Error


class View:
    """A page that compares images; shown by a notebook, or written by save()."""

    def __init__(self, page: str, height: int) -> None:
        self.page, self.height = page, height

    @checked(path=path)
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the page (HTML), which needs no network; it appears under its name only when complete."""
        target = Path(path)
        part = target.with_name(f"{target.name}.part")
        part.write_text(self.page, encoding="utf-8")
        part.replace(target)

    def __repr__(self) -> str:
        return f"<covary.View, a page of {len(self.page) / 1e6:.1f} MB: shown by a notebook, written by save()>"

    def _repr_html_(self) -> str:
        return (f'<iframe srcdoc="{html.escape(self.page)}" width="100%" height="{self.height}" '
                'style="border: 0"></iframe>')


def _named(images: Mapping[str, Any] | Sequence[Any] | Any) -> dict[str, Any]:
    if isinstance(images, Mapping):
        return {str(name): image for name, image in images.items()}
    if isinstance(images, (list, tuple)):
        return {f"image {number}": image for number, image in enumerate(images, 1)}
    return {"image": images}


def _file_of(argument: str, image: Any, folder: Path, name: str) -> str:
    """The image's file, written first if it is an array or a result. `argument`: its argument, for messages."""
    if isinstance(image, (str, PathLike)):
        return fspath(image)
    if not name or "/" in name or name.startswith("."):
        raise ValueError(f"images: found the name {name!r}; expected a name without '/' and without a leading dot")
    path = str(folder / f"{name}.exr")
    try:
        _covary.write_image(path, getattr(image, "image", image), {})  # of a result
    except (TypeError, ValueError) as error:
        raise type(error)(f"{argument}: {str(error).removeprefix('image: ')}") from None
    return path


#: Arrays are checked when their memory is read, names of files by the program.
_IMAGES = Rule("an array, a result, the name of a file, or several of them", lambda value: value)


@checked(images=_IMAGES, reference=_IMAGES, title=text, height=whole(1, 1 << 20), small=flag)
def view(images: Mapping[str, Any] | Sequence[Any] | Any, reference: Any = None, *, title: str = "", height: int = 640,
         small: bool = False) -> View:
    """Compares images as `covary view` does: arrays [H, W, 3], results, or names of files; a mapping gives them names.

    reference: errors are shown relative to it; height: of the page in the notebook, in pixels; small: without FLIP.
    """
    with tempfile.TemporaryDirectory(prefix="covary-view-") as temporary:
        folder = Path(temporary)
        command = [str(program()), "view", "-o", str(folder / "page.html")]
        command += [_file_of("images", image, folder, name) for name, image in _named(images).items()]
        if reference is not None:
            (folder / "reference").mkdir()
            command += ["--reference", _file_of("reference", reference, folder / "reference", "reference")]
        command += ["--title", title] if title else []
        command += ["--small"] if small else []
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode != 0:
            raise Error(run.stderr.strip().removeprefix("covary: "))
        return View((folder / "page.html").read_text(encoding="utf-8"), height)
