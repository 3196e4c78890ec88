# SPDX-License-Identifier: Apache-2.0
"""What decides the results of a function: its code, and the values that it was made with and refers to, so that results
of the same function may be used again, and those of another one are not."""
from __future__ import annotations

import builtins
import dis
import enum
import functools
import hashlib
import io
import pickle
import site
import sys
import sysconfig
import types
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePath
from typing import Any

#: Read what no code names.
_DYNAMIC = frozenset({"eval", "exec", "globals", "locals", "vars", "__import__"})
_GLOBALS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")
_ATTRIBUTES = ("LOAD_ATTR", "LOAD_METHOD")
_OF_CLASSES = frozenset({"__dict__", "__weakref__", "__doc__", "__module__", "__firstlineno__", "__static_attributes__",
                         "__abstractmethods__", "_abc_impl", "__annotations__", "__annotate_func__", "__match_args__"})


class Unknown(Exception):
    """A value that cannot be told from others; the text says which."""


@functools.cache
def _folders() -> tuple[Path, ...]:
    """Of Python and the packages that are installed."""
    names = {sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")}
    names.update([*site.getsitepackages(), site.getusersitepackages()])
    return tuple(Path(name).resolve() for name in names if name)


@functools.cache
def _is_installed(name: str) -> bool:
    """Whether the module is a part of Python or of a package with a version, not the user's own code."""
    module = sys.modules.get(name)
    if name == "__main__" or module is None:
        return False
    file = getattr(module, "__file__", None)
    if name.partition(".")[0] == __package__ or (file is None and not hasattr(module, "__path__")):
        return True
    places = [file] if file else list(getattr(module, "__path__", []))
    return all(any(Path(place).resolve().is_relative_to(folder) for folder in _folders()) for place in places)


def _version(name: str) -> str:
    top = name.partition(".")[0]
    return f"{name} {getattr(sys.modules.get(top), '__version__', sys.version)}"


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """The code and that of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


class _Pickler(pickle.Pickler):
    """Refuses what pickle keeps by name alone although its code may change."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, (type, types.FunctionType)) and not _is_installed(value.__module__):
            raise pickle.PicklingError
        return NotImplemented


class _Walk:
    """Adds values to a hash, each once."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256(sys.version.encode())
        self._seen: dict[int, int] = {}
        self._kept: list[Any] = []  # so that no other value gets the address

    def digest(self) -> str:
        return self._hash.hexdigest()

    def _put(self, *texts: str | bytes) -> None:
        for text in texts:
            content = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
            self._hash.update(f"{len(content)}:".encode() + content)

    def add(self, value: Any, where: str) -> None:
        """`where`: what the value is, for messages."""
        if value is None or value is ... or isinstance(value, (bool, int, float, complex, str, bytes, bytearray)) and (
                type(value).__module__ == "builtins"):
            self._put(type(value).__name__, bytes(value) if isinstance(value, bytearray) else repr(value))
            return
        if id(value) in self._seen:
            self._put("seen", str(self._seen[id(value)]))
            return
        self._seen[id(value)] = len(self._seen)
        self._kept.append(value)
        self._put(type(value).__module__, type(value).__qualname__)
        self._add_compound(value, where)

    def _add_compound(self, value: Any, where: str) -> None:
        if isinstance(value, types.CodeType):
            self._code(value, where)
        elif isinstance(value, types.FunctionType):
            self._function(value, where)
        elif isinstance(value, types.ModuleType):
            if not _is_installed(value.__name__):
                raise Unknown(f"{where}, a module of one's own that is passed on as a value")
            self._put(_version(value.__name__))
        elif type(value) in (tuple, list):
            self._put(str(len(value)))
            self._all((f"{where}[{i}]", each) for i, each in enumerate(value))
        elif type(value) in (dict, types.MappingProxyType):
            self._all((f"{where}[{key!r}]", each) for item in value.items() for key, each in ((item[0], item[0]), item))
        elif type(value) in (set, frozenset):
            self._put(*sorted(_digest(each, where) for each in value))
        elif isinstance(value, (types.MethodType, functools.partial, staticmethod, classmethod, property)):
            parts = ("__self__", "__func__", "func", "args", "keywords", "fget", "fset", "fdel")
            self._all((where, getattr(value, part)) for part in parts if hasattr(value, part))
        elif isinstance(value, type):
            self._class(value, where)
        elif hasattr(value, "__wrapped__") and callable(value):  # by functools.cache and the like
            self.add(value.__wrapped__, where)
        else:
            self._instance(value, where)

    def _all(self, parts: Iterable[tuple[str, Any]]) -> None:
        for where, part in parts:
            self.add(part, where)

    def _code(self, code: types.CodeType, where: str) -> None:
        self._put(code.co_code, *code.co_names, *code.co_varnames, *code.co_freevars, *code.co_cellvars,
                  str((code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)))
        self._put(getattr(code, "co_exceptiontable", b""))
        self._all((where, constant) for constant in code.co_consts)

    def _function(self, function: types.FunctionType, where: str) -> None:
        if _is_installed(function.__module__ or "") and function.__closure__ is None:
            self._put(_version(function.__module__), function.__qualname__)
            return
        self.add(function.__code__, where)
        self._all([(where, function.__defaults__), (where, function.__kwdefaults__)])
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
            try:
                content = cell.cell_contents
            except ValueError:  # not yet assigned
                content = None
            self.add(content, name)
        for code in _codes(function.__code__):
            self._globals(code, function.__globals__)

    def _globals(self, code: types.CodeType, known: dict[str, Any]) -> None:
        """Values of the global names that the code reads; of modules, the members that it reads."""
        steps = [step for step in dis.get_instructions(code) if step.opname not in ("EXTENDED_ARG", "PUSH_NULL")]
        for i, step in enumerate(steps):
            name = str(step.argval)
            if step.opname == "IMPORT_NAME" and name and not _imported_is_installed(name):
                raise Unknown(f"{name}, a module of one's own that is imported inside the function; import it at the "
                              "top of the file")
            if step.opname not in _GLOBALS:
                continue
            if name not in known:
                if name in _DYNAMIC and hasattr(builtins, name):
                    raise Unknown(f"what {name}() finds")
                continue
            value, j = known[name], i + 1
            while isinstance(value, types.ModuleType) and not _is_installed(value.__name__) and j < len(steps) and (
                    steps[j].opname in _ATTRIBUTES):
                name, value = f"{name}.{steps[j].argval}", getattr(value, str(steps[j].argval), None)
                j += 1
            self._put(name)
            self.add(value, name)

    def _class(self, value: type, where: str) -> None:
        self._put(value.__module__, value.__qualname__)
        if _is_installed(value.__module__):
            self._put(_version(value.__module__))
            return
        self._all((where, base) for base in value.__bases__)
        for name, member in sorted(vars(value).items()):
            if name not in _OF_CLASSES and not isinstance(member, (types.MemberDescriptorType,
                                                                   types.GetSetDescriptorType)):
                self._put(name)
                self.add(member, f"{where}.{name}")

    def _instance(self, value: Any, where: str) -> None:
        kind = type(value)
        if kind.__module__ == "numpy" and kind.__name__ == "ndarray" and not value.dtype.hasobject:
            self._put(value.dtype.str, str(value.shape), value.tobytes())
        elif isinstance(value, PurePath):
            self._put(str(value))
        elif isinstance(value, enum.Enum):
            self._all([(where, kind), (where, value.name)])
        elif isinstance(value, (types.BuiltinFunctionType, types.MethodDescriptorType, types.WrapperDescriptorType,
                                types.MethodWrapperType, types.ClassMethodDescriptorType)):
            self._put(value.__qualname__, str(getattr(value, "__module__", "")))
            owner = getattr(value, "__self__", None)
            self.add(owner.__name__ if isinstance(owner, types.ModuleType) else owner, where)
        elif not _is_installed(kind.__module__) and all(
                base is object or not _is_installed(base.__module__) for base in kind.__mro__):
            self.add(kind, where)
            slots = {name: getattr(value, name) for base in kind.__mro__ for name in vars(base).get("__slots__", ())
                     if hasattr(value, name)}
            self._all([(where, vars(value) if hasattr(value, "__dict__") else {}), (where, slots)])
        else:
            self._put(_pickled(value, where))


def _imported_is_installed(name: str) -> bool:
    import importlib.util

    top = name.partition(".")[0]
    if top in sys.modules:
        return _is_installed(top)
    spec = importlib.util.find_spec(top)
    places = [spec.origin] if spec and spec.origin else list(spec.submodule_search_locations or []) if spec else []
    return all(place in ("built-in", "frozen") or any(
        Path(place).resolve().is_relative_to(folder) for folder in _folders()) for place in places)


def _digest(value: Any, where: str) -> str:
    walk = _Walk()
    walk.add(value, where)
    return walk.digest()


def _pickled(value: Any, where: str) -> bytes:
    """What pickle makes of an object of an installed package. Raises Unknown if that does not tell all of it."""
    content = io.BytesIO()
    try:
        _Pickler(content, protocol=4).dump(value)
    except Exception:  # noqa: BLE001  whatever the object's own code raises
        kind = type(value)
        raise Unknown(f"{where}, a {kind.__module__}.{kind.__qualname__}") from None
    return content.getvalue()


def identity_of(function: Any, name: str) -> str:
    """A hash of everything in Python that decides the function's results. Raises Unknown where that cannot be told.
    Files, the environment and the versions of libraries without `__version__` do not count."""
    return _digest(function, name)
