#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dependent_tests.py COVARY KITCHEN.xml FOLDER: the pictures and tables of docs/notes/dependent-tests.md, after the
figures of Csonka et al. 2002. Needs `pip install pillow`.

Bidirectional path tracing without light tracing, seed 1; errors against two references by path tracing, seeds 900000001
and 900000002. KITCHEN: scene_v3.xml of Country Kitchen by Jay-Artist, CC BY 3.0, from Benedikt Bitterli, Rendering
resources."""
import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
BDPT = ("--integrator", "bdpt", "--set", "light-tracing=off")
METHOD = ("--estimator", "dependent-tests")
PAPER = (*METHOD, "--paper")
HEIGHT = 200  # of a panel


class Scene:
    """A view, where its files go, and its references."""

    def __init__(self, covary, at, name, *view, reference_spp):
        self.covary, self.at, self.view = covary, at / name, view
        self.at.mkdir()
        for seed in (900000001, 900000002):
            self.render(f"reference{seed}", "--integrator", "path", "--estimator", "none", "--spp", reference_spp,
                        "--seed", seed)

    def run(self, *arguments):
        return subprocess.run([self.covary, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    def render(self, name, *options):
        """Renders NAME.exr; returns its statistics."""
        seed = () if "--seed" in options else ("--seed", 1)
        return json.loads(self.run("render", *self.view, "--rfilter", "box", "--quiet", "-o", self.at / f"{name}.exr",
                                   "--json", "-", *seed, *options))

    def combine(self, name, films, *options):
        self.run("combine", "--crn", self.at / films / "crn.exr", "--independent", self.at / films / "independent.exr",
                 "-o", self.at / f"{name}.exr", "--quiet", *options)

    def error(self, name):
        """relMSE and the fraction of pixels with more than 5 % relative error."""
        references = [self.at / f"reference90000000{i}.exr" for i in (1, 2)]
        both = ("--reference", references[0], "--reference2", references[1], "--json", "-")
        values = json.loads(self.run("compare", self.at / f"{name}.exr", *both, "--metric", "relmse,above5"))
        return values["relmse"], values["above5"]

    def row(self, title, name):
        relmse, above = self.error(name)
        print(f"| {title} | {relmse:.2e} | {100 * above:.0f} % |", flush=True)

    def panel(self, title, name):
        return title, Image.open(self.at / f"{name}.png").convert("RGB")


def sheet(path, panels):
    font = ImageFont.truetype("DejaVuSans.ttf", 12)
    images = [image.resize((round(image.width * HEIGHT / image.height), HEIGHT), Image.NEAREST) for _, image in panels]
    page = Image.new("RGB", (sum(image.width + 6 for image in images) - 6, HEIGHT + 20), "white")
    x = 0
    for (title, _), image in zip(panels, images):
        page.paste(image, (x, 20))
        ImageDraw.Draw(page).text((x + 1, 3), title, fill="black", font=font)
        x += image.width + 6
    page.save(path, quality=85)


def heading(title):
    print(f"\n{title}\n\n| | relMSE | above 5 % |\n|---|---|---|", flush=True)


def figure1(scene, folder):
    heading("Figure 1: path tracing")
    panels = []
    for spp in (16, 64):
        for sampling in ("independent", "crn"):
            name, title = f"{sampling}{spp}", f"{spp} {'dependent' if sampling == 'crn' else sampling}"
            scene.render(name, "--integrator", "path", "--estimator", "none", "--sampling", sampling, "--spp", spp)
            panels.append(scene.panel(title, name))
            scene.row(title, name)
    sheet(folder / "dependent-tests-1.jpg", panels)


def stages(scene, number, folder):
    heading(f"Figure {number}: 50 + 50 samples")
    scene.render("paper", *BDPT, *PAPER, "--spp", 100, "--set", "dependent-spp=50", "--save-stages", scene.at)
    steps = ("dependent", "independent", "filtered", "combined")
    for step in steps:
        scene.row(step, step)
    scene.render("exact", *BDPT, *METHOD, "--spp", 100, "--set", "dependent-spp=50")
    scene.row("default instead of `--paper`", "exact")
    panels = [scene.panel(step, step) for step in steps]
    sheet(folder / f"dependent-tests-{number}.jpg", [*panels, scene.panel("default", "exact")])


def figure3(kitchen, folder):
    heading("Figure 3: Kitchen, 45 + 43 against 150 samples")
    kitchen.render("films", *BDPT, *PAPER, "--spp", 88, "--set", "dependent-spp=45", "--passes", kitchen.at / "films")
    kitchen.render("plain", *BDPT, "--estimator", "none", "--spp", 150)
    kitchen.render("exact", *BDPT, *METHOD, "--spp", 88, "--set", "dependent-spp=45")
    titles = {"films": "45 + 43, `--paper`", "exact": "45 + 43, default", "plain": "150, plain"}
    for name, title in titles.items():
        kitchen.row(title, name)
    sheet(folder / "dependent-tests-3.jpg", [kitchen.panel(t.replace("`", ""), n) for n, t in titles.items()])


def figure4(kitchen, folder):
    heading("Figure 4: regions, from the films of Figure 3")
    panels = []
    for drop in ("0.1", "0.01"):
        for side in (2, 3, 4, 6, 8):
            name = f"region{side}-{drop}"
            kitchen.combine(name, "films", *PAPER, "--set", f"max-region={side}", "--set", f"min-centre-drop={drop}")
            kitchen.row(f"m_max {side}, {drop}", name)
            if (side, drop) in ((3, "0.1"), (4, "0.01")):
                kitchen.run("convert", kitchen.at / f"{name}.exr", kitchen.at / f"{name}.png")
                panels.append(kitchen.panel(f"{side}, {drop}", name))
    sheet(folder / "dependent-tests-4.jpg", panels + [kitchen.panel("reference", "reference900000001")])


def figure5(scene, folder):
    heading("Figure 5: relative error, 50 samples in the first pass, at most 20,000 in the second")
    panels = []
    for error in ("0.6", "0.1", "0.03"):
        for title, method in (("paper", PAPER), ("default", METHOD)):
            name = f"{title}{error}"
            facts = scene.render(name, *BDPT, *method, "--set", "dependent-spp=50", "--until", f"relative={error}",
                                 "--set", "max-spp=20000")
            scene.row(f"{error}, {title}: {facts['samples_per_pixel']:.0f} samples", name)
            if title == "paper":
                panels.append(scene.panel(f"relative error {error}", name))
    sheet(folder / "dependent-tests-5.jpg", panels)


def first_samples(scene):
    heading("n of 240 samples")
    for n in (10, 25, 50, 100, 200):
        for title, method in (("paper", PAPER), ("default", METHOD)):
            scene.render(f"{title}{n}", *BDPT, *method, "--spp", 240, "--set", f"dependent-spp={n}")
            scene.row(f"n = {n}, {title}", f"{title}{n}")


def main():
    covary, kitchen, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as temporary:
        at = pathlib.Path(temporary)
        box = Scene(covary, at, "box", ROOT / "scenes/box.xml", "--resolution", "80x80", reference_spp=1024)
        figure1(box, folder)
        stages(box, 2, folder)
        stages(Scene(covary, at, "glossy", ROOT / "scenes/box.xml", "-D", "floor=glossy", "--resolution", "80x80",
                     reference_spp=1024), 6, folder)
        view = (kitchen, "--crop", "254,419,120,80")
        crop = Scene(covary, at, "kitchen", *view, reference_spp=512)
        figure3(crop, folder)
        figure4(crop, folder)
        first_samples(box)
        small = Scene(covary, at, "small", ROOT / "scenes/box.xml", "--resolution", "28x28", reference_spp=8192)
        figure5(small, folder)


if __name__ == "__main__":
    main()
