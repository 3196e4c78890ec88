# SPDX-License-Identifier: Apache-2.0
"""Options of estimators as the registry takes them: text by name."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Union

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
