#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""iicv.py COVARY OUT.png: the picture of docs/methods/iicv.md. Needs `pip install pillow`.

Top: part of scenes/room.xml with 48 samples per pixel: the two inputs, the result, and plain path tracing with all
samples. Bottom: the coefficients of three pixels in their 11 x 11 windows, and the errors of the result and of plain
path tracing."""
import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
WINDOW = (150, 132, 212, 96)  # x, y, width, height in the frame
PIXELS = [("wall", 342, 148), ("edge of the table", 300, 181), ("metal", 283, 166)]
COLOURS = ["#e6a700", "#d6336c", "#1098ad"]
ZOOM, REACH, CELL = 2, 5, 16


def run(covary, *arguments):
    return subprocess.run([covary, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def crop(path):
    x, y, width, height = WINDOW
    image = Image.open(path).convert("RGB")
    if image.size != (width, height):
        image = image.crop((x, y, x + width, y + height))
    return image.resize((width * ZOOM, height * ZOOM), Image.NEAREST)


def coefficients(explained):
    """Squares of the window: red for positive, blue for negative coefficients, grey where a pixel was not chosen."""
    size = (2 * REACH + 1) * CELL
    image = Image.new("RGB", (size, size), "#dddddd")
    draw = ImageDraw.Draw(image)
    largest = max(abs(v["beta"][0]) for v in explained["control_variates"])
    for v in explained["control_variates"]:
        strength = abs(v["beta"][0]) / largest
        pale = round(255 * (1 - strength))
        colour = (255, pale, pale) if v["beta"][0] > 0 else (pale, pale, 255)
        x, y = (v["dx"] + REACH) * CELL, (v["dy"] + REACH) * CELL
        draw.rectangle((x, y, x + CELL - 1, y + CELL - 1), fill=colour, outline="#999999")
    draw.rectangle((REACH * CELL, REACH * CELL, (REACH + 1) * CELL - 1, (REACH + 1) * CELL - 1), outline="black",
                   width=2)
    return image


def main():
    covary, output = sys.argv[1:]
    font = ImageFont.truetype("DejaVuSans.ttf", 15)
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        scene, crop_text = ROOT / "scenes" / "room.xml", ",".join(map(str, WINDOW))
        common = [scene, "--quiet", "--rfilter", "box"]
        run(covary, "render", *common, "-o", at / "iicv.exr", "--spp", 48, "--passes", at / "passes", "--crop",
            crop_text)
        run(covary, "render", *common, "-o", at / "plain.exr", "--spp", 48, "--estimator", "none", "--crop", crop_text)
        run(covary, "render", *common, "-o", at / "reference.exr", "--spp", 2048, "--estimator", "none", "--seed", 1000,
            "--crop", crop_text)
        for name in ("crn", "independent"):
            run(covary, "convert", at / "passes" / f"{name}.exr", at / f"{name}.png")
        run(covary, "compare", at / "iicv.exr", at / "plain.exr", "--reference", at / "reference.exr",
            "--error-map", at / "error.png")  # one scale for both
        explained = [json.loads(run(covary, "combine", "--crn", at / "passes" / "crn.exr", "--independent",
                                    at / "passes" / "independent.exr",
                                    "-o", at / "o.exr", "--quiet", "--json", "-", "--explain", f"{x},{y}"))["pixel"]
                     for _, x, y in PIXELS]
        top = [("common random numbers, 24 samples", at / "crn.png"),
               ("independent, 24 samples", at / "independent.png"),
               ("IICV of the two", at / "iicv.png"), ("path tracing, 48 samples", at / "plain.png")]
        width, height, label = WINDOW[2] * ZOOM, WINDOW[3] * ZOOM, 24
        side = (2 * REACH + 1) * CELL
        sheet = Image.new("RGB", (4 * width + 30, height + side + 2 * label + 10), "white")
        draw = ImageDraw.Draw(sheet)
        for i, (title, path) in enumerate(top):
            x = i * (width + 10)
            draw.text((x, 2), title, font=font, fill="black")
            image = crop(path)
            if i == 2:
                marks = ImageDraw.Draw(image)
                for (_, px, py), colour in zip(PIXELS, COLOURS):
                    px, py = (px - WINDOW[0]) * ZOOM, (py - WINDOW[1]) * ZOOM
                    reach = REACH * ZOOM
                    marks.rectangle((px - reach, py - reach, px + reach + 1, py + reach + 1), outline=colour, width=2)
            sheet.paste(image, (x, label))
        y = height + label + 8
        for i, ((title, _, _), pixel, colour) in enumerate(zip(PIXELS, explained, COLOURS)):
            x = i * (2 * (width + 10) // 3)
            draw.text((x, y), f"coefficients: {title}", font=font, fill=colour)
            sheet.paste(coefficients(pixel), (x, y + label))
        for i, name in ((2, "iicv"), (3, "plain")):
            x = i * (width + 10)
            draw.text((x, y), "relative squared error (logarithmic)", font=font, fill="black")
            sheet.paste(crop(at / f"error-{name}.png"), (x, y + label))
        framed = Image.new("RGB", (sheet.width + 16, sheet.height + 16), "white")
        framed.paste(sheet, (8, 8))
        framed.save(output, quality=88)


main()
