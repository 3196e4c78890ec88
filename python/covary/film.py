# SPDX-License-Identifier: Apache-2.0
"""Films, the results of render passes: merging them, and making them from arrays."""
from __future__ import annotations

from collections.abc import Sequence
from os import PathLike, fspath
from typing import Any

from . import _covary
from ._arguments import array, attribute_texts, checked, choice, either, instance, list_of, optional, path, whole
from ._covary import Film

__all__ = ["Film", "film_from_groups", "merge_films"]


_FILM = either("a covary.Film or the name of its file",
               instance("a covary.Film", lambda value: isinstance(value, Film)), path)


@checked(films=list_of(_FILM, "a list of Film objects, or of names of their files"))
def merge_films(films: Sequence[Film | str | PathLike[str]]) -> Film:
    """The film of all samples of several films of one scene with different seeds, as `covary merge` makes it, with the
    same bits in any order. Only one file is in memory at a time. Raises InputError if the films do not belong together
    or share a seed."""
    members = [film for film in films if isinstance(film, Film)]
    paths = [fspath(film) for film in films if not isinstance(film, Film)]
    if members and paths:
        raise TypeError("films: found Film objects and names of files; expected one or the other")
    return Film._merge_files(paths) if paths else Film._merge(members)


@checked(groups=array, samples=whole(1, _covary.most_samples), sampling=choice(("", "crn", "independent")),
         seed=optional(whole(0, (1 << 64) - 1)), attributes=optional(attribute_texts))
def film_from_groups(groups: Any, samples: int, *, sampling: str = "", seed: int | None = None,
                     attributes: dict[str, str] | None = None) -> Film:
    """A film of group means [T, H, W, 3] of any renderer, `samples` per pixel of all groups together.

    sampling: "crn" or "independent", which combine() then checks; seed: the one that merge_films() compares.
    """
    known = {key: value for key, value in (("sampling", sampling), ("seed", "" if seed is None else str(seed)))
             if value}
    return Film._from_groups(groups, samples, {**known, **(attributes or {})})


def _from_parts(frame: tuple[int, int], crop: tuple[int, int, int, int], groups: Any, counts: Any,
                attributes: dict[str, str]) -> Film:
    """A film from its group means [H, W, T, 3], counts [H, W] and the rest; called by pickle."""
    return Film._from_parts(frame, crop, groups, counts, attributes)
