# SPDX-License-Identifier: Apache-2.0
"""The report as a reader uses it, in headless Chromium: real pointer and key events, and what the page then shows.

The images of sample_report.cpp are 64 x 32. `ramp/reference` is (x/64, y/64, 1/4), `bright` lies 1/8 above it, `dark` 1/16
below, `broken` is not a number in its first 8 x 8 pixels. `stripes/reference` is x mod 2, its `bright` is 1/2 everywhere.
"""
import base64
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from browser import Browser

sys.path.insert(0, str(Path(__file__).parent.parent / "cli"))
from exr_writer import exr  # noqa: E402

STAGE = "#main .stage"


def srgb(linear):
    """8-bit sRGB of a linear value."""
    v = min(max(linear, 0), 1)
    return round(255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055))


class PageTest(unittest.TestCase):
    size = (1200, 900)

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.file = Path(cls.folder.name) / "report.html"
        subprocess.run([os.environ["SAMPLE_REPORT"], str(cls.file)], check=True)
        cls.page = cls.enterClassContext(Browser(cls.size)) if hasattr(cls, "enterClassContext") else Browser(cls.size)

    def open(self, hash=""):
        self.page.open(f"file://{self.file}{hash}")
        self.page.box(STAGE)
        self.settle()

    def settle(self):
        """Until everything asked for has been drawn."""
        self.page.wait("new Promise(r => requestAnimationFrame(() => setTimeout(() =>"
                       " r(!document.querySelector('[aria-busy=true]')))))")

    def tearDown(self):
        self.assertEqual(self.page.errors, [], "errors of the page")

    def colour(self, fx, fy):
        """The stage's colour at a fraction of its width and height."""
        return tuple(self.page.evaluate(f"(() => {{ const c = document.querySelector('{STAGE} canvas');"
                                        f"return [...c.getContext('2d').getImageData(c.width * {fx}, c.height * {fy}, 1, 1).data]; }})()")[:3])

    def stage_point(self, fx, fy):
        left, top, width, height = self.page.box(STAGE)
        return left + width * fx, top + height * fy

    def press_key(self, *keys, **more):
        for key in keys:
            self.page.key(key, **more)
        self.settle()

    def at_centre_of_pixel(self, x, y):
        """The fractions of the fitted stage where the middle of an image pixel is."""
        return (x + 0.5) / 64, (y + 0.5) / 32

    def picture(self, x, y, offset=0, exposure=0):
        return tuple(srgb((v + offset) * 2 ** exposure) for v in (x / 64, y / 64, 0.25))


