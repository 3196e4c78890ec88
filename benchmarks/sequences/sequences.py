# SPDX-License-Identifier: Apache-2.0
"""sequences.py references|measure --work FOLDER [NAME...]

Renders references of every frame of five sequences (scenes.py), six with --kitchen, and compares methods with few
samples. `references` renders what FOLDER does not hold yet, two images of each frame; `measure` renders the methods and
compares them. Single frames are rendered from static scenes; `sequence` is one command for all frames. A frame's seed
is that of --seeds plus 1,000,000 times its number, as in the command for all frames. Errors are multiples of those of
`auto`, the mixture of each frame alone. Needs numpy."""
import argparse
import json
import subprocess
import sys
from pathlib import Path

import accumulation
import numpy
import scenes

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "tests/cli")]

from exr_writer import exr  # noqa: E402
from layers import read_image, read_layers  # noqa: E402

REFERENCE_SEEDS = (1001, 1002)
#: SequenceSettings::seed_offset() of src/sequences: seeds of two frames of one command are that far apart
SEEDS_OF_FRAME = 1_000_000
#: of the row of a method: values of the sequence as multiples of the baseline's, and worst regions
RATIOS = ["relmse", "temporal", "temporal_flip", "still_relmse"]
WORST = ["relmse", "temporal", "relmse_of_frame", "temporal_of_frame"]


def run(options, *words):
    command = ["nice", "-n", str(options.nice), options.covary, *map(str, words)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}\n{result.stderr}")
    return result.stdout


def render(options, scene, spp, seed, out, *more):
    """Renders unless the file is there, so that an interrupted run continues with the first missing one."""
    if not out.exists():
        run(options, "render", scene, "--resolution", options.resolution, "--rfilter", "box", "--spp", spp, "--seed",
            seed, "--no-preview", "--quiet", *more, "-o", out)
    return out


def write_sequence(options, name):
    return scenes.write_sequence(name, options.frames, options.work, options.kitchen)


def seed_of(seed, frame):
    return seed + SEEDS_OF_FRAME * frame


def frame_numbers(options):
    return range(1, options.frames + 1)


def render_references(options):
    for name in options.names:
        write_sequence(options, name)
        for frame in frame_numbers(options):
            for seed in REFERENCE_SEEDS:
                render(options, options.work / scenes.still_name(name, frame), options.reference_spp, seed,
                       reference(options, name, frame, seed), "--estimator", "none", "--denoise", "none")
        print(name, flush=True)


def reference(options, name, frame, seed):
    frame = 1 if name == "still" else frame  # all frames are this one
    return options.work / f"{name}_{frame:04d}-reference-{seed}.exr"


def frames_alone(options, name, spp, seed, folder):
    """Renders images denoised by the network and by the mixture, and accumulates the latter."""
    mixture, positions = [], []
    for frame in frame_numbers(options):
        scene = options.work / scenes.still_name(name, frame)
        raw = render(options, scene, spp, seed_of(seed, frame), folder / f"raw_{frame:04d}.exr", "--estimator", "none",
                     "--denoise", "none", "--aovs")
        denoised = folder / f"oidn_{frame:04d}.exr"
        if options.network and not denoised.exists():
            run(options, "denoise", raw, "--mode", "oidn", "-o", denoised, "--quiet")
        mixed = render(options, scene, spp, seed_of(seed, frame), folder / f"auto_{frame:04d}.exr", "--denoise", "auto")
        mixture.append(read_image(mixed))
        positions += read_layers(raw, "P")
    positions = numpy.stack(positions)
    for frame, image in enumerate(accumulation.accumulated(name, numpy.stack(mixture), positions), 1):
        channels = {c: image[..., i].ravel().tolist() for i, c in enumerate("RGB")}
        (folder / f"accumulation_{frame:04d}.exr").write_bytes(exr(channels, image.shape[1::-1]))
    return positions


def sequence(options, name, spp, seed, folder):
    """Renders all frames with one command; returns their motion vectors."""
    scene, more = write_sequence(options, name)
    last = folder / f"sequence_{options.frames:04d}.exr"
    render_sequence = [options.work / scene, *more, "--frames", f"1-{options.frames}"]
    if not last.exists():
        run(options, "render", *render_sequence, "--resolution", options.resolution, "--rfilter", "box", "--spp", spp,
            "--seed", seed, "--no-preview", "--quiet", *options.options.split(), "-o", folder / "sequence_####.exr")
    return numpy.stack([read_layers(folder / f"sequence_{frame:04d}.exr", "Motion")[0]
                        for frame in frame_numbers(options)])


