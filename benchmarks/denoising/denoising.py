# SPDX-License-Identifier: Apache-2.0
"""Error, FLIP and bias of path tracing, IICV, Open Image Denoise and covary's mixtures, over scenes, samples and seeds.

benchmarks/README.md tells what the columns are. Films and references stay in --work, so that a second run only makes
what is missing there. Needs NumPy, and Open Image Denoise where COVARY_OIDN or the environment has it.
"""
import argparse
import csv
import itertools
import json
import math
import os
import subprocess
import sys
import xml.etree.ElementTree
from pathlib import Path

import numpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from layers import read_image  # noqa: E402

REFERENCE_SEEDS = (1001, 1002)
#: In the order of columns; "oidn" is what the others are compared with.
METHODS = ("path tracing", "iicv", "oidn", "oidn first surface", "auto", "own filters")


def turned_cameras():
    """Degrees by scene: chosen before anything was measured with them."""
    with open(HERE / "turned_cameras.csv", newline="") as file:
        return {row["scene"]: float(row["degrees"]) for row in csv.DictReader(file)}


def turned_scene(path, degrees, folder):
    """A copy of a scene whose first camera is turned about its own vertical axis, beside links to its files."""
    folder.mkdir(parents=True, exist_ok=True)
    for part in path.parent.iterdir():
        link = folder / part.name
        if part != path and not link.is_symlink():
            link.symlink_to(part.resolve())
    tree = xml.etree.ElementTree.parse(path)
    place = tree.find("./sensor/transform")
    if place is None:
        raise SystemExit(f"{path}: its camera has no <transform> to turn")
    place.insert(0, xml.etree.ElementTree.Element("rotate", {"y": "1", "angle": f"{degrees:g}"}))
    tree.write(folder / path.name)
    return folder / path.name


def resolution_of(path, width):
    """WIDTHxHEIGHT as wide, or as high, as `width`, in the proportion of the scene's film."""
    film = xml.etree.ElementTree.parse(path).find("./sensor/film")
    defaults = {d.get("name"): d.get("value") for d in xml.etree.ElementTree.parse(path).findall("./default")}
    size = {part.get("name"): part.get("value") for part in film.findall("./integer")}
    size = {name: float(defaults.get(value[1:], value) if value.startswith("$") else value)
            for name, value in size.items()}
    scale = width / max(size["width"], size["height"])
    return f"{round(size['width'] * scale)}x{round(size['height'] * scale)}"


def scene_path(folder, name):
    """The file of a scene in a folder with a folder for each."""
    path = folder / name / "scene_v3.xml"
    return path if path.exists() else path.with_name("scene.xml")