class Page(PageTest):
    def test_shows_the_document_and_fetches_nothing(self):
        self.open()
        self.assertEqual(self.page.evaluate("document.title"), "Sample report")
        self.assertEqual(self.page.text(".subtitle"), "Every kind of block </script> once")
        self.assertEqual(self.page.text("#results .prose"), "Text <b>as it is</b>.")
        self.assertIn("a scene failed", self.page.text("#failures .notes.error"))
        self.assertEqual(self.page.evaluate("performance.getEntriesByType('resource').length"), 0)
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('nav a')].map(a => a.hash)"), ["#results", "#images", "#failures"])

    def test_many_warnings_fold(self):
        self.open()
        shown = "[...document.querySelectorAll('#failures .warning li')].filter(e => e.checkVisibility()).map(e => e.innerText)"
        self.assertEqual(self.page.evaluate(shown), [f"warning {i}" for i in range(1, 6)])
        self.assertEqual(self.page.text("#failures .warning summary"), "3 more")
        self.page.press("#failures .warning summary")
        self.assertEqual(self.page.evaluate(shown), [f"warning {i}" for i in range(1, 9)])

    def test_table_has_intervals_marks_and_units(self):
        self.open()
        text = self.page.text(".table tbody")
        for part in ("0.00350 … 0.00390", "published 0.0088", "9.2×", "2.50 min", "4.0 %", "–"):
            self.assertIn(part, text)
        self.assertEqual(self.page.evaluate("[...document.querySelector('.table').querySelectorAll('.best')].map(e => e.innerText)"),
                         ["0.00370", "9.2×"])

    def test_best_of_each_group(self):
        self.open()
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('#failures .best')].map(e => e.innerText)"), ["0.500", "3.50"])
        self.assertEqual(self.page.text("#failures tbody td:last-child"), "2")

    def test_table_sorts(self):
        self.open()
        header = ".table thead th:nth-child(%d) button"
        self.page.press(header % 2)
        first = self.page.evaluate("[...document.querySelectorAll('.table')][0].querySelector('tbody th').innerText")
        self.assertEqual(first, "IICV")
        self.assertEqual(self.page.evaluate("document.querySelector('.table thead th:nth-child(2)').ariaSort"), "ascending")
        self.page.press(header % 2)
        names = "[...document.querySelectorAll('.table')][0].querySelectorAll('tbody th')"
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["path tracing", "IDUW", "IICV"])
        self.page.press(header % 5)  # a missing value is last either way
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["IICV", "IDUW", "path tracing"])
        self.page.press(header % 5)
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["IDUW", "IICV", "path tracing"])

    def test_plot_has_log_axes_error_bars_and_numbers(self):
        self.open()
        self.page.box(".plot canvas")
        self.settle()
        self.assertIn("nine times below", self.page.evaluate("document.querySelector('.plot canvas').ariaLabel"))
        self.assertEqual(self.page.evaluate("['x', 'y'].map(a => Chart.getChart(document.querySelector('.plot canvas')).scales[a].type)"),
                         ["logarithmic", "logarithmic"])
        # The upper end of the first error bar: the cap reaches 4 pixels to both sides of the point.
        cap = self.page.evaluate(
            "(() => { const canvas = document.querySelector('.plot canvas'), chart = Chart.getChart(canvas);"
            "const x = chart.scales.x.getPixelForValue(48), y = chart.scales.y.getPixelForValue(0.18), ratio = chart.currentDevicePixelRatio;"
            "const area = canvas.getContext('2d').getImageData((x - 3) * ratio, (y - 1) * ratio, 1, 3).data;"
            "return Math.max(area[3], area[7], area[11]); })()")
        self.assertGreater(cap, 100, "no cap of an error bar")
        self.assertEqual(self.page.evaluate("document.querySelector('.plot tbody').rows.length"), 4 + 3 + 2, "points without a value are left out")

    def test_text_can_be_read_in_light_and_dark(self):
        for scheme in ("light", "dark"):
            self.page.colour_scheme(scheme)
            self.open()
            names = ["--ground", "--text", "--text-soft", "--accent", "--error", "--warning"]
            values = self.page.evaluate(f"{names}.map(n => getComputedStyle(document.documentElement).getPropertyValue(n).trim())")
            light = {n: sum(w * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4) for w, c in
                            zip((0.2126, 0.7152, 0.0722), (int(v[i:i + 2], 16) / 255 for i in (1, 3, 5)))) for n, v in zip(names, values)}
            for name in names[1:]:
                low, high = sorted((light[name], light["--ground"]))
                self.assertGreaterEqual((high + 0.05) / (low + 0.05), 4.5, f"{name} in {scheme}")  # WCAG 2, level AA
        self.page.colour_scheme("light")


