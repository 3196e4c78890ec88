# SPDX-License-Identifier: Apache-2.0
"""Frames of a sequence."""
from __future__ import annotations

import inspect
import re
import threading
import time
from collections.abc import Iterable
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _covary
from ._arguments import Rule, check_names, checked, empty_or, flag, instance, optional, path, real, text, whole
from ._combine import DENOISE, PROGRESS
from ._options import DEFAULT, option_texts, text_options
from ._program import failure, run_program
from ._render import _DECLARED, FILTER, SEED, SPP, VIEW_RULES, render, view_options
from .errors import UsageError
from .progress import Counted, Progress, steps
from .scenes import _file_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import DenoiseMode, Filter, RenderOptions
    from .estimators import Estimator

_LOOK_SECONDS = 0.2
#: Options of RenderOptions; the others are arguments.
_OPTIONS = {name: rule for name, rule in _DECLARED.items()
            if name not in inspect.signature(inspect.unwrap(render)).parameters}
_WORDS = 'a range, such as range(1, 49), or text such as "1-48"'
_RULE: Rule = Rule(_WORDS, lambda value: text.convert(value) if isinstance(value, str)
                   else instance(_WORDS, lambda given: isinstance(given, range)).convert(value))


def _numbers(frames: str | range) -> tuple[str, list[int]]:
    """The frames as the program has them, and their numbers."""
    if isinstance(frames, str):
        first, _, rest = frames.partition("-")
        last, _, step = (rest or first).partition(":")
        try:
            return frames, list(range(int(first), int(last) + 1, int(step or 1)))
        except ValueError:
            raise UsageError(f"frames: found {frames!r}; expected {_WORDS}") from None
    if not frames or frames.step < 1:
        raise UsageError(f"frames: found {frames!r}; expected at least one, in rising order")
    return f"{frames[0]}-{frames[-1]}" + (f":{frames.step}" if frames.step > 1 else ""), list(frames)


def _frame_path(pattern: str, frame: int) -> Path:
    start = pattern.rindex("#") + 1
    digits = start - len(pattern[:start].rstrip("#"))
    return Path(f"{pattern[:start - digits]}{frame:0{digits}}{pattern[start:]}")


def _watch(files: list[Path], since: float, keeps: bool, progress: Counted,
           end: threading.Event) -> None:
    shown = -1
    while True:
        is_last = end.wait(_LOOK_SECONDS)
        done = sum(file.exists() and (keeps or file.stat().st_mtime >= since) and _covary.is_complete_file(str(file))
                   for file in files)
        if done != shown:
            progress(done, len(files))
            shown = done
        if is_last:
            return


@checked(_OPTIONS, scene=path, output=path, frames=_RULE, spp=optional(SPP), estimator=optional(text),
         integrator=text, camera_path=optional(path), fps=optional(real(0.01)), history=flag,
         **VIEW_RULES,
         until=optional(real(0, above=True)), time=optional(real(0, above=True)), seed=SEED, denoise=DENOISE,
         oidn=empty_or(path), filter=FILTER, resume=flag, overwrite=flag, preview=flag,
         threads=whole(0, 4096), progress=PROGRESS)
def render_frames(scene: str | PathLike[str], output: str | PathLike[str], frames: str | range,
                  spp: int | None = None, estimator: Estimator | None = None, *, integrator: str = "",
                  camera_path: str | PathLike[str] | None = None, fps: float | None = None, history: bool = False,
                  resolution: tuple[int, int] | None = None, environment: str | PathLike[str] = "auto",
                  background: float | tuple[float, float, float] | None = None, camera: str | int = "",
                  until: float | None = None, time: float | None = None,
                  seed: int = 0, denoise: DenoiseMode | None = None, oidn: str | PathLike[str] = "",
                  filter: Filter | None = None, resume: bool = False, overwrite: bool = False, preview: bool = False,
                  threads: int = 0, progress: Progress | None = None, **options: Unpack[RenderOptions]) -> list[Path]:
    """Renders frames of a sequence into files, as `covary render --frames` does, and returns their names.

    scene: a file, or a name with '#' for the frame number, "room_####.xml".
    output: likewise, "out_####.exr".
    frames: numbers, range(1, 49) or "1-48".
    camera_path: JSON with the camera's keys (docs/sequences.md); fps: frames per second of the path and of animations.
    history: mix in the previous frame where held-out samples prefer it.
    resume: keep complete frames, and continue; overwrite: replace frames that have other settings.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) frames, from another thread.
    Everything else is as in render(). Ctrl-C ends the frame in progress; complete ones stay.

    Raises what render() raises, with the messages of the program.
    """
    words, numbers = _numbers(frames)
    pattern = fspath(output)
    if "#" not in pattern:
        raise UsageError(f"output: found {pattern!r}; expected a name with '#' for the frame number, \"out_####.exr\"")
    keywords: dict[str, Any] = dict(options)
    check_names(keywords, render_frames.rules)  # type: ignore[attr-defined]
    declared = {name.replace("_", "-"): keywords.pop(name) for name in _OPTIONS if name in keywords}
    values = option_texts({
        "output": pattern, "frames": words, "spp": spp, "time": time, "seed": seed or None, "estimator": estimator,
        "until": None if until is None else f"relmse={until!r}", "integrator": integrator or None,
        "denoise": denoise, "oidn": fspath(oidn) or None, "resume": resume, "overwrite": overwrite,
        "no-preview": not preview, "resolution": resolution, "camera-path": camera_path, "fps": fps,
        "history": "on" if history else None, "rfilter": filter, "threads": threads or None,
        **view_options(environment, background, camera), **declared})
    values.update(text_options(keywords, estimator or DEFAULT))
    arguments = [word for name, value in values.items() for word in ((f"--{name}", value) if value else (f"--{name}",))]
    files = [_frame_path(pattern, frame) for frame in numbers]
    code, errors = _run([_file_of(fspath(scene)), *arguments, "--quiet"], files, resume, steps(progress, "frames"))
    if code:
        raise failure(code, _as_arguments(errors))
    return files


def _as_arguments(message: str) -> str:
    """The program's message with its options as arguments: "overwrite=True" for "--overwrite"."""
    def argument(match: re.Match[str]) -> str:
        name = match[1].replace("-", "_")
        return f"{name}=True" if name in ("resume", "overwrite", "preview") else name

    return re.sub(r"(?<![\w-])--([a-z][a-z0-9-]*)", argument, message.strip().removeprefix("covary: "))


def _run(words: Iterable[str], files: list[Path], keeps: bool,
         progress: Counted | None) -> tuple[int, str]:
    """Exit code and messages of `covary render`."""
    if progress is None:
        code, _, errors = run_program("render", *words)
        return code, errors
    end = threading.Event()
    watcher = threading.Thread(target=_watch, args=(files, time.time(), keeps, progress, end), daemon=True)
    watcher.start()
    try:
        code, _, errors = run_program("render", *words)
    finally:
        end.set()
        watcher.join()
    return code, errors
