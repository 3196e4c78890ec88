# SPDX-License-Identifier: Apache-2.0
"""Checks of the arguments of public functions: `@checked` gives each argument a rule, and a value that breaks its rule
raises an exception with the argument's name, the value and what was expected. Arrays are checked where their memory is
read (module/arrays.cpp), names of estimators and their options by the registry."""
from __future__ import annotations

import difflib
import functools
import inspect
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from ._keywords import RenderOptions
from .errors import UsageError

P = ParamSpec("P")
R = TypeVar("R")

_LONGEST = 80  # characters of a value in a message


class _WrongType(Exception):
    pass


class _WrongValue(Exception):
    pass


@dataclass(frozen=True)
class Rule:
    """What an argument accepts, in words, and its conversion to what the function works with."""

    accepted: str
    convert: Callable[[Any], Any]

    def __call__(self, name: str, value: Any) -> Any:
        """The converted value. Raises TypeError and UsageError, which is a ValueError."""
        try:
            return self.convert(value)
        except _WrongType as reason:
            found = str(reason) or f"{_shown(value)} ({type(value).__name__})"
            raise TypeError(f"{name}: found {found}; expected {self.accepted}") from None
        except _WrongValue as reason:
            found = str(reason) or _shown(value)
            raise UsageError(f"{name}: found {found}; expected {self.accepted}") from None


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST - 1] + "…"


def _is_bool(value: Any) -> bool:
    """True for booleans of Python and NumPy."""
    return isinstance(value, bool) or (type(value).__module__ == "numpy" and type(value).__name__ in ("bool", "bool_"))


def _bounds(low: float, high: float) -> str:
    if math.isinf(high):
        return "" if math.isinf(low) else f" from {low} on"
    return f" from {low} to {high}"


def whole(low: float = -math.inf, high: float = math.inf) -> Rule:
    """A whole number of Python or NumPy, or a float without a fraction, such as 48.0."""
    def convert(value: Any) -> int:
        if _is_bool(value) or isinstance(value, (str, bytes)):
            raise _WrongType
        try:
            number = operator.index(value)
        except TypeError:
            real = _float(value)
            if not real.is_integer():
                raise _WrongValue from None
            number = int(real)
        if not low <= number <= high:
            raise _WrongValue
        return number

    return Rule(f"a whole number{_bounds(low, high)}", convert)


def _float(value: Any) -> float:
    if _is_bool(value) or isinstance(value, (str, bytes)) or not hasattr(value, "__float__"):
        raise _WrongType
    try:
        return float(value)
    except (TypeError, ValueError, RuntimeError):  # of arrays with several values
        raise _WrongType from None
    except OverflowError:
        raise _WrongValue from None


def real(low: float = -math.inf, *, above: bool = False) -> Rule:
    """A finite number of at least `low`, or with `above` greater than it."""
    def convert(value: Any) -> float:
        number = _float(value)
        if not math.isfinite(number) or number < low or (above and number == low):
            raise _WrongValue
        return number

    return Rule(f"a number above {low}" if above else f"a number{_bounds(low, math.inf)}", convert)


