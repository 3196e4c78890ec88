# SPDX-License-Identifier: Apache-2.0
"""Options of estimators in the registry's form: text by name, each of the type that the registry declares."""
from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from typing import Any

from . import _covary
from ._arguments import Rule, choice, flag, optional, path, real, scalar, text, whole
from .errors import UsageError


@functools.cache
def _registry() -> dict[str, dict[str, Any]]:
    return {known["name"]: known for known in _covary.estimators()}


#: The estimator that is used unless another is named.
DEFAULT: Any = next(name for name, known in _registry().items() if known["is_default"])
#: The one whose image it denoises where it is given a pair.
DEFAULT_OF_PAIRS: str = next(name for name, known in _registry().items() if known["is_default_of_pairs"])


def estimators_of_films() -> tuple[str, ...]:
    """Those that only read the finished films, and do not change what is sampled."""
    return tuple(name for name, known in _registry().items() if known["passes"] != "samples" and not known["adaptive"])


def passes_of(estimator: str) -> str | None:
    """"pair", "samples" or "any"; None if there is no such estimator."""
    return _registry()[estimator]["passes"] if estimator in _registry() else None


@functools.cache
def _options_of(estimator: str) -> dict[str, dict[str, Any]]:
    """The registry's options, by name."""
    return {option["name"]: option for option in _registry().get(estimator, {}).get("options", ())}


def _rule_of(option: dict[str, Any]) -> Rule:
    rule = {"flag": flag, "whole": whole(), "real": real()}.get(option["type"], text)
    bounds = f" ({option['range']})" if option["range"] and option["type"] in ("whole", "real") else ""
    return optional(Rule(rule.accepted + bounds, rule.convert))


def underscored(name: str) -> str:
    return name.replace("-", "_")


def declared_rules(options: Iterable[dict[str, Any]]) -> dict[str, Rule]:
    """Rules of declared options as keywords."""
    def rule_of(option: dict[str, Any]) -> Rule:
        if option["type"] == "flag":
            return flag
        if option["type"] == "choice":
            return optional(choice(option["choices"]))
        return optional(path) if option["is_path"] else _rule_of(option)

    return {underscored(option["name"]): rule_of(option) for option in options}


def text_options(options: Mapping[str, object], estimator: str) -> dict[str, str]:
    """`paper=True, k=9` as {"paper": "", "k": "9"}; None and False are left out, as defaults. Raises
    TypeError and UsageError for values that are not of the option's type; the registry does so for those out of range
    and for names that it does not know."""
    known = _options_of(estimator)
    texts: dict[str, str] = {}
    for keyword, value in options.items():
        name = keyword.replace("_", "-").rstrip("-")
        if name not in known and not isinstance(value, (bool, int, float, str, type(None))):
            raise UsageError(f"{keyword}: there is no such argument, nor an option of estimator {estimator!r}")
        taken = (_rule_of(known[name]) if name in known else optional(scalar))(keyword, value)
        if taken is not None and taken is not False:
            texts[name] = "" if taken is True else str(taken)
    return texts


#: Separators between the numbers of a value, where not a comma.
_SEPARATORS = {"resolution": "x", "split": ":"}


def option_texts(values: Mapping[str, Any]) -> dict[str, str]:
    """Values of rendering options in the command line's form; None and False are left out."""
    def text_of(name: str, value: Any) -> str:
        if isinstance(value, tuple):
            return _SEPARATORS.get(name, ",").join(map(repr, value))
        return repr(value) if isinstance(value, float) else fspath(value) if isinstance(value, PathLike) else str(value)

    return {name: "" if value is True else text_of(name, value) for name, value in values.items()
            if value is not None and value is not False}


@functools.cache
def _of_passes() -> frozenset[str]:
    return frozenset(option["name"] for estimator in _registry().values() for option in estimator["options"]
                     if option["of_passes"])


def check_no_passes(names: Iterable[str], reason: str) -> None:
    """Raises UsageError for keywords that distribute samples among pixels."""
    found = _of_passes().intersection(name.replace("_", "-") for name in names)
    if found:
        name = min(found).replace("-", "_")
        raise UsageError(f"{name} says how many samples pixels get while they are rendered; {reason}")
