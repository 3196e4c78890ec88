# SPDX-License-Identifier: Apache-2.0
"""Finished parts of a render on a cluster, in a folder: a restarted render with the same settings uses them. A part is
a folder that appears under its name only when complete; the hash of its settings names the folder around it."""
from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._images import read_image, write_image
from ._result import BadSample
from .errors import Error, IoError
from .film import Film

if TYPE_CHECKING:
    from ._result import FloatArray

_FORMAT = 1
_FACTS = "part.json"


@dataclass(frozen=True)
class Part:
    """A tile of the frame and a seed, which determine what a worker renders."""

    crop: tuple[int, int, int, int]
    seed: int
    number: int

    @property
    def name(self) -> str:
        x, y, width, height = self.crop
        return f"seed-{self.seed}-tile-{x}-{y}-{width}x{height}"


@dataclass(frozen=True)
class Rendered:
    """The result of a part: the films of its passes, the features if a denoiser needs them, and the samples that count
    as black."""

    films: dict[str, Film]
    aovs: dict[str, FloatArray] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    not_finite_samples: int = 0
    negative_samples: int = 0
    bad_samples: tuple[BadSample, ...] = ()


class PartFolder:
    """The parts of one render. `settings`: everything that determines their pixels besides tile and seed."""

    def __init__(self, folder: str, settings: Mapping[str, Any]) -> None:
        facts = json.dumps({**settings, "version": _covary.version, "format": _FORMAT}, sort_keys=True, default=str)
        self.path = Path(folder) / f"parts-{hashlib.sha256(facts.encode()).hexdigest()[:32]}"
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._write(self.path / "settings.json", facts)
        except OSError as error:
            raise IoError(f"folder: cannot write into {folder}: {error.strerror}") from error

    def _write(self, path: Path, text: str) -> None:
        if path.exists():
            return
        with tempfile.NamedTemporaryFile("w", dir=self.path, prefix=".part-", delete=False) as file:
            file.write(text)
        Path(file.name).rename(path)

    def keep(self, part: Part, rendered: Rendered) -> None:
        """Raises IoError if it cannot be written."""
        place = self.path / part.name
        made = Path(tempfile.mkdtemp(dir=self.path, prefix=".part-"))
        try:
            for name, film in rendered.films.items():
                film.save(made / f"film-{name}.exr")
            for name, image in rendered.aovs.items():
                write_image(made / f"aov-{name}.exr", image if image.ndim == 3 else image[:, :, None].repeat(3, axis=2))
            (made / _FACTS).write_text(json.dumps({
                "films": sorted(rendered.films), "aovs": sorted(rendered.aovs), "warnings": rendered.warnings,
                "not_finite_samples": rendered.not_finite_samples, "negative_samples": rendered.negative_samples,
                "bad_samples": [asdict(bad) for bad in rendered.bad_samples]}))
            if place.exists():  # what load() could not read, or another process made meanwhile
                shutil.rmtree(place)
            made.rename(place)
        except OSError as error:
            if place.exists():  # another process was first
                return
            raise IoError(f"folder: cannot keep a part in {place}: {error}") from error
        finally:
            shutil.rmtree(made, ignore_errors=True)

    def load(self, part: Part) -> Rendered | None:
        """The part; None if it is missing or damaged, and must be rendered again."""
        place = self.path / part.name
        try:
            facts = json.loads((place / _FACTS).read_text())
            films = {name: Film.load(place / f"film-{name}.exr") for name in facts["films"]}
            aovs = {name: read_image(place / f"aov-{name}.exr") for name in facts["aovs"]}
            aovs = {name: image[:, :, 0] if name == "A" else image for name, image in aovs.items()}
            bad = tuple(BadSample(**{**each, "value": tuple(each["value"])}) for each in facts["bad_samples"])
            if any(film.crop != list(part.crop) for film in films.values()):
                return None
            return Rendered(films, aovs, tuple(facts["warnings"]), facts["not_finite_samples"],
                            facts["negative_samples"], bad)
        except (OSError, Error, ValueError, KeyError, TypeError):
            return None