class Comparer(PageTest):
    def test_begins_with_the_baseline_beside_the_method(self):
        self.open()
        self.assertEqual(self.page.evaluate("document.querySelector('#main canvas').ariaLabel"),
                         "ramp: bright (relMSE 0.09) left, dark (relMSE 0.02) right; picture, 0 stops")
        for x, offset in ((10, 1 / 8), (50, -1 / 16)):
            self.assertEqual(self.colour(*self.at_centre_of_pixel(x, 20)), self.picture(x, 20, offset))

    def test_number_keys_flip(self):
        self.open()
        self.page.move(*self.stage_point(0.25, 0.5))
        self.press_key("s")  # one image
        for key, offset in (("1", 0), ("2", 1 / 8), ("3", -1 / 16)):
            self.press_key(key)
            self.assertEqual(self.colour(*self.at_centre_of_pixel(40, 20)), self.picture(40, 20, offset), key)
            self.assertEqual(self.page.evaluate("[...document.querySelectorAll('.methods button')].findIndex(b => b.ariaPressed === 'true')"), int(key) - 1)
        self.press_key("4")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(3, 6)), (0, 255, 0), "not-a-number is green")

    def test_number_keys_follow_the_pointer_in_split(self):
        self.open()
        self.page.move(*self.stage_point(0.9, 0.5))
        self.press_key("1")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(50, 20)), self.picture(50, 20))
        self.assertEqual(self.colour(*self.at_centre_of_pixel(10, 20)), self.picture(10, 20, 1 / 8))
        self.press_key(" ")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(10, 20)), self.picture(10, 20))

    def test_split_slider(self):
        self.open()
        x, y = self.stage_point(0.5, 0.5)
        self.page.drag(x, y, *self.stage_point(0.75, 0.5))
        self.settle()
        self.assertEqual(self.page.evaluate("document.querySelector('.handle').ariaValueNow"), "75")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(44, 20)), self.picture(44, 20, 1 / 8))
        self.page.evaluate("document.querySelector('.handle').focus()")
        self.press_key("Home")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(2, 20)), self.picture(2, 20, -1 / 16))

    def test_exposure(self):
        self.open()
        self.page.move(*self.stage_point(0.25, 0.5))
        self.press_key("e", "e", "e", "e")
        self.assertEqual(self.page.text(".stops output"), "+2")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(4, 5)), self.picture(4, 5, 1 / 8, 2))
        self.press_key("e", shift=True)
        self.assertEqual(self.page.text(".stops output"), "+1.5")
        self.press_key("r")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(4, 5)), self.picture(4, 5, 1 / 8))

    def test_false_colour_error(self):
        self.open()
        self.page.press(".segmented [data-value=error]")
        self.settle()
        # bright: error (1/8)^2 / (grey^2 + 0.01) on a logarithmic scale from 1e-4 to 10.
        ramp = self.page.evaluate("JSON.parse(document.getElementById('document').textContent).error_colours")
        for x, y in ((4, 4), (20, 30)):
            grey = (x / 64 + y / 64 + 0.25) / 3
            t = math.log10((1 / 64) / (grey * grey + 0.01) / 1e-4) / 5 * (len(ramp) - 1)
            low, high = (ramp[int(t)], ramp[int(t) + 1])
            expected = [((low >> s) & 255) * (1 - t % 1) + ((high >> s) & 255) * (t % 1) for s in (16, 8, 0)]
            for got, want in zip(self.colour(*self.at_centre_of_pixel(x, y)), expected):
                self.assertAlmostEqual(got, want, delta=5)  # the ramp has 256 steps
        self.assertIn("squared error", self.page.text(".scale"))
        self.press_key("1")  # pressed on a button: keys belong to the comparer that has the focus
        self.assertEqual(self.colour(*self.at_centre_of_pixel(4, 4)), (2, 2, 18), "no error has the lowest colour")

    def test_signed_difference(self):
        self.open()
        self.page.press(".segmented [data-value=difference]")
        self.settle()
        r, _, b = self.colour(*self.at_centre_of_pixel(10, 20))
        self.assertGreater(r, b + 40, "too bright is red")
        r, _, b = self.colour(*self.at_centre_of_pixel(50, 20))
        self.assertGreater(b, r + 40, "too dark is blue")

    def test_pixel_values(self):
        self.open()
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(16, 8)))
        text = self.page.text(".pixel")
        for part in ("x 16, y 8", "bright 0.3750 0.2500 0.3750", "dark 0.1875 0.06250 0.1875", "reference 0.2500 0.1250 0.2500"):
            self.assertIn(part, text)
        self.assertIn(f"error {(1 / 64) / ((0.625 / 3) ** 2 + 0.01):.2f}", text)

    def test_wheel_zooms_about_the_pointer_after_a_click(self):
        self.open()
        x, y = self.stage_point(*self.at_centre_of_pixel(16, 8))
        self.page.wheel(x, y, -400)
        self.settle()
        self.assertNotIn("zoom=", self.page.evaluate("location.hash"), "without the focus the page scrolls")
        x, y = self.stage_point(*self.at_centre_of_pixel(16, 8))
        self.page.click(x, y)
        self.page.wheel(x, y, -600)
        self.page.wait("location.hash.includes('zoom=')")
        self.settle()
        self.page.move(x, y)
        self.assertIn("x 16, y 8", self.page.text(".pixel"))
        zoom = float(re.search(r"zoom=([\d.]+)", self.page.evaluate("location.hash"))[1])
        self.assertGreater(zoom, 2 * self.page.box(STAGE)[2] / 64)

    def test_drag_pans_all_images(self):
        self.open("#view=main/ramp/bright/dark&layout=grid&zoom=16&x=32&y=16")
        before = self.page.evaluate("location.hash")
        x, y = self.stage_point(0.25, 0.25)
        self.page.drag(x, y, x + 64, y - 32)  # 4 pixels to the right, 2 up
        self.page.wait(f"location.hash !== {json.dumps(before)}")
        self.assertIn("&x=28&y=18", self.page.evaluate("location.hash"))
        self.settle()
        left, top, width, height = self.page.box(STAGE)
        for column, row, offset in ((0, 0, 0), (1, 0, 1 / 8), (0, 1, -1 / 16)):
            fx, fy = ((column + 0.5) * width / 2 - 1 + 8) / width, ((row + 0.5) * height / 2 - 1 + 8) / height
            self.assertEqual(self.colour(fx, fy), self.picture(28, 18, offset), (column, row))

    def test_scenes(self):
        self.open()
        self.page.evaluate("(() => { const s = document.querySelector('#main select'); s.selectedIndex = 1; s.dispatchEvent(new Event('change')); })()")
        self.settle()
        self.assertIn("stripes & more: bright", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))
        self.assertEqual(self.colour(0.25, 0.5), (188, 188, 188))

    def test_keyboard_alone(self):
        self.open()
        self.page.evaluate("document.querySelector('#main canvas').focus()")
        self.press_key("s", "1", "+", "+", "ArrowRight", "x")
        self.page.wait("location.hash.includes('mode=error')")
        hash = self.page.evaluate("location.hash")
        self.assertIn("view=main/ramp/reference/dark&layout=single&mode=error", hash)
        self.assertGreater(float(re.search(r"x=([\d.]+)", hash)[1]), 32)
        self.press_key("?")
        self.assertTrue(self.page.evaluate("document.querySelector('dialog').open"))


