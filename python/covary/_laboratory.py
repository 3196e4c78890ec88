# SPDX-License-Identifier: Apache-2.0
"""Experiments in which methods may be Python functions."""
from __future__ import annotations

import csv
import json
import os
import re
import secrets
import shlex
import socketserver
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import (
    checked, either, function, instance, list_of, make_last_folder, mapping_of, optional, path, text,
)
from ._combine import PROGRESS
from ._identity import Unknown, identity_of
from ._images import read_image
from ._program import FAILED, failure, run_program
from ._result import AXES, new_axes
from .errors import InputError, _warn
from .film import Film
from .progress import Counted, Line, Progress, ended, is_default, is_watched, steps

if TYPE_CHECKING:
    from ._result import FloatArray

_CALL = Path(__file__).with_name("_call.py")
_SOCKET = "COVARY_METHODS"
_MOST_TICKS = 6
#: Of plot(): of methods, and of scenes.
_COLOURS = [f"C{i}" for i in range(10)] + ["navy", "darkgreen", "maroon", "goldenrod", "black"]
_MARKERS, _LINES = "osD^vP*X", ["-", "--", ":", "-."]


@dataclass(frozen=True)
class Samples:
    """What a method of experiment() makes its image of.

    path: file of the mean of all samples, with the layers that were rendered; "" for renderers.
    films: folder with the film of each pass; "" for renderers.
    scene, seed, spp, seconds: the scene's file, the seed, and the samples per pixel, or seconds, of the budget.
    frame, crop: width and height of the frame, and the part of it to make: x, y, width, height.
    """

    path: str
    films: str
    scene: str
    seed: int
    spp: int | None
    seconds: float | None
    frame: tuple[int, int] = (0, 0)
    crop: tuple[int, int, int, int] = (0, 0, 0, 0)

    def __repr__(self) -> str:
        budget = f"{self.spp} samples per pixel" if self.spp is not None else f"{self.seconds:g} seconds"
        width, height = self.crop[2:]
        return f"<covary.Samples {width} x {height} of {Path(self.scene).name}, {budget}, seed {self.seed}>"

    @cached_property
    def image(self) -> FloatArray:
        """The mean of all samples, linear, [H, W, 3]."""
        return read_image(self.path)

    @checked(name=text)
    def layer(self, name: str) -> FloatArray:
        """Another layer of the image, [H, W, 3]: "Albedo", "N", "P", "DenoisingAlbedo", "DenoisingNormal"."""
        return read_image(self.path, name)

    @checked(name=text)
    def film(self, name: str = "independent") -> Film:
        """A pass: its `groups` are means of samples [T, H, W, 3]."""
        return Film.load(Path(self.films) / f"{name}.exr")


@dataclass(frozen=True, repr=False)
class Experiment:
    """The results of experiment().

    folder: with report.html, results.json and results.csv.
    results: results.json (docs/file-formats.md).
    """

    folder: Path
    results: dict[str, Any] = field(repr=False)

    @property
    def warnings(self) -> list[str]:
        """What makes the numbers doubtful, as the report and the terminal say it; also issued as CovaryWarning."""
        return list(self.results["warnings"])

    @property
    def rows(self) -> list[dict[str, Any]]:
        """results.csv, a dictionary for each line, for `pandas.DataFrame(rows)`."""
        with open(self.folder / "results.csv", encoding="utf-8", newline="") as file:
            return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(file)]

    @property
    def table(self) -> list[dict[str, Any]]:
        """A dictionary for each scene, method and budget (in the unit "spp" or "seconds"), for
        `pandas.DataFrame(found.table)`: its errors with their 95 % intervals, ratios of the baseline's error to its
        own, and the seconds that it took, by the clock and of the processor."""
        rows = []
        for cell in self.results["cells"]:
            (unit, budget), = cell["budget"].items()
            row = {"scene": cell["scene"], "method": cell["method"], "budget": budget, "unit": unit,
                   "spp": budget if unit == "spp" else None, "samples_per_pixel": cell["samples_per_pixel"]}
            for name in ("relmse", "flip", "equal_sample", "equal_time", "equal_processor_time"):
                known = cell[name]
                row |= {name: known["value"], f"{name}_low": known["low"], f"{name}_high": known["high"]}
            seconds = cell["seconds"]
            rows.append({**row, "seconds": seconds["method"]["value"],
                         "processor_seconds": seconds["processor"]["value"]})
        return rows

    @checked(axes=AXES)
    def plot(self, axes: Any = None) -> Any:
        """Draws relMSE against samples per pixel with its 95 % intervals, a colour for each method, a marker and kind
        of line for each scene, into axes of matplotlib, by default new ones, and returns them. Budgets in seconds are
        hollow points without lines."""
        axes = new_axes() if axes is None else axes
        lines: dict[tuple[str, str, str], list[tuple[float, float, float, float]]] = {}
        for row in self.table:
            error = row["relmse"]
            if error and error > 0:
                below, above = (abs(error - (error if row[end] is None else max(row[end], error / 100)))
                                for end in ("relmse_low", "relmse_high"))
                lines.setdefault((row["scene"], row["method"], row["unit"]), []).append(
                    (row["samples_per_pixel"], error, below, above))
        scenes, methods = (list(dict.fromkeys(key[i] for key in lines)) for i in (0, 1))
        named: set[str] = set()
        for (scene, method, unit), points in lines.items():
            x, y, below, above = zip(*sorted(points), strict=True)
            s, m = scenes.index(scene), methods.index(method)
            name = scene if len(methods) == 1 else method if len(scenes) == 1 else f"{scene}, {method}"
            axes.errorbar(x, y, (below, above), color=_COLOURS[m % len(_COLOURS)], marker=_MARKERS[s % len(_MARKERS)],
                          linestyle=_LINES[s % len(_LINES)] if unit == "spp" else "none", capsize=2,
                          markerfacecolor=None if unit == "spp" else "none",
                          label=None if name in named else name)
            named.add(name)
        lines = {key: points for key, points in lines.items() if key[2] == "spp"}
        axes.set(xscale="log", yscale="log", xlabel="samples per pixel", ylabel="relMSE")
        counts = sorted({point[0] for points in lines.values() for point in points})
        if 0 < len(counts) <= _MOST_TICKS:
            axes.set_xticks(counts, [f"{count:g}" for count in counts])
            axes.set_xticks([], minor=True)
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.02, 1))  # beside the axes
        return axes

    def __repr__(self) -> str:
        return f"<covary.Experiment {str(self.folder)!r}, {len(self.results['cells'])} cells>"