def write_rows(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


class Scene:
    """A scene with its films, references and images."""

    def __init__(self, options, name):
        self.options, self.name = options, name
        self.path = scene_path(options.scenes, name)
        self.folder = options.work / (name + "-turned" if options.turned else name)
        self.folder.mkdir(parents=True, exist_ok=True)
        if options.turned:
            self.path = turned_scene(self.path, turned_cameras()[name], self.folder / "scene")
        self.resolution = resolution_of(self.path, options.width)

    def run(self, *words):
        result = subprocess.run([self.options.covary, *map(str, words)], capture_output=True, text=True)
        if result.returncode:
            raise SystemExit(f"{' '.join(map(str, words))}\n{result.stderr}")
        return result.stdout

    def render(self, name, spp, seed, *more):
        """The path of an image or film, which is rendered where it is missing."""
        output = self.folder / f"{name}-{spp}-{seed}.exr"
        if not output.exists():
            self.run("render", self.path, "--resolution", self.resolution, "--spp", spp, "--seed", seed, *more,
                     "--no-preview", "--quiet", "-o", output)
        return output

    def references(self):
        spp = self.options.reference_spp
        return [self.render("reference", spp, seed, "--estimator", "none", "--denoise", "none")
                for seed in REFERENCE_SEEDS]

    def denoised_references(self):
        for reference in self.references():
            output = reference.with_stem(reference.stem + "-denoised")
            if not output.exists():
                self.run("denoise", reference, "--mode", "oidn", "--quiet", "-o", output)
            yield read_image(output)

    def image(self, method, spp, seed):
        """The path of the image that a method makes of so many samples."""
        if method == "iicv":
            return self.render("iicv", spp, seed, "--estimator", "iicv")
        film = self.render("film", spp, seed, "--estimator", "none", "--denoise", "none", "--aovs", "--groups",
                           min(8, spp))
        if method == "path tracing":
            return film
        features = self.render("features", 2, 1, "--estimator", "none", "--denoise", "none", "--aovs")  # of any seed
        output = self.folder / f"{method.replace(' ', '-')}-{spp}-{seed}.exr"
        output.unlink(missing_ok=True)
        if method.startswith("oidn"):
            albedo, normal = ("DenoisingAlbedo", "DenoisingNormal") if method == "oidn" else ("Albedo", "N")
            self.run("denoise", film, "--mode", "oidn", "--clean-features", "--albedo", albedo, "--normal", normal,
                     "--quiet", "-o", output)
        else:
            self.run("combine", "--independent", film, "--features", features, "--denoise", "auto", "--quiet", "-o",
                     output, *(["--oidn", "off"] if method == "own filters" else []))
        return output

    def errors(self, path):
        """relMSE in product form, and FLIP against the first reference."""
        first, second = self.references()
        metrics = ["compare", path, "--reference", first, "--json"]
        relmse = json.loads(self.run(*metrics, "--reference2", second, "--metric", "relmse"))
        flip = json.loads(self.run(*metrics, "--metric", "flip"))
        return relmse["relmse"], flip["flip"]

    def squared_bias(self, images):
        """Mean over pairs of seeds of (M1 - R1)(M2 - R2) / (D^2 + 0.01), D: each reference denoised. Noise of the
        images and of the references cancels."""
        first, second = map(read_image, self.references())
        weight = sum(1 / (image.mean(2, keepdims=True)**2 + 0.01) for image in self.denoised_references()) / 2
        images = [read_image(path) for path in images]
        pairs = [(weight * ((a - first) * (b - second) + (a - second) * (b - first)) / 2).mean()
                 for a, b in itertools.combinations(images, 2)]
        return sum(pairs) / len(pairs)


def rows_of(scene, options):
    """A row for each number of samples and method: means over the seeds."""
    for spp in options.spp:
        for method in options.methods:
            images = [scene.image(method, spp, seed) for seed in options.seeds]
            errors = numpy.array([scene.errors(image) for image in images])
            row = {"scene": scene.name, "turned": int(options.turned), "spp": spp, "method": method,
                   "seeds": len(options.seeds), "relmse": errors[:, 0].mean(), "flip": errors[:, 1].mean()}
            row["squared_bias"] = scene.squared_bias(images) if len(images) > 1 else math.nan
            yield row


def geometric_mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def tables(rows):
    """Of each number of samples a table in Markdown: 1000 relMSE and FLIP, squared bias; then means over OIDN's."""
    lines = []
    methods = [method for method in METHODS if any(row["method"] == method for row in rows)]
    for spp in sorted({row["spp"] for row in rows}):
        cells = {(row["scene"], row["method"]): row for row in rows if row["spp"] == spp}
        scenes = list(dict.fromkeys(scene for scene, _ in cells))
        lines += [f"| {spp} samples | " + " | ".join(methods) + " |", "|---" * (len(methods) + 1) + "|"]
        for scene in scenes:
            text = []
            for method in methods:
                row = cells[scene, method]
                share = row["squared_bias"] / row["relmse"]
                text.append(f"{1000 * row['relmse']:.3g}, {row['flip']:.3f}"
                            + ("" if math.isnan(share) else f", {100 * share:.0f} %"))
            lines.append(f"| {scene} | " + " | ".join(text) + " |")
        if "oidn" in methods:
            ratios = [[[cells[scene, method][key] / cells[scene, "oidn"][key] for scene in scenes]
                       for key in ("relmse", "flip")] for method in methods]
            lines += ["| over OIDN, mean | " + " | ".join(
                f"{geometric_mean(errors):.3f}, {geometric_mean(flips):.3f}" for errors, flips in ratios) + " |",
                      "| over OIDN, worst | " + " | ".join(
                          f"{max(errors):.3f}, {max(flips):.3f}" for errors, flips in ratios) + " |"]
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="scenes; default: those of turned_cameras.csv")
    parser.add_argument("--scenes", type=Path, required=True, help="folder with a folder for each scene")
    parser.add_argument("--work", type=Path, required=True, help="folder for films, references and images")
    parser.add_argument("--covary", default=os.fspath(HERE.parent.parent / "build/release/covary"))
    parser.add_argument("--spp", type=int, nargs="+", default=[8, 16, 32, 64, 128, 256, 1024])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--reference-spp", type=int, default=512, help="of each of two references")
    parser.add_argument("--width", type=int, default=320, help="pixels of the longer side")
    parser.add_argument("--turned", action="store_true", help="with the cameras of turned_cameras.csv")
    options = parser.parse_args()
    rows = []
    for name in options.names or list(turned_cameras()):
        rows += rows_of(Scene(options, name), options)
        write_rows(options.work / ("turned.csv" if options.turned else "denoising.csv"), rows)
        print(name, flush=True)
    print("\n" + tables(rows))


if __name__ == "__main__":
    main()
