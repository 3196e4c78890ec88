# SPDX-License-Identifier: Apache-2.0
"""Prints how strongly common random numbers correlate neighbouring pixels, and that independent samples do not.

    crn_correlation.py --scenes DIR [NAME...]

Renders a 240 x 160 crop of each scene's own frame with 12 groups of 8 samples, with `--sampling crn` and `--sampling
independent`, and prints the average correlation over groups of horizontally neighbouring pixels (see correlation.py) as
mean and standard deviation over seeds: all pixels share one set of common random numbers, so one seed says little. Runs
in the Python environment of ../against_mitsuba/setup (Mitsuba reads the EXR files).
"""
import argparse
import json
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "against_mitsuba"))

import renderers  # noqa: E402
import scene_files  # noqa: E402
from correlation import neighbour_correlation  # noqa: E402

GROUPS, SAMPLES_PER_GROUP, WIDTH, HEIGHT = 12, 8, 240, 160
# Upper left corner of the crop in the scene's own frame: indirect light, edges and textures in each.
CROPS = {"staircase": (240, 560), "kitchen": (520, 280), "veach-ajar": (520, 280), "bathroom2": (520, 280)}


def measure(program, scene, corner, sampling, seed, folder):
    width, height = scene_files.frame_size(scene)
    out = pathlib.Path(folder) / f"{sampling}.exr"
    renderers.run([program, "render", str(scene), "-o", str(out), "--sampling", sampling, "--groups", str(GROUPS),
                   "--spp", str(GROUPS * SAMPLES_PER_GROUP), "--seed", str(seed), "--rfilter", "box", "--quiet",
                   "--overwrite",
                   "--resolution", f"{width}x{height}", "--crop", f"{corner[0]},{corner[1]},{WIDTH},{HEIGHT}"])
    names = [f"group{group:02}.{channel}" for group in range(GROUPS) for channel in "RGB"]
    pixels = renderers.read_channels(out, names)
    grey = pixels.reshape(HEIGHT, WIDTH, GROUPS, 3).mean(axis=3)
    return neighbour_correlation(grey.transpose(2, 0, 1))


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"among {', '.join(CROPS)}; all when absent")
    parser.add_argument("--scenes", required=True, metavar="DIR", help="folder with one sub-folder per scene")
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--seeds", type=int, default=5, help="renders of each kind, at least 2")
    parser.add_argument("--json", metavar="FILE", help="also write the figures there")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in CROPS]
    if unknown:
        parser.error(f"no crop for {', '.join(unknown)}; there is one for {', '.join(CROPS)}")
    scenes = scene_files.find(options.scenes, options.names or list(CROPS))
    print(f"{WIDTH} x {HEIGHT} pixels, {GROUPS} groups of {SAMPLES_PER_GROUP} samples\n")
    print(f"{options.seeds} seeds: mean (standard deviation)\n")
    print("| scene | crop at | CRN | independent | ± if independent |\n|---|---|---|---|---|")
    figures = {}
    for name, scene in scenes.items():
        values = {"crn": [], "independent": []}
        with tempfile.TemporaryDirectory() as folder:
            for seed in range(options.seeds):
                for sampling, found in values.items():
                    result = measure(options.covary, scene, CROPS[name], sampling, seed, folder)
                    found.append(result.mean)
        null_error = result.null_error / options.seeds ** 0.5
        texts = {sampling: f"{statistics.mean(found):+.4f} ({statistics.stdev(found):.4f})"
                 for sampling, found in values.items()}
        x, y = CROPS[name]
        print(f"| {name} | {x},{y} | {texts['crn']} | {texts['independent']} | {null_error:.4f} |", flush=True)
        figures[name] = {"crop": [x, y, WIDTH, HEIGHT], **values, "null_error": null_error}
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except (scene_files.SceneError, renderers.RenderError, FileNotFoundError) as error:
        sys.exit(f"crn_correlation: {error}")
