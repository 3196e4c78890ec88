# SPDX-License-Identifier: Apache-2.0
"""What any work on a cluster begins with: a client of the chosen cluster, a check that all machines have the same
versions, and the scene files on every worker."""
from __future__ import annotations

import hashlib
import importlib.metadata
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from . import _covary
from ._arguments import Rule, checked, instance, path
from ._render import Scene
from .errors import IoError, UsageError

T = TypeVar("T")

_PATIENCE = 60.0  # seconds without a result after which workers are looked for
_RETRIES = 5  # of a task that an error of the machine ended
_CLUSTER = ("cluster = SLURMCluster(…); cluster.scale(100); client = Client(cluster). scale() itself returns None, and "
            "Client(None) starts workers on this machine, which Client(LocalCluster()) does where it is wanted")


def _client(value: Any) -> Any:
    if value is None or not (hasattr(value, "submit") and hasattr(value, "register_plugin")):
        raise TypeError(f"client: found {value!r} ({type(value).__name__}); expected a dask.distributed.Client: "
                        f"{_CLUSTER}")
    if getattr(value, "_start_arg", value) is None and getattr(value, "cluster", None) is not None:
        raise UsageError("client: found one that was made without a cluster, so that it started workers on this "
                         f"machine by itself; expected a client of a cluster or an address: {_CLUSTER}")
    return value


#: The rule of the argument `client`.
CLIENT = Rule("a dask.distributed.Client", _client)


class SceneFiles:
    """The files of a scene by content; every worker, including late ones, gets them once."""

    @checked(scene=instance("a covary.Scene", lambda value: isinstance(value, Scene)))
    def __init__(self, scene: Scene) -> None:
        paths = sorted({os.path.realpath(path) for path in [scene.path, *scene.files]})
        root = os.path.commonpath([os.path.dirname(path) for path in paths])
        self.contents = {os.path.relpath(path, root): Path(path).read_bytes() for path in paths}
        self.file = os.path.relpath(os.path.realpath(scene.path), root)
        digest = hashlib.sha256()
        for name, content in sorted(self.contents.items()):
            digest.update(f"{name}\0{len(content)}\0".encode() + content)
        self.hash = digest.hexdigest()[:32]

    @property
    def folder(self) -> str:
        """Its name in the folder of a worker."""
        return f"covary-scene-{self.hash}"

    @checked(parent=path)
    def write(self, parent: str | os.PathLike[str]) -> Path:
        """Writes them into a separate folder, unless it exists. Raises IoError."""
        parent = Path(parent)
        folder = parent / self.folder
        if folder.exists():
            return folder
        try:
            parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=parent, prefix="covary-scene-") as temporary:
                made = Path(temporary) / "files"
                for name, content in self.contents.items():
                    (made / name).parent.mkdir(parents=True, exist_ok=True)
                    (made / name).write_bytes(content)
                made.rename(folder)
        except OSError as error:
            if folder.exists():  # another worker of this machine was first
                return folder
            size = sum(map(len, self.contents.values()))
            raise IoError(f"a worker cannot write the scene's files, {size / 1e6:.1f} MB, into {parent}: "
                          f"{error.strerror}; workers' --local-directory names another place") from error
        return folder


def make_plugin(files: SceneFiles) -> Any:
    """The plugin for `Client.register_plugin()` that writes the files on every worker, including late ones."""
    from distributed import WorkerPlugin  # type: ignore[import-not-found,import-untyped,unused-ignore]

    class Deliver(WorkerPlugin):  # type: ignore[misc,unused-ignore]
        name = files.folder
        idempotent = True

        def setup(self, worker: Any) -> None:
            files.write(Path(worker.local_directory))

    return Deliver()


def dask() -> Any:
    """The module `distributed`. Raises ImportError that says what to install."""
    try:
        import distributed  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError("covary.distributed needs Dask: pip install distributed") from error
    return distributed


def _completed(client: Any, futures: Iterable[Any]) -> Iterator[Any]:
    """Futures as they complete. Warns if none does because there is no worker, which may still come."""
    pending = set(futures)
    while pending:
        completed = dask().as_completed(pending, loop=client.loop, timeout=_PATIENCE)
        while True:
            try:
                future = next(completed)
            except StopIteration:
                break
            except dask().TimeoutError:
                scheduler = client.scheduler_info()
                if not scheduler["workers"]:
                    warnings.warn(f"{len(pending)} parts wait for a worker: none is connected to "
                                  f"{scheduler['address']}", RuntimeWarning, stacklevel=2)
                break
            pending.discard(future)
            yield future


def results(client: Any, run: Callable[..., Any],
            tasks: Iterable[tuple[T, tuple[Any, ...]]]) -> Iterator[tuple[T, Any]]:
    """Tasks with the results of `run(*arguments)` on a worker, as they complete. If one fails or the caller stops
    iterating, the rest are cancelled."""
    futures = {client.submit(run, *arguments, pure=False, retries=_RETRIES): task for task, arguments in tasks}
    try:
        for future in _completed(client, futures):
            yield futures[future], future.result()
            future.release()
    except BaseException:
        client.cancel(list(futures))
        raise


def _versions() -> tuple[str, str]:
    """The versions of covary and distributed."""
    return _covary.version, importlib.metadata.version("distributed")


def check_versions(client: Any) -> None:
    """All must run the same covary and distributed: films of other versions may differ, and so may Dask's messages."""
    here = _versions()
    found = {str(worker): tuple(there) for worker, there in client.run(_versions).items()}
    found["the scheduler"] = (here[0], client.get_versions()["scheduler"]["packages"]["distributed"])
    others = [f"{who} has covary {theirs[0]} and distributed {theirs[1]}" for who, theirs in sorted(found.items())
              if theirs != here]
    if others:
        raise UsageError(f"versions differ: here are covary {here[0]} and distributed {here[1]}; {'; '.join(others)}. "
                         "Install the same everywhere")
