# SPDX-License-Identifier: Apache-2.0
"""The steps behind the button: groups rendered by Cycles, and the program that makes a picture of them. Each step is
started, polled until it has ended, and closed, so that the window stays responsive."""
from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import bpy

from . import program
from ._cycles import GROUPS, INDEPENDENT, PAIR, Group, check, groups_of, kept_in_memory, settings
from .errors import UsageError


class Cancelled(Exception):
    """Cancelled with Esc."""


class Rendering:
    """One group, rendered by Cycles into a file."""

    def __init__(self, scene: Any, group: Group, path: str) -> None:
        self.scene, self.group, self.path = scene, group, path
        self._stack = ExitStack()
        self._ended = self._cancelled = False

    def begin(self, window: bool) -> None:
        """With a window the render continues in the background; without one it has ended on return."""
        self._stack.enter_context(self.group.settings(self.scene, self.path))
        if not window:
            bpy.ops.render.render(write_still=True, scene=self.scene.name)
            self._ended = True
            return
        handlers = bpy.app.handlers
        for event, function in ((handlers.render_complete, self._completed), (handlers.render_cancel, self._stopped)):
            event.append(function)
            self._stack.callback(event.remove, function)
        if bpy.ops.render.render("INVOKE_DEFAULT", write_still=True, scene=self.scene.name) == {"CANCELLED"}:
            raise UsageError("Blender renders already; try again when it is done")

    def _completed(self, *_: Any) -> None:
        self._ended = True

    def _stopped(self, *_: Any) -> None:
        self._ended = self._cancelled = True

    def ended(self) -> bool:
        """With a window. A complete render remains a job for a moment, and Esc in the render window ends the job
        without calling handlers."""
        if bpy.app.is_job_running("RENDER"):
            return False
        self._cancelled = self._cancelled or not self._ended
        return True

    def close(self) -> None:
        """Restores the scene's settings."""
        self._stack.close()

    def check(self) -> None:
        """Raises Cancelled, or UsageError if there is no file."""
        if self._cancelled:
            raise Cancelled
        if not Path(self.path).exists():
            raise UsageError(f"Blender did not write a group to '{self.path}': is the disk full?")


class Combining:
    """The program, run on the groups of a picture."""

    def __init__(self, command: Sequence[str], output: str) -> None:
        self.command, self.output = command, output
        self.messages = ""
        self._process: subprocess.Popen[str] | None = None

    def begin(self, window: bool) -> None:
        self._log = tempfile.TemporaryFile("w+")  # noqa: SIM115  lives as long as the process
        self._process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                         stderr=self._log, env=program.environment())
        if not window:
            self._process.wait()

    def ended(self) -> bool:
        return self._process is not None and self._process.poll() is not None

    def close(self) -> None:
        """Ends the program if it is running."""
        if self._process is None:
            return
        if self._process.poll() is None:
            self._process.terminate()
            self._process.wait()
        self._log.seek(0)
        self.messages = self._log.read()
        self._log.close()

    def check(self) -> None:
        if self._process is None or self._process.returncode:
            raise UsageError(program.reason(self.messages) or "the program covary failed")


def output_of(scene: Any, frame: int) -> Path:
    """The result's file: Blender's name of the frame with the prefix "covary_"."""
    with settings(scene):
        path = Path(bpy.path.abspath(scene.render.frame_path(frame=frame)))
    return path.with_name(f"covary_{path.stem}.exr")


def size_of(scene: Any) -> tuple[int, int]:
    share = scene.render.resolution_percentage / 100
    return int(scene.render.resolution_x * share), int(scene.render.resolution_y * share)


def check_places(scene: Any, output: Path, groups: str) -> None:
    """Raises UsageError if the result or the groups cannot be written."""
    if scene.render.filepath.startswith("//") and not bpy.data.filepath:
        raise UsageError("the output path is relative to the .blend file, which has not been saved: save it, or choose "
                         "another output path (Output properties)")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=output.parent):
            pass
    except OSError as error:
        raise UsageError(f"'{output.parent}' cannot be written: {error.strerror}; choose another output path (Output "
                         "properties)") from error
    width, height = size_of(scene)
    bytes_needed = width * height * 3 * 4 * (2 * GROUPS + 2)  # as if nothing were compressed
    free = shutil.disk_usage(groups).free
    if free < bytes_needed:
        raise UsageError(f"'{groups}' has {free / 2**20:.0f} MiB left, and {width} x {height} pixels in {2 * GROUPS} "
                         f"groups may need {bytes_needed / 2**20:.0f}: free some, or choose another folder for "
                         "temporary files (Edit, Preferences, File Paths)")