class Insets(PageTest):
    def crops(self):
        return self.page.evaluate("[...document.querySelectorAll('.crops tbody tr')].map(r => [...r.querySelectorAll('.error')].map(e => e.innerText))")

    def test_suite_inset_has_the_error_of_each_crop(self):
        self.open()
        rows = self.crops()
        total = [(0.125 ** 2) / (((x + y) / 64 + 0.25) ** 2 / 9 + 0.01) for y in range(8, 16) for x in range(8, 24)]
        self.assertEqual(rows, [["reference", f"relMSE {sum(total) / len(total):.2g}", f"relMSE {sum(total) / len(total) / 4:.2g}", "relMSE 0"]])

    def test_drawn_inset_and_figure(self):
        self.open()
        self.press_on_stage("n")
        self.page.drag(*self.stage_point(32 / 64, 16 / 32), *self.stage_point(48 / 64, 28 / 32))
        self.settle()
        self.assertEqual(len(self.crops()), 2)
        self.page.wait("location.hash.includes('insets=8,8,16,8;32,16,16,12')")
        self.page.press("[aria-label^='Save a figure']")
        name, data = self.page.downloaded(".png")
        self.assertEqual(name, "ramp-image.png")
        width, height, colours = self.page.evaluate(
            "(async () => { const blob = await (await fetch('data:image/png;base64,%s')).blob(), image = await createImageBitmap(blob);"
            "const context = new OffscreenCanvas(image.width, image.height).getContext('2d'); context.drawImage(image, 0, 0);"
            "const data = context.getImageData(0, 0, image.width, image.height).data, colours = new Set();"
            "for (let i = 0; i < data.length; i += 4) colours.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);"
            "return [image.width, image.height, [...colours]]; })()" % base64.b64encode(data).decode())
        self.assertGreater(width, 2 * 4 * 150)
        self.assertGreater(height, 2 * (75 + 112))
        colours = {tuple(map(int, text.split(","))) for text in colours}
        self.assertIn((255, 255, 255), colours)
        self.assertIn((17, 17, 17), colours, "text")
        for offset in (0, 1 / 8, -1 / 16):  # a pixel of the second inset is in the crop of each image
            self.assertIn(self.picture(40, 22, offset), colours)
        self.page.press("[aria-label='Remove inset 1']")
        self.settle()
        self.assertEqual(len(self.crops()), 1)

    def press_on_stage(self, key):
        self.page.move(*self.stage_point(0.4, 0.4))
        self.press_key(key)

    def test_inset_by_keyboard(self):
        self.open()
        self.press_on_stage("n")
        self.press_key("Enter")
        self.assertEqual(len(self.crops()), 2)
        self.page.wait("location.hash.includes('insets=8,8,16,8;24,12,16,8')")


