# SPDX-License-Identifier: Apache-2.0
"""Renders of scenes with few samples and with many, the images that covary makes of them, and their true errors."""
import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy
from variants import size_of, write_variant

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from layers import read_image  # noqa: E402

SCENES = HERE.parent.parent / "scenes"
#: Samples, seed, and groups: as a render has them, and few, as two or four renders of any renderer are
RENDERS = [(16, 1, 8), (48, 2, 12), (144, 3, 12), (16, 4, 2), (48, 5, 2), (144, 6, 2), (48, 7, 4)]
#: Groups from which on there are intervals of every kind; with fewer, of denoised means alone, fitted by themselves
FEWEST_GROUPS = 8
#: Of these there is an image with common random numbers, of as many samples
MOST_OF_PAIRS = 48
REFERENCE_SPP, REFERENCE_SEEDS = 128, (1001, 1002)
#: What images are made by, in the order of ErrorKind in src/estimators/estimator_result.h, and the options of it.
KINDS = {"mean": [],
         "pair": ["--estimator", "iicv", "--error"],
         "filters": ["--denoise", "auto", "--oidn", "off"],
         "network": ["--denoise", "auto"],
         "pair-filters": ["--estimator", "iicv", "--error", "--denoise", "auto", "--oidn", "off"],
         "pair-network": ["--estimator", "iicv", "--error", "--denoise", "auto"],
         "pair-halves": ["--estimator", "iicv", "--error", "--device", "opencl"],
         "few-filters": ["--denoise", "auto", "--oidn", "off"],
         "few-network": ["--denoise", "auto"]}


def run(arguments, *words):
    command = ["nice", "-n", str(arguments.nice), arguments.program, *map(str, words)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}\n{result.stderr}")


def render(arguments, scene, size, spp, seed, film, *more):
    run(arguments, "render", *scene, "--resolution", size, "--rfilter", "box", "--estimator", "none", "--denoise",
        "none", "--spp", spp, "--seed", seed, *more, "--quiet", "-o", film)


def render_all(arguments):
    """Renders the missing films of every variant."""
    folder = arguments.work
    for name in arguments.variants:
        scene = write_variant(name, SCENES, folder)
        films = [(f"{name}-{spp}-{seed}", spp, seed, ["--groups", groups, "--aovs"]) for spp, seed, groups in RENDERS]
        films += [(f"{name}-{spp}-{seed}-crn", spp, seed, ["--groups", groups, "--sampling", "crn"])
                  for spp, seed, groups in RENDERS if spp <= MOST_OF_PAIRS and groups >= FEWEST_GROUPS]
        films += [(f"{name}-ref-{seed}", REFERENCE_SPP, seed, []) for seed in REFERENCE_SEEDS]
        for stem, spp, seed, more in films:
            if not (folder / f"{stem}.done").exists():
                render(arguments, scene, size_of(name), spp, seed, folder / f"{stem}.exr", "--overwrite", *more)
                (folder / f"{stem}.done").touch()


def denoised_reference(arguments, name):
    """The image that errors are relative to. Relative to the references themselves, errors would count most where these
    are dark by chance and their errors agree: that turned a relMSE of .0075 into .028 (Door, twice 512 samples)."""
    image = arguments.work / f"{name}-guide.exr"
    references = [arguments.work / f"{name}-ref-{seed}.exr" for seed in REFERENCE_SEEDS]
    if not image.exists():
        run(arguments, "denoise", *references, "-o", image, "--quiet", "--force")
    return read_image(image)


def products(image, first, second, guide):
    """Squared error of each pixel in product form, whose mean is the relMSE."""
    weight = 1 / (guide.mean(2, keepdims=True)**2 + 0.01)
    return (weight * (image - first) * (image - second)).mean(2)


def image_of(arguments, name, spp, seed, kind):
    """The image made of films, and the program's report on it."""
    image, facts = arguments.work / "image.exr", arguments.work / "facts.json"
    film = arguments.work / f"{name}-{spp}-{seed}.exr"
    if kind == "mean":  # the film is complete, so that nothing is rendered
        groups = next(groups for n, s, groups in RENDERS if (n, s) == (spp, seed))
        render(arguments, write_variant(name, SCENES, arguments.work), size_of(name), spp, seed, film, "--groups",
               groups, "--aovs", "--resume", "--json", facts)
        return read_image(film), json.loads(facts.read_text())
    films = ["--independent", film, "--features", film]
    if kind.startswith("pair"):
        films += ["--crn", arguments.work / f"{name}-{spp}-{seed}-crn.exr"]
        if kind in ("pair", "pair-halves"):
            films = films[:2] + films[4:]
    image.unlink(missing_ok=True)
    # Of dark rooms many pixels are 0 in all groups, which looks like one render twice.
    run(arguments, "combine", *films, *KINDS[kind], "-o", image, "--json", facts, "--quiet", "--force")
    return read_image(image), json.loads(facts.read_text())


def measure_all(arguments):
    """A row for each image: kind, true error, and the program's sums; written after each scene."""
    rows = []
    for name in arguments.variants:
        references = [read_image(arguments.work / f"{name}-ref-{seed}.exr") for seed in REFERENCE_SEEDS]
        guide = denoised_reference(arguments, name)
        noise = products(guide, *references, guide).std() / math.sqrt(guide[:, :, 0].size)
        for spp, seed, groups in RENDERS:
            for kind in KINDS:
                if kind.startswith("few") != (groups < FEWEST_GROUPS):
                    continue
                if kind.startswith("pair") and spp > MOST_OF_PAIRS:
                    continue
                image, facts = image_of(arguments, name, spp, seed, kind)
                if not facts.get("error_sums"):
                    continue
                truth = products(image, *references, guide).mean()
                rows.append({"scene": name, "kind": kind, "spp": spp, "seed": seed, "relmse": truth,
                             "reference_noise": noise, **facts["error_sums"]})
        write(rows, arguments.data)
        print(name, flush=True)


def write(rows, path):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()}
                         for row in rows)
