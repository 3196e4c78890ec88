# SPDX-License-Identifier: Apache-2.0
"""Renders the render tests of Mitsuba's data repository with covary and compares them with the stored images.

    mitsuba_suite.py FOLDER [NAME...]      exit code 1 where a test that loads does not pass

FOLDER is a copy of github.com/mitsuba-renderer/mitsuba-data, no part of which is in this repository; NAME is part of a
test's name. The test of each scene is that of Mitsuba's own test_renders.py: the size of the reference image, a budget
of samples divided by the pixels, and a Z-test of every value in XYZ with the stored variance of a sample (at least
1e-4) at a significance of 0.01 for the image, divided among its pixels by Sidak's correction; 99.75 % of the values
must be accepted. A test that fails and has a checkerboard in place of a number is rendered again with color0 and color1
exchanged, as Mitsuba has them there; the table says so. Python needs numpy and Mitsuba, which reads the images.
"""
import argparse
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import mitsuba
import numpy
from linked_tree import link_tree

SIGNIFICANCE = 0.01  # of an image
ACCEPTED_SHARE = 0.9975  # of its values
LEAST_VARIANCE = 1e-4
# Linear Rec. 709 to XYZ, as Mitsuba's bitmaps are converted.
TO_XYZ = numpy.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])


def rgb(path):
    return numpy.array(mitsuba.Bitmap(str(path)), dtype=numpy.float64)[..., :3]


def find_tests(folder, names):
    """(name, scene, reference, variance) of each test with images of the rgb variants."""
    for scene in sorted(pathlib.Path(folder, "tests", "scenes").glob("*/*.xml")):
        base = scene.stem.rsplit("_", 1)[0]
        reference = scene.parent / "refs" / f"{base}_ref_rgb.exr"
        variance = scene.parent / "refs" / f"{base}_ref_rgb_var.exr"
        if reference.exists() and variance.exists() and (not names or any(name in scene.stem for name in names)):
            yield scene.stem, scene, reference, variance


def normal_tails(z):
    """P(|Z| > z) of the standard normal distribution."""
    return numpy.vectorize(math.erfc)(z / math.sqrt(2))


def share_accepted(image, spp, reference, variance):
    """The fraction of values that the Z-test accepts."""
    variance = numpy.maximum(variance @ TO_XYZ.T, LEAST_VARIANCE)
    z = numpy.abs((image - reference) @ TO_XYZ.T) * numpy.sqrt(spp / variance)
    pixels = reference.shape[0] * reference.shape[1]
    alpha = 1 - (1 - SIGNIFICANCE) ** (1 / pixels)
    return numpy.mean(normal_tails(z) > alpha)


def render(options, scene, spp, out):
    """covary's message if it fails, otherwise an empty string."""
    command = [options.covary, "render", str(scene), "--estimator", "none", "--groups", "1", "--spp", str(spp),
               "--seed", str(options.seed), "--no-preview", "--overwrite", "-o", str(out)]
    integrator = scene.stem.rsplit("_", 1)[1]
    if "$integrator" in scene.read_text():
        command += ["-D", f"integrator={integrator}"]
    result = subprocess.run(command, capture_output=True, text=True)
    return "" if result.returncode == 0 else result.stderr.strip() or "no message"


def exchanged(text):
    """`text` of a scene with color0 and color1 of checkerboards exchanged where they are numbers."""
    names = {"color0": "color1", "color1": "color0"}
    return re.sub(r'(<float name=")(color[01])(")', lambda match: match[1] + names[match[2]] + match[3], text)


def copy_with_colours_exchanged(folder, scene, copy):
    """The path of the scene in `copy`, a copy of `folder`."""
    link_tree(folder, copy)
    result = copy / scene.relative_to(folder)
    result.unlink()
    result.write_text(exchanged(scene.read_text()))
    return result


def run_as_mitsuba_has_it(options, scene, reference, variance):
    """A row of the table; if the scene does not pass, that of the scene with exchanged colours."""
    row = run_test(options, scene, reference, variance)
    if row[0] != "differs" or exchanged(scene.read_text()) == scene.read_text():
        return row
    with tempfile.TemporaryDirectory() as folder:
        copy = copy_with_colours_exchanged(pathlib.Path(options.folder), scene, pathlib.Path(folder))
        other = run_test(options, copy, reference, variance)
    if other[0] != "passes":
        return row
    return other[:-1] + (f"color0 and color1 exchanged; {100 * row[1]:.2f} % as it is",)


def run_test(options, scene, reference_path, variance_path):
    """A row of the table: verdict, fraction accepted, ratio of means, samples per pixel, seconds, message."""
    reference, variance = rgb(reference_path), rgb(variance_path)
    spp = max(1, int(options.samples) // (reference.shape[0] * reference.shape[1]))
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "image.exr"
        message = render(options, scene, spp, out)
        seconds = time.perf_counter() - start
        if message:
            return "does not load", None, None, spp, seconds, message.splitlines()[0].replace(str(scene.parent), "")
        image = rgb(out)
    if image.shape != reference.shape:
        return "differs", None, None, spp, seconds, f"{image.shape} instead of {reference.shape} values"
    share = share_accepted(image, spp, reference, variance)
    verdict = "passes" if share >= ACCEPTED_SHARE else "differs"
    return verdict, share, image.mean() / reference.mean(), spp, seconds, ""


def row_text(name, row):
    verdict, share, ratio, spp, seconds, message = row
    numbers = ["" if share is None else f"{100 * share:.2f} %", "" if ratio is None else f"{ratio:.4f}"]
    return f"| {name} | {verdict} | {numbers[0]} | {numbers[1]} | {spp} | {seconds:.1f} | {message} |"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--covary", default="build/release/covary", metavar="PROGRAM")
    parser.add_argument("--samples", type=float, default=2e6, help="of an image, all pixels together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="mitsuba_suite.md", metavar="FILE", help="where the table goes")
    options = parser.parse_args(arguments)
    mitsuba.set_variant("scalar_rgb")
    rows = {}
    lines = ["| test | verdict | values accepted | mean / reference | samples | s | message |",
             "|---|---|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    for name, scene, reference, variance in find_tests(options.folder, options.names):
        rows[name] = run_as_mitsuba_has_it(options, scene, reference, variance)
        lines.append(row_text(name, rows[name]))
        print(lines[-1], flush=True)
        pathlib.Path(options.out).write_text("\n".join(lines) + "\n")
    counts = {verdict: sum(row[0] == verdict for row in rows.values())
              for verdict in ("passes", "differs", "does not load")}
    print(f"{len(rows)} tests: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    return 1 if counts["differs"] or not rows else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
