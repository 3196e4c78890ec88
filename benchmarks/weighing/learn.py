#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the weights of src/weighing/data: scenes of its own, their renders, and a network trained on them.

    python learn.py --work FOLDER [--scenes 83]

Needs NumPy, OpenEXR, JAX and Optax; `covary` of COVARY or the path. Films stay in FOLDER, so that an interrupted run
goes on."""
import argparse
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import scenes_to_learn

RESOLUTION, FILMS, REFERENCE = "128x72", {4: 4, 16: 8, 64: 8}, 256  # samples: groups
SECONDS = 6  # of a film of 16 samples; slower scenes are left out


def run(*arguments, **options):
    subprocess.run([os.environ.get("COVARY", "covary"), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL,
                   **options)


def render(scene, path, samples, groups, seed, *more, **options):
    if not path.exists():
        part = path.with_name("part.exr")
        run("render", scene, "--resolution", RESOLUTION, "--estimator", "none", "--denoise", "none", "--rfilter", "box",
            "--threads", 1, "--quiet", "--no-preview", "--overwrite", "--spp", samples, "--groups", groups,
            "--seed", seed, "-o", part, *more, **options)
        part.rename(path)


def make_candidates(film, features, stages):
    if not stages.with_suffix(".exr").exists():
        run("combine", "--independent", film, "--features", features, "--denoise", "auto", "--threads", 1, "--quiet",
            "--overwrite", "--oidn", "off", "--save-stages", stages, "-o", stages.with_suffix(".exr"))


def make_data(work, number):
    """Films of two seeds and their candidates, and a reference."""
    folder, scene = work / f"s{number}", work / "scenes" / f"s{number}.xml"
    folder.mkdir(exist_ok=True)
    try:
        render(scene, folder / "f16-1.exr", 16, 8, 1, "--aovs", timeout=SECONDS)
    except subprocess.TimeoutExpired:
        print(scene, "takes too long and is left out")
        return None
    for samples, groups in FILMS.items():
        for seed in (1, 2):
            film = folder / f"f{samples}-{seed}.exr"
            render(scene, film, samples, groups, samples + seed)
            make_candidates(film, folder / "f16-1.exr", folder / f"stages{samples}-{seed}")
    render(scene, folder / "reference.exr", REFERENCE, 2, 1001)
    return folder


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--scenes", type=int, default=83)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    scenes_to_learn.write_scenes(arguments.work / "scenes", arguments.scenes)
    with ThreadPoolExecutor(arguments.processes) as pool:
        made = pool.map(lambda n: make_data(arguments.work, n), range(arguments.scenes))
        folders = [folder for folder in made if folder]
    import train
    result = arguments.work / "of_filters.f16"
    train.train(folders, list(FILMS), result)
    print(result)


if __name__ == "__main__":
    main()
