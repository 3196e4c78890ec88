# SPDX-License-Identifier: Apache-2.0
"""Frames of a sequence on Dask workers: each is a task of the program `covary render --frames N`, whose file is on a
shared disk. A frame depends on its number alone, so a frame that is lost with its worker is rendered again by any other
with the same bits, continuing what `--resume` finds."""
from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import _covary
from ._arguments import checked, list_of, path, text, whole
from ._cluster import CLIENT, check_versions, results
from ._combine import PROGRESS
from ._program import failure, program
from .errors import UsageError
from .progress import Progress, steps


def _render_frame(words: tuple[str, ...], folder: str) -> tuple[int, str]:
    """Runs on a worker; returns exit code and messages of the program."""
    code, _, errors = _covary.run_program(["/usr/bin/env", "-C", folder, str(program()), *words])
    return code, errors


def _words(scene: str, output: str, frame: int, options: Sequence[str]) -> tuple[str, ...]:
    return ("render", scene, "-o", output, "--frames", str(frame), "--resume", "--no-preview", "--quiet", *options)


def _waves(output: str, options: Sequence[str], waves: int, seed: int) -> list[tuple[str, list[str]]]:
    """Name and options of each wave."""
    if waves == 1 and seed == 0:
        return [(output, list(options))]
    if any(word.split("=", 1)[0] == "--seed" for word in options):
        raise UsageError("options: --seed is given by seed= and waves=")
    start, end = os.path.splitext(output)
    return [(f"{start}-{wave + 1}{end}" if waves > 1 else output, [*options, "--seed", str(seed + wave)])
            for wave in range(waves)]


def _path(name: str, frame: int) -> Path:
    start = name.rindex("#") + 1
    digits = start - len(name[:start].rstrip("#"))
    return Path(f"{name[:start - digits]}{frame:0{digits}}{name[start:]}")


@checked(client=CLIENT, scene=path, output=path, first=whole(0, 999999), last=whole(0, 999999),
         options=list_of(text, "a list of texts"), waves=whole(1, 1000), seed=whole(0, 999999),
         progress=PROGRESS)
def frames(client: Any, scene: str | os.PathLike[str], output: str | os.PathLike[str], first: int, last: int,
           options: Sequence[str] = (), *, waves: int = 1, seed: int = 0,
           progress: Progress | None = None) -> list[Path]:
    """`covary render SCENE -o OUTPUT --frames FIRST-LAST OPTIONS…` with each frame on a worker of a
    dask.distributed.Client, in this process's folder, which all machines must share. Returns the paths of
    the frames, which have the bits of one machine. Frames that are complete are not rendered again, so that the same
    call continues after an interruption.

    output: a name with '#' for the frame number, "out_####.exr".
    options: further options of the command, e.g. ["--spp", "16", "--camera-path", "path.json"]. `--history` is refused,
        because it makes each frame depend on the one before; use `covary denoise` on the frames afterwards.
    waves: number of tasks per frame, each with the samples that the options name. Task k has the seed `seed` + k - 1
        and writes OUTPUT with "-k" before its extension; `covary denoise` takes them all, without --groups.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) tasks.

    Raises UsageError and Error with the messages of the command.
    """
    check_versions(client)
    if any(word.split("=", 1)[0] == "--history" for word in options):
        raise UsageError("options: --history makes each frame of the one before; render frames with --groups and "
                         "without --denoise, and give them to covary denoise")
    numbers = list(range(first, last + 1))
    if not numbers:
        raise UsageError(f"last: found {last}; expected at least {first}, the first frame")
    folder, parts = os.getcwd(), _waves(os.fspath(output), options, waves, seed)
    tasks = [(frame, (_words(os.fspath(scene), name, frame, words), folder))
             for frame in numbers for name, words in parts]
    shown = steps(progress, "frames" if waves == 1 else "tasks")
    for done, (frame, (code, errors)) in enumerate(results(client, _render_frame, tasks), 1):
        if code != 0:
            raise failure(code, f"frame {frame}: {errors.strip().removeprefix('covary: ')}")
        if shown is not None:
            shown(done, len(tasks))
    return [_path(name, frame) for frame in numbers for name, _ in parts]
