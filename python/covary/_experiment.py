# SPDX-License-Identifier: Apache-2.0
"""`covary experiment` with its runs on Dask workers. Each worker runs parts of the experiment with the program, like
`covary experiment --part K/N`; the contents of their caches are copied into the local one, where the program finds all
runs, measures them and writes the report. So the results are bit for bit those of one machine, except for times."""
from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _covary
from ._arguments import checked, list_of, path, text
from ._cluster import CLIENT, SceneFiles, check_versions, dask, make_plugin, results
from ._combine import PROGRESS
from ._program import failure, program, run_program
from ._render import Scene
from .errors import Error, UsageError
from .progress import Counted, Progress, steps


@dataclass(frozen=True)
class _Piece:
    """One part of the runs of one scene."""

    suite: str  #: JSON, with this scene alone
    folder: str  #: of the scene's files on a worker
    file: str  #: the scene's in it
    local: str  #: its name here
    part: str  #: "3/8"
    options: tuple[str, ...]

    def name(self, program_hash: str) -> str:
        """Name of the record that it is done."""
        text = json.dumps([program_hash, self.suite, self.folder, self.part, self.options])
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def _program_hash() -> str:
    """Hash of its content, because the keys of runs include the build."""
    return hashlib.sha256(program().read_bytes()).hexdigest()


def _check_programs(client: Any, here: str) -> None:
    others = [worker for worker, there in client.run(_program_hash).items() if there != here]
    if others:
        raise UsageError(f"the program covary is another one on {', '.join(sorted(others))}; install the same package "
                         "everywhere")


def _run(piece: _Piece) -> dict[str, dict[str, bytes]]:
    """Runs on a worker; returns the files of the successful runs, by key. Failed ones are tried again where the report
    is made, which then has their messages."""
    from distributed import get_worker  # type: ignore[import-not-found,import-untyped,unused-ignore]

    parent = Path(get_worker().local_directory)
    scene = parent / piece.folder
    with tempfile.TemporaryDirectory(dir=parent, prefix="covary-experiment-") as temporary:
        suite, output = Path(temporary) / "suite.json", Path(temporary) / "out"
        suite.write_text(piece.suite, encoding="utf-8")
        run_program("experiment", suite, "-o", output, "--scenes", scene, "--part", piece.part, "--quiet",
                    *piece.options)
        found: dict[str, dict[str, bytes]] = {}
        for done in (output / "cache" / "runs").glob("*/run.json"):
            found[done.parent.name] = {path.name: path.read_bytes() for path in done.parent.iterdir()}
        there, here = str(scene / piece.file).encode(), piece.local.encode()
        for files in found.values():
            files["run.json"] = files["run.json"].replace(there, here)
        return found


def _keep(runs: dict[str, dict[str, bytes]], cache: Path) -> None:
    """Puts runs into the cache, each completely or not at all."""
    for key, files in runs.items():
        if (cache / "runs" / key / "run.json").exists():
            continue
        (cache / "runs" / key).mkdir(parents=True, exist_ok=True)
        for name in sorted(files, key=lambda name: name == "run.json"):  # this one last: it says that all is there
            whole = cache / "runs" / key / f"{name}.part"
            whole.write_bytes(files[name])
            whole.rename(cache / "runs" / key / name)


def _pieces(client: Any, suite: dict[str, Any], folder: Path, options: tuple[str, ...]) -> Iterator[_Piece]:
    """All parts; the files of a scene go to the workers before its first."""
    for scene, number in zip(suite["scenes"], _covary.numbers_of_parts(json.dumps(suite)), strict=True):
        path = folder / scene["file"]
        defines = dict(text.split("=", 1) for text in scene.get("defines", []))
        files = SceneFiles(Scene.load(path, defines=defines))
        client.register_plugin(make_plugin(files))
        alone = json.dumps({**suite, "scenes": [{**scene, "file": files.file}]})
        for k in range(1, number + 1):
            yield _Piece(alone, files.folder, files.file, str(path), f"{k}/{number}", options)


def _ask(*words: str | os.PathLike[str]) -> str:
    """The program's output. Raises Error with its message."""
    exit_code, output, errors = run_program("experiment", *words)
    if exit_code != 0:
        raise failure(exit_code, errors)
    return output


