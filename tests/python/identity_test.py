# SPDX-License-Identifier: Apache-2.0
"""Which functions are the same to an experiment."""
import enum
import functools
import importlib
import math
import os
import subprocess
import sys
import textwrap
import threading
import types
import unittest

import numpy
from common import PackageTest
from covary._identity import Unknown, identity_of

SCALE = 1.0
TABLE = {"a": numpy.arange(3)}


class Mode(enum.Enum):
    ONE, TWO = 1, 2


class Slots:
    __slots__ = ("value",)

    def __init__(self, value):
        self.value = value


class Plain:
    def __init__(self, value):
        self.value, self.itself = value, self  # a cycle

    def __call__(self, samples):
        return helper(samples) * self.value


def helper(x):
    return SCALE * x


def same(function):
    return identity_of(function, "f")


def closure(value):
    return lambda x: (x, value)


class Identity(PackageTest):
    def test_code(self):
        made = [lambda x: x + 1, lambda x: x + 2, lambda x: x - 1, lambda x: math.sin(x), lambda x: math.cos(x)]
        self.assertEqual(len({same(f) for f in made}), 5, "on one line")
        self.assertEqual(same(lambda x: x + 1), same(made[0]), "line numbers do not count")
        self.assertNotEqual(same(lambda x: [y + 1 for y in x]), same(lambda x: [y + 2 for y in x]))

    def test_values(self):
        pairs = [(1, 2), (1, 1.0), (1, True), ("a", "b"), (None, 0), ((1, 2), (2, 1)), ([1], (1,)), ({1}, {2}),
                 ({"a": 1}, {"a": 2}), ({"a": 1}, {"b": 1}), (numpy.zeros(2), numpy.ones(2)),
                 (numpy.zeros((2, 1)), numpy.zeros((1, 2))), (numpy.zeros(2), numpy.zeros(2, numpy.float32)),
                 (numpy.float64(1), numpy.float64(2)), (Mode.ONE, Mode.TWO), (Slots(1), Slots(2)), (Plain(1), Plain(2)),
                 (closure(1), closure(2)), (functools.partial(helper, 1), functools.partial(helper, 2)),
                 (numpy.add, numpy.subtract), (numpy.random.default_rng(1), numpy.random.default_rng(2))]
        for first, second in pairs:
            with self.subTest(first=first, second=second):
                self.assertNotEqual(same(closure(first)), same(closure(second)))
                self.assertEqual(same(closure(first)), same(closure(first)))
        self.assertEqual(same(closure({"a", "b", "c"})), same(closure({"c", "b", "a"})))
        self.assertNotEqual(same(lambda x, y=1: (x, y)), same(lambda x, y=2: (x, y)))
        self.assertNotEqual(same(lambda x, *, y=1: (x, y)), same(lambda x, *, y=2: (x, y)))

    def test_globals(self):
        """Those of a function, of the functions inside it, and of those that it calls."""
        users = [lambda x: helper(x), lambda x: [helper(y) for y in x], Plain(1), lambda x: (x, TABLE["a"])]
        before = [same(user) for user in users]
        self.addCleanup(globals().update, {"SCALE": SCALE, "TABLE": TABLE})
        globals().update({"SCALE": 2.0, "TABLE": {"a": numpy.arange(3) + 1}})
        for user, old in zip(users, before, strict=True):
            self.assertNotEqual(same(user), old)

    def test_modules(self):
        """Of a module of one's own, the members that are read."""
        (self.path / "own_module.py").write_text("gain = 1.0\nunused = 1.0\ndef f(x):\n    return gain * x\n")
        sys.path.append(str(self.path))
        self.addCleanup(sys.path.remove, str(self.path))
        own = importlib.import_module("own_module")
        space = {"own": own, "__name__": "__main__"}
        exec("call = lambda x: own.f(x)\nread = lambda x: own.gain * x\nkeep = lambda x: (x, own)\n"
             "def inside(x):\n    import own_module\n    return own_module.f(x)", space)
        before = [same(space[name]) for name in ("call", "read")]
        own.unused = 3.0
        self.assertEqual([same(space[name]) for name in ("call", "read")], before)
        own.gain = 2.0
        for name, old in zip(("call", "read"), before, strict=True):
            self.assertNotEqual(same(space[name]), old)
        for name, message in (("keep", "own, a module of one's own that is passed on"),
                              ("inside", "own_module, a module of one's own that is imported inside")):
            self.assertIn(message, self.message_of(Unknown, same, space[name]))

    def test_unknown(self):
        lock = threading.Lock()
        for function, message in ((lambda x: lock, "lock, a _thread.lock"), (lambda x: eval("x"), "what eval() finds"),
                                  (closure(numpy.array([lock])), "value, a numpy.ndarray"),
                                  (closure([types.SimpleNamespace(a=helper)]), "value[0], a types.Simple")):
            self.assertIn(message, self.message_of(Unknown, same, function))

    def test_other_processes(self):
        """The identity does not depend on addresses, or on the order of sets."""
        code = textwrap.dedent("""
            import numpy, sys
            from covary._identity import identity_of
            names, table = {"a", "b", "c", "d"}, {"x": numpy.arange(3.0)}
            class Own:
                def __init__(self): self.list = [frozenset("xyz"), (1, 2)]
                def __call__(self, x): return x in names and {"u", "v", "w"} & names and table["x"], self.list
            print(identity_of(Own(), "f"))
            """)
        printed = {subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                                  env={**os.environ, "PYTHONHASHSEED": str(seed)}).stdout for seed in (1, 2, 3)}
        self.assertEqual(len(printed), 1, printed)


if __name__ == "__main__":
    unittest.main()
