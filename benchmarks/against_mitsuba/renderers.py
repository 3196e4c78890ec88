# SPDX-License-Identifier: Apache-2.0
"""Runs either renderer as a child process: stacks of renders with different seeds, and timed renders."""
import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy

import scene_files

HERE = pathlib.Path(__file__).resolve().parent


class RenderError(Exception):
    """A renderer failed; the message has its command and the end of its output."""


def run(command, environment=None):
    """Runs `command`; returns (wall seconds, the child's peak memory in bytes)."""
    with tempfile.TemporaryFile() as output:
        start = time.perf_counter()
        child = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            output.seek(0)
            tail = output.read().decode(errors="replace")[-2000:]
            raise RenderError(f"exit code {child.returncode} of: {' '.join(map(str, command))}\n{tail}")
    return wall, usage.ru_maxrss * 1024


def _depth(settings):
    return "own" if settings.max_depth is None else str(settings.max_depth)


def _mitsuba(what, variant, scene, settings, threads, out, *rest, environment=None):
    command = [sys.executable, str(HERE / "mitsuba_worker.py"), what, variant, str(scene),
               f"{settings.width}x{settings.height}", str(settings.spp), _depth(settings), str(threads), str(out)]
    return run(command + [str(r) for r in rest], environment)


def mitsuba_stack(name, scene, settings, seeds, cache, variant="llvm_ad_rgb", threads=0):
    """(R, h, w, 3) renders for `seeds`, each cached in the folder `cache`."""
    mark = scene_files.fingerprint(scene_files.mitsuba_text(scene, settings))
    folder = pathlib.Path(cache) / name / f"{settings.width}x{settings.height}_{settings.spp}spp_{mark}"
    missing = [s for s in seeds if not (folder / f"seed{s:03}.npy").is_file()]
    if missing:
        _mitsuba("seeds", variant, scene, settings, threads, folder, *missing)
    return numpy.stack([numpy.load(folder / f"seed{s:03}.npy") for s in seeds])


@dataclasses.dataclass(frozen=True)
class Covary:
    """The program under test, and the options that every call gets."""

    program: str
    options: tuple = ()

    def render(self, scene, settings, seed, out, threads=0):
        """Renders to `out`; returns (statistics of --json, wall seconds, peak bytes)."""
        statistics = pathlib.Path(out).with_suffix(".json")
        command = [self.program, "render", str(scene), "-o", str(out), "--spp", str(settings.spp), "--seed", str(seed),
                   "--resolution", f"{settings.width}x{settings.height}", "--rfilter", "box",
                   "--sampling", "independent", "--json", str(statistics), "--quiet", "--no-preview", "--overwrite",
                   *self.options]
        if settings.max_depth is not None:
            command += ["--max-depth", str(settings.max_depth)]
        if threads > 0:
            command += ["--threads", str(threads)]
        wall, peak = run(command)
        return json.loads(statistics.read_text()), wall, peak

    def stack(self, scene, settings, seeds, threads=0):
        """(R, h, w, 3) renders for `seeds`."""
        images = []
        with tempfile.TemporaryDirectory() as folder:
            for seed in seeds:
                out = pathlib.Path(folder) / f"seed{seed}.exr"
                self.render(scene, settings, seed, out, threads)
                images.append(read_exr(out))
        return numpy.stack(images)

    def version(self):
        return subprocess.run([self.program, "--version"], capture_output=True, text=True, check=True).stdout.strip()


def read_exr(path):
    """The channels R, G, B of a film as (h, w, 3)."""
    return read_channels(path, ("R", "G", "B"))


def read_channels(path, names):
    """Named channels of an EXR file as (h, w, len(names)), float32."""
    import mitsuba

    if mitsuba.variant() is None:
        mitsuba.set_variant("scalar_rgb")
    bitmap = mitsuba.Bitmap(str(path))
    fields = [field.name for field in bitmap.struct_()]
    missing = [name for name in names if name not in fields]
    if missing:
        raise RenderError(f"{path} has no channel {', '.join(missing)}; it has {', '.join(fields)}")
    pixels = numpy.array(bitmap, copy=True).reshape(bitmap.height(), bitmap.width(), -1)
    return pixels[..., [fields.index(name) for name in names]].astype(numpy.float32)


def mitsuba_times(variant, scene, settings, threads, renders, empty_kernel_cache):
    """{'load', 'render': [first, second, ...], 'wall', 'peak_bytes'} of one process, seconds.

    `empty_kernel_cache`: in a new home directory, so that Dr.Jit finds no cached kernels on disk."""
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ)
        if empty_kernel_cache:
            environment["HOME"] = folder
        out = pathlib.Path(folder) / "times.json"
        wall, _ = _mitsuba("times", variant, scene, settings, threads, out, renders, environment=environment)
        return {**json.loads(out.read_text()), "wall": wall}
