# SPDX-License-Identifier: Apache-2.0
"""Which error does a person get for their time? Whole processes in turns, by the clock: `covary render` as it is, and
Mitsuba 3 (llvm_ad_rgb) with Open Image Denoise, which cleans albedo and normal first. Run it on an idle machine.

Errors are relMSE in product form against two references by the same renderer, relative to denoised ones. At equal time:
Mitsuba's error, carried to covary's time along the line through Mitsuba's two nearest times (in logarithms), over
covary's error. Needs NumPy, Mitsuba 3 and Open Image Denoise (COVARY_OIDN); benchmarks/README.md tells how to set them
up."""
import argparse
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "denoising")]

from denoising import geometric_mean, resolution_of, scene_path, turned_cameras, write_rows  # noqa: E402
from layers import read_image  # noqa: E402

REFERENCE_SEEDS = (1001, 1002)


def run(*words):
    """Seconds that the process took."""
    start = time.perf_counter()
    result = subprocess.run([*map(str, words)], capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(map(str, words))}\n{result.stderr}")
    return time.perf_counter() - start


class Scene:
    def __init__(self, options, name):
        self.options, self.name = options, name
        self.folder = options.work / name
        self.folder.mkdir(parents=True, exist_ok=True)
        self.path = scene_path(options.scenes, name)
        self.resolution = resolution_of(self.path, options.width)

    def ours(self, spp, seed):
        output = self.folder / "covary.exr"
        return output, run(self.options.covary, "render", self.path, "--resolution", self.resolution, "--rfilter",
                           "box", "--spp", spp, "--seed", seed, "--quiet", "--overwrite", "-o", output)

    def theirs(self, spp, seed):
        noisy, output = self.folder / "mitsuba.exr", self.folder / "oidn.exr"
        seconds = run(self.options.mitsuba_python, HERE / "mitsuba_picture.py", self.path, self.resolution, spp, seed,
                      noisy)
        return output, seconds + run(self.options.covary, "denoise", noisy, "--mode", "oidn", "--clean-features",
                                     "--quiet", "--overwrite", "-o", output)

    def references(self):
        """Of each renderer two, and the weights of squared errors. Each is compared with its own: their pictures differ
        where sheets are thinner than Mitsuba's offset of rays, which passes through the second side."""
        images, weight = {"covary": [], "mitsuba": []}, 0
        for seed in REFERENCE_SEEDS:
            path = self.folder / f"reference-{seed}.exr"
            if not path.exists():
                run(self.options.covary, "render", self.path, "--resolution", self.resolution, "--rfilter", "box",
                    "--spp", self.options.reference_spp, "--seed", seed, "--estimator", "none", "--denoise", "none",
                    "--quiet", "--no-preview", "-o", path)
            denoised = path.with_stem(path.stem + "-denoised")
            if not denoised.exists():
                run(self.options.covary, "denoise", path, "--mode", "oidn", "--quiet", "-o", denoised)
            by_mitsuba = path.with_suffix(".npy")
            if not by_mitsuba.exists():
                run(self.options.mitsuba_python, HERE / "mitsuba_picture.py", self.path, self.resolution, 16, seed,
                    by_mitsuba, self.options.reference_spp // 16)
            images["covary"].append(read_image(path))
            images["mitsuba"].append(numpy.load(by_mitsuba))
            weight = weight + 1 / (read_image(denoised).mean(2, keepdims=True)**2 + 0.01) / len(REFERENCE_SEEDS)
        return images, weight

    def rows(self):
        """A row for each number of samples: seconds and errors of both, means over the seeds, in turns."""
        references, weight = self.references()
        for spp in self.options.spp:
            row = {"scene": self.name, "resolution": self.resolution, "spp": spp}
            for name in ("covary", "mitsuba"):
                row[name + "_seconds"] = row[name + "_error"] = 0.0
            for seed in self.options.seeds:
                for name, make in (("covary", self.ours), ("mitsuba", self.theirs)):
                    path, seconds = make(spp, seed)
                    image, (first, second) = read_image(path), references[name]
                    error = (weight * (image - first) * (image - second)).mean()
                    row[name + "_seconds"] += seconds / len(self.options.seeds)
                    row[name + "_error"] += error / len(self.options.seeds)
            yield row


def at_equal_time(rows):
    """Mitsuba's error at covary's time over covary's error, for each row of one scene."""
    points = [(math.log(row["mitsuba_seconds"]), math.log(row["mitsuba_error"])) for row in rows]
    for row in rows:
        at = math.log(row["covary_seconds"])
        (x0, y0), (x1, y1) = sorted(sorted(points, key=lambda p: abs(p[0] - at))[:2])
        yield math.exp(y0 + (at - x0) * (y1 - y0) / (x1 - x0)) / row["covary_error"]


def table(rows):
    lines = ["| scene | samples | covary: s, 1000 relMSE | Mitsuba + OIDN: s, 1000 relMSE | at equal time |",
             "|---" * 5 + "|"]
    for row in rows:
        both = [f"{row[name + '_seconds']:.1f}, {1000 * row[name + '_error']:.3g}" for name in ("covary", "mitsuba")]
        lines.append(f"| {row['scene']} | {row['spp']} | {' | '.join(both)} | {row['equal_time']:.2f} |")
    for spp in sorted({row["spp"] for row in rows}):
        ratios = [row["equal_time"] for row in rows if row["spp"] == spp]
        lines.append(f"| geometric mean (worst) | {spp} | | | {geometric_mean(ratios):.2f} ({min(ratios):.2f}) |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="scenes; default: those of denoising/turned_cameras.csv")
    parser.add_argument("--scenes", type=Path, required=True, help="folder with a folder for each scene")
    parser.add_argument("--work", type=Path, required=True, help="folder for references, pictures and equal_time.csv")
    parser.add_argument("--covary", default=os.fspath(HERE.parent.parent / "build/release/covary"))
    parser.add_argument("--mitsuba-python", default=os.fspath(HERE.parent / "against_mitsuba/.venv/bin/python"))
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256], help="at least two numbers")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--reference-spp", type=int, default=256, help="of each of two references")
    parser.add_argument("--width", type=int, default=1280, help="pixels of the longer side")
    options = parser.parse_args()
    if len(options.spp) < 2:
        parser.error("--spp: expected at least two numbers, between which errors are interpolated")
    rows = []
    for name in options.names or list(turned_cameras()):
        of_scene = list(Scene(options, name).rows())
        for row, ratio in zip(of_scene, at_equal_time(of_scene)):
            row["equal_time"] = ratio
            print(json.dumps(row), flush=True)
        rows += of_scene
        write_rows(options.work / "equal_time.csv", rows)
    print("\n" + table(rows))


if __name__ == "__main__":
    main()