class Links(PageTest):
    def test_link_opens_exactly_this_view(self):
        link = "#view=main/stripes%20%26%20more/reference/bright&layout=single&mode=image&exposure=-1&gain=0&zoom=100&x=11.5&y=5"
        self.open(link)
        self.assertEqual(self.colour(0.5, 0.5), (188, 188, 188), "pixel 11 is 1, one stop darker")
        left, top, width, height = self.page.box(STAGE)
        self.assertEqual(self.colour(0.5 + 100 / width, 0.5), (0, 0, 0), "pixel 12, 100 screen pixels to the right, is 0")
        self.press_key("r")
        self.page.evaluate("document.querySelector('#main canvas').focus()")
        self.press_key("r")
        self.page.wait("location.hash.includes('exposure=0')")
        self.assertEqual(self.page.evaluate("location.hash"), link.replace("exposure=-1", "exposure=0"))

    def test_link_in_a_table(self):
        self.open()
        self.page.press(".table a")
        self.page.wait("document.querySelector('#main canvas').ariaLabel.includes('squared error')")
        self.assertIn("bright (relMSE 0.09) left, reference (reference) right", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))

    def test_unknown_names_are_passed_over(self):
        self.open("#view=main/no/no/no&layout=no&mode=no&zoom=no&insets=1,2")
        self.assertIn("ramp: bright", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))
        self.open("#view=nobody/%E0%A4%A")
        self.assertIn("ramp: bright", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))


class SmallScreen(PageTest):
    size = (390, 800)

    def test_nothing_sticks_out(self):
        self.open()
        self.assertLessEqual(self.page.evaluate("document.documentElement.scrollWidth"), 390)

    def test_two_fingers_zoom(self):
        self.open()
        x, y = self.stage_point(0.5, 0.5)

        def touch(kind, *points):
            self.page.command("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(points)])
        self.page.command("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        touch("touchStart", (x - 20, y + 30), (x + 20, y + 30))
        for spread in (30, 40, 60):
            touch("touchMove", (x - spread, y + 30), (x + spread, y + 30))
        touch("touchEnd")
        self.page.wait("location.hash.includes('zoom=')")
        zoom = float(re.search(r"zoom=([\d.]+)", self.page.evaluate("location.hash"))[1])
        self.assertAlmostEqual(zoom, 3 * self.page.box(STAGE)[2] / 64, delta=1)


class View(PageTest):
    def covary(self, *arguments, **more):
        return subprocess.run([os.environ["COVARY"], "view", *arguments], cwd=self.folder.name, capture_output=True, text=True, timeout=60, **more)

    def write(self, name, value, **more):
        (Path(self.folder.name) / name).write_bytes(exr({c: [value] * 12 for c in "RGB"}, (4, 3), **more))
        return name

    def test_images_at_hand(self):
        self.write("a.exr", 0.5), self.write("b.exr", 0.6), self.write("r.exr", 0.5)
        result = self.covary("a.exr", "b.exr", "--reference", "r.exr", "-o", "out.html", "--inset", "1,1,2,1", "--title", "Two")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))
        self.page.open(f"file://{self.folder.name}/out.html")
        self.page.wait("document.querySelector('.crops')")
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('.methods button')].map(b => b.innerText.replace(/\\s+/g, ' '))"),
                         ["1 r reference", "2 a relMSE 0", "3 b relMSE 0.0385"])

    def test_opens_a_page_of_its_own(self):
        self.write("a.exr", 0.5)
        fake = Path(self.folder.name) / "xdg-open"
        fake.write_text('#!/bin/sh\necho "$1" > opened\n')
        fake.chmod(0o755)
        result = self.covary("a.exr", env={"PATH": self.folder.name, "DISPLAY": ":0", "TMPDIR": self.folder.name})
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual((Path(self.folder.name) / "opened").read_text(), result.stdout)
        self.assertIn("<title>a</title>", Path(result.stdout.strip()).read_text())
        result = self.covary("a.exr", env={"PATH": "/nowhere", "TMPDIR": self.folder.name})
        self.assertEqual(result.returncode, 0)
        self.assertIn("open the file above", result.stderr)

    def test_wrong_usage(self):
        self.write("a.exr", 0.5)
        (Path(self.folder.name) / "b.exr").write_bytes(exr({c: [1] * 4 for c in "RGB"}, (2, 2)))
        for code, message, *arguments in ((2, "must end in .html", "a.exr", "-o", "a.png"), (2, "expected X,Y,WIDTH,HEIGHT", "a.exr", "-o", "o.html", "--inset", "1,2"),
                                          (2, "does not fit into the 4 x 3 pixels", "a.exr", "-o", "o.html", "--inset", "3,0,2,1"),
                                          (1, "frame of 4 x 3 pixels, b.exr one of 2 x 2", "a.exr", "b.exr", "-o", "o.html")):
            result = self.covary(*arguments)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)
            self.assertFalse((Path(self.folder.name) / "o.html").exists())


if __name__ == "__main__":
    unittest.main()