def _number(value: str) -> Any:
    try:
        return float(value) if value else None
    except ValueError:
        return value


class _Server(socketserver.ThreadingUnixStreamServer):
    daemon_threads = True

    def __init__(self, address: str, methods: Mapping[str, Callable[[Samples], Any]]) -> None:
        self.methods, self.lock = methods, threading.Lock()
        super().__init__(address, _Request)


class _Request(socketserver.StreamRequestHandler):
    def handle(self) -> None:
        """Answers with the processor time once the image is written, or with what went wrong."""
        asked = json.loads(self.rfile.readline())
        server: Any = self.server
        answer: dict[str, Any] = {}
        try:
            with server.lock:
                before = time.process_time()
                _make(server.methods[asked["name"]], asked["run"])
                answer["processor_seconds"] = time.process_time() - before
        except Exception as error:  # noqa: BLE001  the experiment reports it as the method's failure
            answer["error"] = f"{_said(error)}\n{traceback.format_exc()}"
        self.wfile.write(json.dumps(answer).encode())


def _said(error: Exception) -> str:
    """In one line, with the place."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).parent != _CALL.parent] or frames
    return f"{type(error).__name__}: {error} ({Path(own[-1].filename).name}, line {own[-1].lineno})"


def _make(method: Callable[[Samples], Any], run: dict[str, str]) -> None:
    import numpy

    x, y, width, height = (int(number) for number in run["COVARY_CROP"].split(","))
    samples = Samples(run.get("COVARY_IMAGE", ""), run.get("COVARY_FILMS", ""), run["COVARY_SCENE"],
                      int(run["COVARY_SEED"]), int(run["COVARY_SPP"]) if "COVARY_SPP" in run else None,
                      float(run["COVARY_SECONDS"]) if "COVARY_SECONDS" in run else None,
                      (int(run["COVARY_WIDTH"]), int(run["COVARY_HEIGHT"])), (x, y, width, height))
    made = method(samples)
    if made is None:
        raise TypeError("the function returned None; expected an image, [H, W, 3]")
    image = numpy.ascontiguousarray(made, numpy.float32)
    if image.shape != (height, width, 3):
        raise ValueError(f"the function returned the shape {list(image.shape)}; expected [{height}, {width}, 3]")
    _covary.write_image(run["COVARY_OUTPUT"], image, {})


@contextmanager
def _served(methods: Mapping[str, Callable[[Samples], Any]]) -> Iterator[None]:
    """While methods can be asked for images."""
    with tempfile.TemporaryDirectory(prefix="covary-methods-") as folder:
        address = str(Path(folder) / "socket")
        before = os.environ.get(_SOCKET)
        with _Server(address, methods) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            os.environ[_SOCKET] = address
            try:
                yield
            finally:
                server.shutdown()
                os.environ.pop(_SOCKET)
                if before is not None:
                    os.environ[_SOCKET] = before


def _program_of(name: str, method: Callable[..., Any]) -> str:
    """With the function's identity, so that a changed one is computed again."""
    try:
        identity = identity_of(method, name)[:16]
    except Unknown as unknown:
        identity = secrets.token_hex(8)
        _warn(f"methods: '{name}' is computed again each time, as changes of some value that it reads would not be "
              f"seen: {unknown}")
    return f"{name}={shlex.join([sys.executable, '-I', str(_CALL), name, identity])}"