def _flag(value: Any) -> bool:
    if not _is_bool(value):
        raise _WrongType
    return bool(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise _WrongType
    return str(value)


def _path(value: Any) -> str:
    if not isinstance(value, (str, PathLike)):
        raise _WrongType
    name = fspath(value)
    if not isinstance(name, str):
        raise _WrongType
    if not name or "\0" in name:
        raise _WrongValue
    return name


def _function(value: Any) -> Any:
    if not callable(value):
        raise _WrongType
    return value


def _scalar(value: Any) -> bool | int | float | str:
    if isinstance(value, str):
        return value
    if _is_bool(value):
        return bool(value)
    if hasattr(value, "__index__"):
        try:
            index = operator.index(value)
        except TypeError:  # of arrays
            raise _WrongType from None
        if not -1 << 63 <= index < 1 << 63:
            raise _WrongValue
        return index
    number = _float(value)
    if not math.isfinite(number):
        raise _WrongValue
    return number


flag = Rule("True or False", _flag)
#: For values whose reader checks their type.
scalar = Rule("True, False, a number or text", _scalar)
text = Rule("text", _text)
path = Rule("the name of a file or folder, str or os.PathLike", _path)
function = Rule("a function", _function)
#: The code that reads an array's memory checks it.
array = Rule("an array", lambda value: value)


def _stacked(value: Any) -> Any:
    """Arrays in a list as one, with their number first."""
    if not isinstance(value, (list, tuple)) or not value or not all(len(getattr(v, "shape", ())) == 3 for v in value):
        return value
    import numpy

    from . import _covary

    if len({tuple(v.shape) for v in value}) > 1:
        raise ValueError(f"found arrays of the shapes {', '.join(str(list(v.shape)) for v in value)}")
    return numpy.stack([_covary.copied(v) if is_elsewhere(v) else numpy.asarray(v) for v in value])


def is_elsewhere(array: Any) -> bool:
    """Whether it is on another device than the processor, by DLPack."""
    device = getattr(array, "__dlpack_device__", None)
    return device is not None and int(device()[0]) != 1


#: One array, or a list of arrays [H, W, 3] of renders.
images = Rule("an array, or a list of arrays of the same shape", _stacked)


def choice(names: Iterable[str]) -> Rule:
    """One of these names."""
    known = tuple(names)

    def convert(value: Any) -> str:
        if _text(value) not in known:
            raise _WrongValue
        return str(value)

    return Rule(f"one of {', '.join(map(repr, known))}", convert)


def optional(rule: Rule) -> Rule:
    """What the rule accepts, or None."""
    return Rule(f"{rule.accepted}, or None", lambda value: None if value is None else rule.convert(value))


def empty_or(rule: Rule) -> Rule:
    """What the rule accepts, or an empty string, which stands for no value."""
    return Rule(rule.accepted, lambda value: value if isinstance(value, str) and not value else rule.convert(value))


def several(words: str, *rules: Rule) -> Rule:
    """A tuple or list with one value for each rule; `words` says what they are."""
    def convert(values: Any) -> tuple[Any, ...]:
        if isinstance(values, (str, bytes, Mapping)) or not hasattr(values, "__iter__"):
            raise _WrongType
        members = tuple(values)
        if len(members) != len(rules):
            raise _WrongValue
        return tuple(rule.convert(member) for rule, member in zip(rules, members, strict=True))

    return Rule(words, convert)


def list_of(rule: Rule, words: str) -> Rule:
    """A sequence of any length."""
    def convert(values: Any) -> list[Any]:
        if isinstance(values, (str, bytes, Mapping)) or not hasattr(values, "__iter__"):
            raise _WrongType
        return [rule.convert(value) for value in values]

    return Rule(words, convert)


def mapping_of(rule: Rule, words: str) -> Rule:
    """A mapping from strings to what the rule accepts."""
    def convert(values: Any) -> dict[str, Any]:
        if not isinstance(values, Mapping):
            raise _WrongType
        found = {}
        for name, value in values.items():
            try:
                found[_text(name)] = rule.convert(value)
            except (_WrongType, _WrongValue) as reason:
                raise type(reason)(f"{_shown(name)}: {_shown(value)}") from None
        return found

    return Rule(words, convert)


attribute_texts = mapping_of(text, "a mapping from texts to texts")


def instance(words: str, accepts: Callable[[Any], bool]) -> Rule:
    """An instance of a class."""
    def convert(value: Any) -> Any:
        if not accepts(value):
            raise _WrongType
        return value

    return Rule(words, convert)


def either(words: str, *rules: Rule) -> Rule:
    """The first of the rules that accepts the type."""
    def convert(value: Any) -> Any:
        for rule in rules:
            try:
                return rule.convert(value)
            except _WrongType:
                continue
        raise _WrongType

    return Rule(words, convert)


def _type_of_option(name: str) -> Any:
    """Of a declared option, as text like the annotations of arguments."""
    return getattr(RenderOptions.__annotations__[name], "__forward_arg__", inspect.Parameter.empty)


#: Arguments by the names that others give them.
_MEANT = {"width": "resolution", "height": "resolution", "size": "resolution", "samples": "spp"}


def check_names(options: Iterable[str], arguments: Iterable[str]) -> None:
    """Raises UsageError for keywords that are misspelt arguments. Other unknown ones are left to the registry, which
    knows the options of estimators."""
    known = set(arguments)
    for name in options:
        near = [_MEANT[name]] if _MEANT.get(name) in known else difflib.get_close_matches(
            name, known, 1, 0.8 if len(name) > 4 else 0.6)
        if name not in RenderOptions.__annotations__ and near:
            raise UsageError(f"{name}: there is no such argument; did you mean {near[0]}?")


def checked(declared: Mapping[str, Rule] | None = None, /, **rules: Rule) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Gives each argument of a function its rule. Arguments without a rule, and rules without an argument, are bugs of
    the package, found when it is imported. `declared`: rules of options that arrive in the function's **options."""
    def decorate(called: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(called)
        shown = list(signature.parameters.values())
        named = [parameter.name for parameter in shown
                 if parameter.kind is not parameter.VAR_KEYWORD and parameter.name != "self"]
        if set(named) != set(rules):
            raise TypeError(f"{called.__qualname__}: the rules are of {sorted(rules)}, the arguments {sorted(named)}")
        more = {name: rule for name, rule in (declared or {}).items() if name not in rules}

        @functools.wraps(called)
        def call(*arguments: P.args, **keywords: P.kwargs) -> R:
            try:
                bound = signature.bind(*arguments, **keywords)
            except TypeError:
                bound = None
            if bound is None:
                takes_more = any(parameter.kind is parameter.VAR_KEYWORD for parameter in signature.parameters.values())
                check_names([] if takes_more else set(keywords) - set(named), named)
                return called(*arguments, **keywords)  # Python's own message, which names the function
            for given, known in ((bound.arguments, rules), (bound.arguments.get("options", {}) if more else {}, more)):
                given.update({name: rule(name, given[name]) for name, rule in known.items() if name in given})
            return called(*bound.args, **bound.kwargs)

        call.rules = {**rules, **more}  # type: ignore[attr-defined]
        if more:  # what help and completion show
            shown[-1:-1] = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=_type_of_option(name),
                                              default=False if rule is flag else None) for name, rule in more.items()]
            call.__signature__ = signature.replace(parameters=shown)  # type: ignore[attr-defined]
        return call

    return decorate


def check_some(function: Callable[..., Any], given: Mapping[str, Any], of: str = "") -> dict[str, Any]:
    """Keywords for a checked function before it is called: the known ones, converted by its rules. `of`: the argument
    that holds them."""
    rules: Mapping[str, Rule] = function.rules  # type: ignore[attr-defined]
    return {name: rules[name](f"{of}[{name!r}]" if of else name, value)
            for name, value in given.items() if name in rules}


def make_last_folder(file: str | PathLike[str]) -> None:
    """The last folder of an output's name is made if need be, as by the program; others are missing by mistake."""
    folder = Path(file).parent
    if not folder.exists() and folder.parent.is_dir():
        folder.mkdir(exist_ok=True)