def _make_runs(client: Any, pieces: Sequence[_Piece], cache: Path, program_hash: str,
               progress: Counted | None) -> None:
    """Runs the parts on the workers, except those in the cache."""
    records = cache / "parts"
    records.mkdir(parents=True, exist_ok=True)

    def is_done(piece: _Piece) -> bool:
        record = records / piece.name(program_hash)
        return record.exists() and all((cache / "runs" / key / "run.json").exists()
                                       for key in json.loads(record.read_text()))

    left = [piece for piece in pieces if not is_done(piece)]
    found = results(client, _run, ((piece, (piece,)) for piece in left))
    for done, (piece, runs) in enumerate(found, len(pieces) - len(left) + 1):
        _keep(runs, cache)
        (records / piece.name(program_hash)).write_text(json.dumps(sorted(runs)))
        if progress is not None:
            progress(done, len(pieces))


@checked(client=CLIENT, suite=path, output=path, arguments=list_of(text, "a list of texts"),
         progress=PROGRESS)
def experiment(client: Any, suite: str | os.PathLike[str], output: str | os.PathLike[str],
               arguments: Sequence[str] = (), *, progress: Progress | None = None) -> Path:
    """`covary experiment SUITE -o OUTPUT ARGUMENTS…` with its runs on the workers of a dask.distributed.Client.
    Returns the path of the report. Cached runs are not repeated, so the same call continues after an interruption.

    suite: a file (JSON, or a scene in XML) or the name of a built-in suite.
    arguments: further options of the command, e.g. ["--quick", "--scenes", "scenes"]; --threads is that of each run.
    progress: True for a line of text, the default on a terminal and in notebooks; False for none; or a function, called
        with (done, total) parts.

    Raises UsageError and Error with the messages of the command.
    """
    dask()
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for name in ("--scenes", "--cache", "--threads"):
        parser.add_argument(name)
    parser.add_argument("--quick", action="store_true")
    known, _ = parser.parse_known_args(list(arguments))
    printed = json.loads(_ask(suite, *arguments, "--print"))
    check_versions(client)
    program_hash = _program_hash()
    _check_programs(client, program_hash)
    options = (*(["--quick"] if known.quick else []), *(["--threads", known.threads] if known.threads else []))
    folder = known.scenes or _covary.scenes_folder(json.dumps(printed), os.fspath(suite), str(program()))
    pieces = list(_pieces(client, printed, Path(folder), options))
    cache = Path(known.cache or Path(output) / "cache")
    _make_runs(client, pieces, cache, program_hash, steps(progress, "parts"))
    _ask(suite, *arguments, "-o", output, "--quiet")
    return Path(output) / "report.html"


@checked(words=list_of(text, "a list of texts"))
def main(words: Sequence[str]) -> int:
    """`covary experiment SUITE -o DIR --cluster ADDRESS [OPTIONS]`, or `python -m covary.distributed experiment …`.
    Returns the exit code."""
    parser = argparse.ArgumentParser("covary experiment", allow_abbrev=False)
    parser.add_argument("--cluster", required=True, metavar="ADDRESS",
                        help="of Dask's scheduler, tcp://HOST:PORT, or its --scheduler-file")
    parser.add_argument("-o", "--output", required=True)
    known, rest = parser.parse_known_args(list(words))
    if rest[:1] != ["experiment"] or len(rest) < 2 or rest[1].startswith("-"):
        print("covary: expected experiment SUITE -o DIR --cluster ADDRESS [OPTIONS]", file=sys.stderr)
        return 2

    def show(done: int, total: int) -> None:
        print(f"[{done}/{total}] parts", file=sys.stderr)

    try:
        place = "scheduler_file" if known.cluster.endswith(".json") else "address"
        with dask().Client(**{place: known.cluster}) as client:
            print(experiment(client, rest[1], known.output, rest[2:], progress=show))
    except (Error, ImportError, OSError) as error:
        print(f"covary: {error}", file=sys.stderr)
        return 2 if isinstance(error, UsageError) else 1
    return 0