class _Runs:
    """Counts the runs in the program's lines, "[3/24, 0:10 left] room, iicv, …"."""

    def __init__(self, counted: Counted) -> None:
        self._counted, self._told = counted, (-1, -1)

    def __call__(self, text: str) -> None:
        found = re.match(r"\[(\d+)/(\d+)", text)
        if found:
            self._tell(int(found[1]), int(found[2]))
        elif text.startswith(FAILED):
            _warn(text)

    def end(self) -> None:
        """All are there."""
        total = max(self._told[1], 0)
        self._tell(total, total)

    def _tell(self, done: int, total: int) -> None:
        if (done, total) != self._told:
            self._counted(done, total)
        self._told = done, total


class _Log:
    """Prints the program's lines where nobody watches, one for each run."""

    def __init__(self) -> None:
        self._run = ""

    def __call__(self, text: str) -> None:
        found = re.match(r"\[(\d+)/", text)
        if (found and found[1] != self._run) or text.startswith(FAILED):
            self._run = found[1] if found else self._run
            print(text, file=sys.stderr, flush=True)


def _watcher(progress: Progress | None) -> Line | _Log | _Runs | None:
    """What gets the program's lines: shows them, or tells the numbers of runs."""
    if is_default(progress):
        return Line() if is_watched() else _Log()
    counted = steps(progress, "runs")
    return None if counted is None else _Runs(counted)


_SUITE = "the name of a suite, the file of one or of a scene, or a suite as a dictionary"


@checked(suite=either(_SUITE, instance(_SUITE, lambda value: isinstance(value, dict)), path), output=path,
         methods=optional(mapping_of(function, "a mapping from names to functions")),
         renderers=optional(mapping_of(function, "a mapping from names to functions")), scenes=optional(path),
         options=optional(list_of(text, "a list of words of the program")), progress=PROGRESS)
def experiment(suite: str | PathLike[str] | dict[str, Any], output: str | PathLike[str], *,
               methods: Mapping[str, Callable[[Samples], Any]] | None = None,
               renderers: Mapping[str, Callable[[Samples], Any]] | None = None,
               scenes: str | PathLike[str] | None = None, options: list[str] | None = None,
               progress: Progress | None = None) -> Experiment:
    """Compares methods over scenes, budgets and seeds, as `covary experiment` does; methods may be Python functions.

    suite: the name of a built-in suite, a suite's or a scene's file, or a suite as a dictionary (docs/experiments.md).
    output: folder for the report and the results, and for suite-of-python.json if the suite is a dictionary; finished
        runs in it are not repeated.
    methods: functions by name. Each gets Samples and returns an image, [H, W, 3], linear. A method of the suite says
        by "program": NAME what it renders for it; functions that none refers to get independent samples in eight
        groups, with auxiliary features. They are called one after the other, in another thread, and what they take
        counts as their time. A function is computed again if its code has changed, or a value that it refers to or was
        made with: globals, defaults, variables of the functions around it, functions of one's own that it calls. If
        such a value cannot be told from others, it is computed again each time, with a warning. Files that it reads,
        and versions of libraries that do not state one, do not count.
    renderers: the same for functions that make the image of the scene themselves, or have it: covary renders nothing
        for them, and their Samples have no image. References have the box filter, or that of the suite's
        common_options, so that these images need it, too.
    scenes: folder of the suite's scenes; for a dictionary, by default the current folder.
    options: further words of the program, such as ["--quick"] or ["--spp", "16,64"].
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) runs.

    Raises InputError if runs failed, with their messages, which are also warned of when they fail; those that did not
    are in the error's `experiment`.
    """
    begun = time.time_ns()
    given = {**(methods or {}), **(renderers or {})}
    words = [word for option, some in (("--program", methods), ("--renderer", renderers))
             for name, method in (some or {}).items() for word in (option, _program_of(name, method))]
    if scenes is not None:
        words += ["--scenes", fspath(scenes)]
    made_file = Path(output) / "suite-of-python.json"
    with _served(given):
        if isinstance(suite, dict):
            make_last_folder(made_file)
            made_file.write_text(json.dumps(suite, indent=2) + "\n", encoding="utf-8")
            words += ["--scenes", os.getcwd()] if scenes is None else []
            suite = made_file
        watcher = _watcher(progress)
        with ended(watcher):
            code, _, errors = run_program("experiment", suite, "-o", output, *([] if watcher else ["--quiet"]), *words,
                                          *(options or []), progress=watcher)
    made = Path(output) / "results.json"
    if code:
        error = failure(code, errors.replace(f"{made_file}:", "suite:"), InputError)
        if made.is_file() and made.stat().st_mtime_ns >= begun:
            error.experiment = Experiment(made.parent, json.loads(made.read_text(encoding="utf-8")))
        raise error
    if isinstance(watcher, _Runs):
        watcher.end()
    found = Experiment(made.parent, json.loads(made.read_text(encoding="utf-8")))
    for warning in found.warnings:
        _warn(warning)
    return found