def render_methods(options, name, spp, seed, folder):
    """Renders all methods; returns their names."""
    folder.mkdir(exist_ok=True)
    positions = frames_alone(options, name, spp, seed, folder)
    methods = ["oidn"] * options.network + ["auto", "accumulation"]
    if options.frames_alone:
        return methods
    agreement = accumulation.motion_agreement(name, positions, sequence(options, name, spp, seed, folder))
    print(f"{name}: motion as known in {agreement:.1%} of the pixels", file=sys.stderr)
    return [*methods, "sequence"]


def compare(options, name, methods, folder):
    """The measures of `covary compare` for each method."""
    number = "0001" if name == "still" else "####"
    pairs = zip(("--reference", "--reference2"), REFERENCE_SEEDS)
    references = [word for option, seed in pairs
                  for word in (option, options.work / f"{name}_{number}-reference-{seed}.exr")]
    lines = run(options, "compare", *(folder / f"{method}_####.exr" for method in methods), *references, "--baseline",
                folder / "auto_####.exr", "--frames", f"1-{options.frames}", "--json").splitlines()
    return {method: json.loads(line) for method, line in zip(methods, lines)}


def measure(options):
    """Prints a table of means over seeds, and keeps the single values."""
    table = []
    titles = RATIOS + [f"worst {column}" for column in WORST]
    print(f"| sequence | spp | method | {' | '.join(titles).replace('_', ' ')} |\n|{'---|' * (3 + len(titles))}",
          flush=True)
    for name in options.names:
        write_sequence(options, name)
        for spp in options.spp:
            results = []
            for seed in options.seeds:
                folder = options.work / f"{name}-{spp}-{seed}"
                results.append(compare(options, name, render_methods(options, name, spp, seed, folder), folder))
            for method in results[0]:
                def mean(value, of=method):
                    return float(numpy.mean([numpy.nan if value(result[of]) is None else value(result[of])
                                             for result in results]))

                row = [mean(lambda r, c=column: r[c]) / mean(lambda r, c=column: r[c], "auto") for column in RATIOS]
                row += [mean(lambda r, c=column: r["worst_region"][c]["ratio"]) for column in WORST]
                print(f"| {name} | {spp} | {method} | {' | '.join(f'{value:.2f}' for value in row)} |", flush=True)
                table += [{"sequence": name, "spp": spp, "method": method, "seed": seed, **result[method]}
                          for seed, result in zip(options.seeds, results)]
    (options.work / "sequences.json").write_text(json.dumps(table, indent=1) + "\n")


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", choices=["references", "measure"])
    parser.add_argument("names", nargs="*", metavar="NAME",
                        help=f"of {', '.join(scenes.NAMES)}, kitchen; all when absent")
    parser.add_argument("--work", required=True, type=Path, metavar="FOLDER", help="scenes, renders and sequences.json")
    parser.add_argument("--covary", default=str(ROOT / "build/release/covary"), metavar="PROGRAM")
    parser.add_argument("--kitchen", type=Path, metavar="SCENE", help="file of the scene of the sequence kitchen")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--resolution", default="320x180", metavar="WxH")
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of the two")
    parser.add_argument("--no-network", dest="network", action="store_false", help="without Open Image Denoise alone")
    parser.add_argument("--frames-alone", action="store_true", help="only the methods that know no other frames")
    parser.add_argument("--options", default="--history on", help="of the command for all frames")
    parser.add_argument("--nice", type=int, default=0)
    options = parser.parse_args(arguments)
    names = scenes.NAMES + ["kitchen"] * (options.kitchen is not None)
    options.names = options.names or names
    unknown = [name for name in options.names if name not in names]
    if unknown:
        parser.error(f"no sequence is called {unknown[0]}; there are {', '.join(names)}")
    if options.frames < 2:
        parser.error(f"--frames must be 2 or more; found {options.frames}")
    if len(set(options.seeds)) < len(options.seeds) or not all(0 <= seed < SEEDS_OF_FRAME for seed in options.seeds):
        parser.error(f"--seeds must differ and be below {SEEDS_OF_FRAME}, so that no two frames share random numbers")
    options.work.mkdir(parents=True, exist_ok=True)
    (render_references if options.task == "references" else measure)(options)


if __name__ == "__main__":
    main(sys.argv[1:])
