# SPDX-License-Identifier: Apache-2.0
"""The small scenes that come with the package: `covary.render("room", spp=48)`."""
from __future__ import annotations

from pathlib import Path

from ._arguments import checked, text
from .errors import IoError, UsageError

_FOLDER = Path(__file__).parent / "share" / "covary" / "scenes"  # where the package's program looks, too


def _files() -> dict[str, Path]:
    return {file.stem: file for file in _FOLDER.glob("*.*") if file.suffix in (".xml", ".pbrt")}


def names() -> list[str]:
    """The names of all of them."""
    return sorted(_files())


def _file_of(scene: str) -> str:
    """`scene`, the name of a file; or, if there is no such file, the file of the scene that comes under that name.
    Raises IoError for a word that is neither."""
    if "/" in scene or Path(scene).suffix or Path(scene).exists():
        return scene
    files = _files()
    if scene not in files:
        raise IoError(f"cannot read '{scene}': there is no such file, and covary comes with no scene of that name, but "
                      f"with {', '.join(names())}")
    return str(files[scene])


@checked(name=text)
def path(name: str) -> Path:
    """The file of the scene of this name, for Scene.load() and render()."""
    if name not in names():
        raise UsageError(f"name: found {name!r}; expected one of {', '.join(names())}")
    return _files()[name]
