#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""demo.py COVARY OUT.jpg FOLDER: the picture of README.md, and its errors. Needs `pip install pillow`.

scenes/room.xml with 16 samples per pixel by path tracing, by Open Image Denoise from these samples, and by the default;
and a reference. Below, a part of each, magnified. FOLDER keeps the images, and those already there are used.

The errors are relMSE in product form over two references of 1,024 samples each, relative to their denoised images
(`covary compare`)."""
import json
import pathlib
import subprocess
import sys

from PIL import Image, ImageDraw, ImageFont

SCENE = pathlib.Path(__file__).resolve().parents[2] / "scenes/room.xml"
SIZE, INSET, ZOOM = (360, 240), (144, 110, 72, 48), 5  # inset: x, y, width, height
TITLE = 32  # height of the lines above the images, readable where the picture is shown at half of its size
PLAIN = ["--estimator", "none", "--denoise", "none"]
REFERENCES = ["reference1.exr", "reference2.exr"]
TITLES = {"path-tracing": "path tracing", "oidn": "Open Image Denoise", "covary": "covary", "reference": "reference"}


def render(covary, folder, name, spp, seed, *options):
    if not (folder / name).exists():
        subprocess.run([covary, "render", SCENE, "--resolution", "{}x{}".format(*SIZE), "--spp", str(spp), "--seed",
                        str(seed), "--quiet", "--no-preview", *options, "-o", folder / name], check=True)


def errors(covary, folder, names):
    """relMSE and its standard error by the references' noise."""
    references = [word for pair in zip(("--reference", "--reference2"), REFERENCES) for word in pair]
    lines = subprocess.run([covary, "compare", *(f"{name}.exr" for name in names), *references, "--metric", "relmse",
                            "--json"], cwd=folder, check=True, capture_output=True, text=True).stdout.splitlines()
    return {name: json.loads(line) for name, line in zip(names, lines)}


def panel(covary, folder, name, title):
    subprocess.run([covary, "convert", f"{name}.exr", f"{name}.png", "--overwrite"], cwd=folder, check=True)
    image = Image.open(folder / f"{name}.png").convert("RGB")
    x, y, width, height = INSET
    inset = image.crop((x, y, x + width, y + height)).resize((width * ZOOM, height * ZOOM), Image.NEAREST)
    result = Image.new("RGB", (SIZE[0], TITLE + SIZE[1] + 4 + inset.height), "white")
    ImageDraw.Draw(image).rectangle((x - 1, y - 1, x + width, y + height), outline="#ffb000")
    ImageDraw.Draw(result).text((2, 1), title, fill="black", font=ImageFont.truetype("DejaVuSans.ttf", 23))
    result.paste(image, (0, TITLE))
    result.paste(inset, (0, TITLE + SIZE[1] + 4))
    return result


def main():
    covary, output, folder = sys.argv[1], *map(pathlib.Path, sys.argv[2:])
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(REFERENCES):
        render(covary, folder, name, 1024, 1001 + number, *PLAIN)
    if not (folder / "reference.exr").exists():
        subprocess.run([covary, "merge", *REFERENCES, "-o", "reference.exr"], cwd=folder, check=True)
    render(covary, folder, "path-tracing.exr", 16, 1, *PLAIN, "--aovs", "--groups", "8")
    render(covary, folder, "covary.exr", 16, 1)
    if not (folder / "oidn.exr").exists():
        subprocess.run([covary, "denoise", "path-tracing.exr", "--mode", "oidn", "--albedo", "DenoisingAlbedo",
                        "--normal", "DenoisingNormal", "--quiet", "-o", "oidn.exr"], cwd=folder, check=True)
    found = errors(covary, folder, list(TITLES)[:3])
    panels = []
    for name, title in TITLES.items():
        relmse = f", {found[name]['relmse']:.2g}" if name in found else ""
        panels.append(panel(covary, folder, name, title + relmse))
    picture = Image.new("RGB", (4 * SIZE[0] + 3 * 6, panels[0].height), "white")
    for number, image in enumerate(panels):
        picture.paste(image, (number * (SIZE[0] + 6), 0))
    picture.save(output, quality=82)
    for name, error in found.items():
        print(name, f"{error['relmse']:.3g} ± {error.get('relmse_reference_error', 0):.1g}")


if __name__ == "__main__":
    main()
