# SPDX-License-Identifier: Apache-2.0
"""Options of estimators as the registry takes them: text by name."""
from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Union

from . import _covary
from .errors import UsageError

OptionValue = Union[bool, int, float, str, None]


def text_options(options: Mapping[str, OptionValue]) -> dict[str, str]:
    """`exclude_target=True, k=9` as {"exclude-target": "", "k": "9"}; None and False are left out, as defaults."""
    texts: dict[str, str] = {}
    for name, value in options.items():
        if value is None or value is False:
            continue
        if not isinstance(value, (bool, int, float, str)) and not hasattr(value, "__float__"):
            raise TypeError(f"{name}: found {type(value).__name__}; accepted are bool, int, float and str")
        texts[name.replace("_", "-")] = "" if value is True else str(value)
    return texts


@functools.cache
def _of_passes() -> frozenset[str]:
    return frozenset(name for estimator in _covary.estimators() for option in estimator["options"]
                     if option["of_passes"] for name in (option["name"], *option["aliases"]))


def check_no_passes(names: Iterable[str], reason: str) -> None:
    """Raises UsageError for keywords that say how passes share their samples among pixels."""
    found = _of_passes().intersection(name.replace("_", "-") for name in names)
    if found:
        raise UsageError(f"--{min(found)} says how many samples pixels get while they are rendered; {reason}")