def frames_of(scene: Any, animation: bool) -> range:
    if not animation:
        return range(scene.frame_current, scene.frame_current + 1)
    return range(scene.frame_start, scene.frame_end + 1, scene.frame_step)


class Job:
    """The whole job: one picture, or those of an animation."""

    def __init__(self, scene: Any, named: str, animation: bool) -> None:
        """Raises UsageError for whatever would fail later."""
        choice = scene.covary
        #: The default takes all samples independently; what is not denoised, or with little bias, half of them.
        self.kinds = INDEPENDENT if choice.denoise == "auto" else PAIR
        check(scene, choice.samples, kinds=self.kinds)
        self.scene, self.frames = scene, frames_of(scene, animation)
        self.program = program.find(named)
        program.check(self.program)
        self.samples, self.seed, self.denoise = choice.samples, choice.seed, choice.denoise
        check_places(scene, output_of(scene, self.frames[0]), bpy.app.tempdir)
        self.groups = len(self.kinds) * GROUPS
        self.total, self.done = len(self.frames) * (self.groups + 1), 0
        self.output, self.verdict = "", ""
        self.warnings: list[str] = []
        self.started = time.perf_counter()
        self.error: float | None = None
        self._comparing: tuple[subprocess.Popen[str], int] | None = None

    def text(self) -> str:
        """The current step, as text."""
        picture, step = divmod(self.done, self.groups + 1)
        frame = f"frame {self.frames[min(picture, len(self.frames) - 1)]}, " if len(self.frames) > 1 else ""
        text = frame + ("combining" if step == self.groups else f"group {step + 1} of {self.groups}")
        if self.done:
            seconds = time.perf_counter() - self.started
            text += ", " + program.remaining(seconds / self.done * (self.total - self.done))
        self._read_error()
        return text + ("" if self.error is None else f", relMSE about {self.error:.2g}")

    def _compare(self, files: Sequence[str]) -> None:
        """Asks the program for the error of the groups so far, which it tells while the next one is rendered."""
        if len(files) < 2 or self._comparing is not None:
            return
        command = program.comparison(self.program, files[-1], files[-2])
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL, text=True, env=program.environment())
        self._comparing = (process, len(files))

    def _read_error(self, wait: bool = False) -> None:
        if self._comparing is None:
            return
        process, groups = self._comparing
        if not wait and process.poll() is None:
            return
        self.error = program.read_error(process.communicate()[0], groups)
        self._comparing = None

    def steps(self) -> Iterator[Rendering | Combining]:
        """The steps, one after the other. Temporary files are removed when the iterator is closed."""
        for frame in self.frames:
            if len(self.frames) > 1:
                self.scene.frame_set(frame)
            with tempfile.TemporaryDirectory(prefix="covary-", dir=bpy.app.tempdir) as folder:
                yield from self._picture(frame, Path(folder))

    def _picture(self, frame: int, folder: Path) -> Iterator[Rendering | Combining]:
        files: dict[str, list[str]] = {kind: [] for kind in self.kinds}
        # Each frame has seeds of its own: equal noise in all of them would look like dirt on the lens.
        with kept_in_memory(self.scene):
            for group in groups_of(self.samples, GROUPS, self.seed * 10007 + frame % 10007, self.kinds):
                path = str(folder / f"{group.kind}{len(files[group.kind])}.exr")
                files[group.kind].append(path)
                yield Rendering(self.scene, group, path)
                self.done += 1
                self._read_error()
                self._compare(files["independent"])
        self._read_error(wait=True)  # before its files are removed
        statistics, output = str(folder / "statistics.json"), str(output_of(self.scene, frame))
        combining = Combining(program.command(self.program, files, output, self.denoise, statistics), output)
        yield combining
        self.done += 1
        self.output, self.verdict = output, program.verdict(statistics)
        self.warnings = program.warnings(combining.messages)


def show(path: str) -> None:
    """Shows the result in every image editor that shows a render, including the render window."""
    image = bpy.data.images.load(path, check_existing=True)
    image.name = "covary"
    image.reload()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type == "IMAGE_EDITOR" and (space.image is None or space.image.type == "RENDER_RESULT"
                                                or space.image.name.startswith("covary")):
                space.image = image
