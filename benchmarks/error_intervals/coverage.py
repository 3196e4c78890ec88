# SPDX-License-Identifier: Apache-2.0
"""Do intervals of the relMSE hold on scenes that they were not fitted to? Prints predicted over true relMSE by scene,
how many intervals are given, and how many of them contain the truth: for films of path tracing and images made of them.

    coverage.py kitchen house --scenes FOLDER [--spp 16 64 256] [--seeds 1 2 3] [--work FOLDER]

Errors are in product form over two references and relative to the denoised references (docs/notes/error-estimates.md
explains why). Films, references and the program's report on each image stay in --work (SCENE/KIND-SPP-SEED.json), so
that a second run only makes what is missing. Needs NumPy, and Open Image Denoise where COVARY_OIDN or the environment
has it."""
import argparse
import itertools
import json
import math
import os
from pathlib import Path

import numpy
from maps_and_stops import HERE, OWN, Measured, read_image

#: What images are made by; "mean" is the film itself, "iicv" a render of its own
KINDS = {"mean": ["--estimator", "none", "--denoise", "none", "--aovs", "--groups", 8],
         "iicv": ["--estimator", "iicv"],
         "balanced": ["--denoise", "balanced"],
         "filters": ["--denoise", "auto", "--oidn", "off"],
         "network": ["--denoise", "auto"]}
#: Standard error of the truth, over it, from which on an image does not count
UNKNOWN = 0.25


def measured(scene, kind, spp, seed):
    """The program's report on an image, with its true relMSE and the standard error of that."""
    facts = scene.folder / f"{kind}-{spp}-{seed}.json"
    if facts.exists():
        return json.loads(facts.read_text())
    told, image = facts.with_suffix(".told"), scene.folder / f"{kind}-{spp}-{seed}.exr"
    film = scene.folder / f"film-{spp}-{seed}.exr"
    if kind in ("mean", "iicv"):
        if kind == "mean":
            image = film
        scene.run("render", scene.path, "--resolution", scene.resolution, "--spp", spp, "--seed", seed, *KINDS[kind],
                  "--no-preview", "--quiet", *(["--resume"] if image.exists() else []), "-o", image, "--json", told)
    else:
        film = scene.render("film", spp, seed, *KINDS["mean"])
        scene.run("combine", "--independent", film, "--features", film, *KINDS[kind], "-o", image, "--json", told,
                  "--quiet", "--force")
    errors = scene.error_map(read_image(image))
    noise = (scene.weight * (scene.truth[0] - scene.truth[1])**2).mean(2) / 4
    row = json.loads(told.read_text())
    row = {key: row[key] for key in row if key.startswith("predicted_relmse") or key == "error_sums"}
    row |= {"relmse": errors.mean(), "relmse_error": math.hypot(errors.std(), noise.std()) / math.sqrt(errors.size)}
    facts.write_text(json.dumps(row))
    told.unlink()
    return row


def ratio_text(rows):
    """Geometric mean of predicted over true relMSE, and the spread."""
    logs = [math.log(row["predicted_relmse"] / row["relmse"]) for row in rows if row["relmse"] > 0]
    return f"{math.exp(numpy.mean(logs)):.2f} x/ {math.exp(numpy.std(logs)):.2f}" if logs else "-"


def counts_text(rows):
    """Numbers of images, of intervals given, and of those that hold; predicted over true relMSE of all images."""
    given = [row for row in rows if "predicted_relmse_low" in row]
    hold = sum(row["predicted_relmse_low"] <= row["relmse"] <= row["predicted_relmse_high"] for row in given)
    return f"{len(rows)} | {len(given)} | {hold} ({100 * hold / max(len(given), 1):.0f} %) | {ratio_text(rows)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--scenes", type=Path, default=OWN, help="folder with a folder for each scene")
    parser.add_argument("--work", type=Path, default=Path("coverage"), help="keeps films and what was told of images")
    parser.add_argument("--covary", default=os.fspath(HERE.parent.parent / "build/release/covary"))
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=["mean", "balanced", "filters", "network"])
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of two references")
    parser.add_argument("--width", type=int, default=320, help="pixels of the longer side")
    parser.add_argument("--turned", action="store_true", help="cameras turned by ../denoising/turned_cameras.csv")
    options = parser.parse_args()
    rows, cases = {}, list(itertools.product(options.spp, options.kinds))
    print("predicted over true\n| scene | " + " | ".join(f"{kind} {spp}" for spp, kind in cases) + " |\n|---|" +
          "---|" * len(cases))
    for name in options.names:
        scene = Measured(options, name)
        for (spp, kind), seed in itertools.product(cases, options.seeds):
            rows[name, spp, kind, seed] = measured(scene, kind, spp, seed)
        of = [ratio_text([rows[name, spp, kind, seed] for seed in options.seeds]) for spp, kind in cases]
        print(f"| {name} | " + " | ".join(of) + " |", flush=True)
    known = {key: row for key, row in rows.items() if row["relmse_error"] < UNKNOWN * row["relmse"]}
    print(f"\n{len(rows) - len(known)} of {len(rows)} left out, of which the references know less than to "
          f"{UNKNOWN:.0%}\n\n|  | images | given | hold | predicted over true |\n|---|---|---|---|---|")
    for title, choose in [*((f"{kind} {spp}", lambda key, k=kind, s=spp: key[1:3] == (s, k)) for spp, kind in cases),
                          ("all", lambda key: True)]:
        print(f"| {title} | {counts_text([row for key, row in known.items() if choose(key)])} |")
    for key, row in known.items():
        if "predicted_relmse_low" in row and not row["predicted_relmse_low"] <= row["relmse"] <= \
                row["predicted_relmse_high"]:
            print("miss:", *key, f"{row['relmse']:.4g} not in {row['predicted_relmse_low']:.4g} to "
                  f"{row['predicted_relmse_high']:.4g}")


if __name__ == "__main__":
    main()
