# SPDX-License-Identifier: Apache-2.0
"""The report as a reader uses it, in headless Chromium: real pointer and key events, and what the page then shows.

The images of sample_report.cpp are 64 x 32. `ramp/reference` is (x/64, y/64, 1/4), `bright` lies 1/8 above it, `dark`
1/16 below, `broken` is not a number in its first 8 x 8 pixels. `bright` has FLIP x/64, StdError 1/8, N (0, -1 left and
1 right of the middle, 1/2) and samples x/64. `stripes/reference` is x mod 2, its `bright` is 1/2 everywhere, its
`white` 4.
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
        return tuple(self.page.evaluate(
            f"(() => {{ const c = document.querySelector('{STAGE} canvas'), place = [c.width * {fx}, c.height * {fy}];"
            "return [...c.getContext('2d').getImageData(...place, 1, 1).data]; })()")[:3])

    def stage_point(self, fx, fy):
        left, top, width, height = self.page.box(STAGE)
        return left + width * fx, top + height * fy

    def press_key(self, *keys, **more):
        for key in keys:
            self.page.key(key, **more)
        self.settle()

    def at_centre_of_pixel(self, x, y):
        """The fractions of the fitted stage where the middle of an image pixel is."""
        _, _, width, height = self.page.box(STAGE)
        zoom = min(width / 64, height / 32)
        return 0.5 + (x + 0.5 - 32) * zoom / width, 0.5 + (y + 0.5 - 16) * zoom / height

    def label(self):
        """What the stage shows, in words."""
        return self.page.evaluate("document.querySelector('#main canvas').ariaLabel")

    def picture(self, x, y, offset=0, exposure=0):
        return tuple(srgb((v + offset) * 2 ** exposure) for v in (x / 64, y / 64, 0.25))


class Page(PageTest):
    def test_shows_the_document_and_fetches_nothing(self):
        self.open()
        self.assertEqual(self.page.evaluate("document.title"), "Sample report")
        self.assertEqual(self.page.text(".subtitle"), "Every kind of block </script> once")
        self.assertEqual(self.page.text("#results .prose"), "Text <b>as it is</b>, code --apart.")
        self.assertEqual(self.page.text("#results .prose code"), "code --apart")
        self.assertIn("a scene failed", self.page.text("#failures .notes.error"))
        self.assertEqual(self.page.evaluate("performance.getEntriesByType('resource').length"), 0)
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('nav a')].map(a => a.hash)"),
            ["#results", "#images", "#failures"])

    def test_many_warnings_fold(self):
        self.open()
        shown = ("[...document.querySelectorAll('#failures .warning li')]"
                 ".filter(e => e.checkVisibility()).map(e => e.innerText)")
        self.assertEqual(self.page.evaluate(shown), [f"warning {i}" for i in range(1, 6)])
        self.assertEqual(self.page.text("#failures .warning summary"), "3 more")
        self.page.press("#failures .warning summary")
        self.assertEqual(self.page.evaluate(shown), [f"warning {i}" for i in range(1, 9)])

    def test_table_has_intervals_marks_and_units(self):
        self.open()
        text = self.page.text(".table tbody")
        for part in ("0.00350 … 0.00390", "published 0.0088", "9.2×", "2.50 min", "4.0 %", "–"):
            self.assertIn(part, text)
        self.assertEqual(self.page.evaluate("[...document.querySelector('.table').querySelectorAll('.best')].map(e => "
            "e.innerText)"),
                         ["0.00370", "9.2×"])

    def test_numbers_have_no_e(self):
        self.open()
        self.assertIn("7.30 × 10⁻⁵", self.page.text("#failures tbody"))

    def test_axes_hold_all_error_bars(self):
        self.open()
        self.page.box(".plot:nth-of-type(2) canvas")
        self.settle()
        highest = self.page.evaluate("Chart.getChart(document.querySelectorAll('.plot canvas')[1]).scales.y.max")
        self.assertGreaterEqual(highest, 19)

    def test_best_of_each_group(self):
        self.open()
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('#failures .best')].map(e => e.innerText)"),
            ["0.500", "3.50"])
        self.assertEqual(self.page.text("#failures tbody td:last-child"), "2")

    def test_table_sorts(self):
        self.open()
        header = ".table thead th:nth-child(%d) button"
        self.page.press(header % 2)
        first = self.page.evaluate("[...document.querySelectorAll('.table')][0].querySelector('tbody th').innerText")
        self.assertEqual(first, "IICV")
        self.assertEqual(self.page.evaluate("document.querySelector('.table thead th:nth-child(2)').ariaSort"),
            "ascending")
        self.page.press(header % 2)
        names = "[...document.querySelectorAll('.table')][0].querySelectorAll('tbody th')"
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["path tracing", "IDUW", "IICV"])
        self.page.press(header % 5)  # a missing value is last either way
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["IICV", "IDUW", "path tracing"])
        self.page.press(header % 5)
        self.assertEqual(self.page.evaluate(f"[...{names}].map(e => e.innerText)"), ["IDUW", "IICV", "path tracing"])

    def test_tables_fill_the_width(self):
        self.open()
        widths = ("[...document.querySelectorAll('#results .table table, #content')]"
                  ".map(e => e.getBoundingClientRect().width)")
        whole, table = sorted(self.page.evaluate(widths), reverse=True)[:2]
        self.assertGreater(table, 0.98 * whole)

    def test_plot_has_log_axes_error_bars_and_numbers(self):
        self.open()
        self.page.box(".plot canvas")
        self.settle()
        self.assertIn("nine times below", self.page.evaluate("document.querySelector('.plot canvas').ariaLabel"))
        self.assertEqual(self.page.evaluate("['x', 'y'].map(a => Chart.getChart(document.querySelector('.plot "
            "canvas')).scales[a].type)"),
                         ["logarithmic", "logarithmic"])
        # The upper end of the first error bar: the cap reaches 4 pixels to both sides of the point.
        cap = self.page.evaluate(
            "(() => { const canvas = document.querySelector('.plot canvas'), chart = Chart.getChart(canvas);"
            "const x = chart.scales.x.getPixelForValue(48), y = chart.scales.y.getPixelForValue(0.18);"
            "const ratio = chart.currentDevicePixelRatio;"
            "const area = canvas.getContext('2d').getImageData((x - 3) * ratio, (y - 1) * ratio, 1, 3).data;"
            "return Math.max(area[3], area[7], area[11]); })()")
        self.assertGreater(cap, 100, "no cap of an error bar")
        self.assertEqual(self.page.evaluate("document.querySelector('.plot tbody').rows.length"), 4 + 3 + 2,
            "points without a value are left out")

    def test_text_can_be_read_in_light_and_dark(self):
        for scheme in ("light", "dark"):
            self.page.colour_scheme(scheme)
            self.open()
            names = ["--ground", "--text", "--text-soft", "--accent", "--error", "--warning"]
            values = self.page.evaluate(f"{names}.map(n => "
                f"getComputedStyle(document.documentElement).getPropertyValue(n).trim())")
            light = {n: sum(w * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4) for w, c in
                            zip((0.2126, 0.7152, 0.0722),
                                (int(v[i:i + 2], 16) / 255 for i in (1, 3, 5)))) for n, v in zip(names, values)}
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

    def test_begins_with_the_best_method(self):
        self.open()
        self.choose_scene(1)
        self.assertEqual(self.label(), "stripes & more: white (relMSE 9) left, reference (reference) right; picture, "
            "0 stops")

    def test_number_keys_flip(self):
        self.open()
        self.page.move(*self.stage_point(0.25, 0.5))
        self.press_key("s")  # one image
        for key, offset in (("1", 0), ("2", 1 / 8), ("3", -1 / 16)):
            self.press_key(key)
            self.assertEqual(self.colour(*self.at_centre_of_pixel(40, 20)), self.picture(40, 20, offset), key)
            self.assertEqual(self.page.evaluate("[...document.querySelectorAll('.methods button')].findIndex(b => "
                "b.ariaPressed === 'true')"), int(key) - 1)
        self.press_key("4")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(3, 6)), (0, 255, 0), "not-a-number is green")

    def test_number_keys_need_neither_pointer_nor_focus(self):
        self.open()
        self.press_key("1")
        self.assertIn("reference (reference) left", self.label())

    def test_number_keys_in_the_grid(self):
        self.open("#layout=grid")
        self.press_key("3")
        self.assertIn("ramp: dark (relMSE 0.02);", self.label(), "alone")
        self.press_key("2")
        self.assertIn("ramp: bright (relMSE 0.09);", self.label())
        self.press_key("2")
        self.assertIn("ramp: reference (reference), bright", self.label(), "once more: back to the grid")

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

    def test_tone_curves(self):
        self.open("#exposure=1")
        at = self.at_centre_of_pixel(10, 20)
        value = [2 * (v + 1 / 8) for v in (10 / 64, 20 / 64, 1 / 4)]
        self.press_key("t")
        self.assertEqual(self.page.evaluate("document.querySelector('[aria-label=\"Tone "
            "curve\"]').selectedOptions[0].text"), "Reinhard")
        self.assertEqual(self.colour(*at), tuple(srgb(v / (1 + v)) for v in value))
        self.press_key("t")
        aces = [(2.51 * w * w + 0.03 * w) / (2.43 * w * w + 0.59 * w + 0.14) for w in (0.6 * v for v in value)]
        self.assertEqual(self.colour(*at), tuple(map(srgb, aces)))
        self.page.wait("location.hash.includes('&tone=aces&')")
        self.press_key("t")
        self.assertEqual(self.colour(*at), tuple(map(srgb, value)))

    def test_negative_values_are_black_and_read_as_they_are(self):
        self.open("#view=main/ramp/dark/reference&layout=single")
        at = self.at_centre_of_pixel(2, 2)
        self.assertEqual(self.colour(*at), (0, 0, srgb(3 / 16)))
        self.page.move(*self.stage_point(*at))
        self.assertIn("dark −0.03125 −0.03125 0.1875", self.page.text(".pixel"))
        self.assertEqual(self.page.evaluate("document.querySelectorAll('.pixel .negative').length"), 2)
        self.press_key("d")
        r, _, b = self.colour(*at)
        self.assertGreater(b, r + 40, "too dark is blue")

    def test_flip(self):
        self.open("#view=main/ramp/bright/reference")
        self.press_key("l")
        ramp = self.page.evaluate("JSON.parse(document.getElementById('document').textContent).error_colours")
        for got, shift in zip(self.colour(*self.at_centre_of_pixel(16, 4)), (16, 8, 0)):
            self.assertAlmostEqual(got, (ramp[8] >> shift) & 255, delta=3)  # 1/4 of 32 steps
        self.assertEqual(self.colour(*self.at_centre_of_pixel(50, 4)), (2, 2, 18),
            "the reference does not differ from itself")
        self.assertEqual(self.marks(".scale"), ["0", "0.25", "0.5", "0.75", "1"])
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(16, 8)))
        self.assertIn("FLIP 0.25", self.page.text(".pixel"))
        self.assertEqual(self.crop_labels()[0][1], f"FLIP {sum(range(8, 24)) / 16 / 64:.2g}")
        self.assertEqual(self.crop_labels()[0][2], "no FLIP in dark")

    def marks(self, selector):
        return self.page.evaluate(f"[...document.querySelectorAll('{selector} .marks span')].map(e => e.innerText)")

    def crop_labels(self):
        return self.page.evaluate("[...document.querySelectorAll('.crops tbody tr')].map(r => "
            "[...r.querySelectorAll('td')].map(e => e.innerText))")

    def test_ssim_is_that_of_the_definition(self):
        self.open("#view=main/stripes%20%26%20more/bright/reference&mode=ssim")
        weight = [math.exp(-d * d / 4.5) for d in range(-5, 6)]
        # The mean of the stripes about x = 20.
        odd = sum(w for d, w in zip(range(-5, 6), weight) if (20 + d) % 2) / sum(weight)
        mx, my, vx, vy = 188 / 255, odd, 0, odd - odd * odd
        ssim = (2 * mx * my + 1e-4) * 9e-4 / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4))
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(20, 16)))
        self.assertIn(f"1 − SSIM {1 - ssim:.2g}", self.page.text(".pixel").replace("1.0", "1"))
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(40, 16)))
        self.press_key("2")
        self.open("#view=main/ramp/bright/dark&mode=ssim&layout=grid")
        self.assertIn("1 − SSIM", self.label())

    def test_predicted_error(self):
        self.open("#view=main/ramp/bright/reference&mode=predicted")
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(16, 8)))
        grey = (16 / 64 + 8 / 64 + 1 / 4) / 3 + 1 / 8
        self.assertIn(f"predicted error {(1 / 64) / (grey * grey + 0.01):.2g}", self.page.text(".pixel"))
        self.assertFalse(self.page.evaluate("document.querySelector('[data-value=predicted]').disabled"))
        self.choose_scene(1)
        self.assertTrue(self.page.evaluate("document.querySelector('[data-value=predicted]').disabled"),
            "no standard errors")
        self.assertIn("; picture,", self.label())

    def test_layers(self):
        self.open("#view=main/ramp/bright/reference&layout=single")
        self.assertEqual(self.page.evaluate("[...document.querySelector('[aria-label=\"Layer of the "
            "file\"]').options].map(o => o.value)"),
                         ["", "StdError", "N", "samples"])
        self.press_key("v")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(10, 20)), (srgb(1 / 8),) * 3)
        self.press_key("v")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(10, 20)), (128, 0, 191))
        self.assertEqual(self.colour(*self.at_centre_of_pixel(50, 20)), (128, 255, 191))
        self.page.move(*self.stage_point(*self.at_centre_of_pixel(10, 20)))
        self.assertIn("bright 0 −1.000 0.5000", self.page.text(".pixel"))
        self.press_key("v")
        self.assertEqual((self.colour(*self.at_centre_of_pixel(0, 20)), self.colour(*self.at_centre_of_pixel(63, 20))),
            ((0,) * 3, (255,) * 3))
        self.page.wait("location.hash.includes('mode=layer&layer=samples')")
        self.press_key("v")
        self.assertEqual(self.colour(*self.at_centre_of_pixel(10, 20)), self.picture(10, 20, 1 / 8))
        self.press_key("3", "v")
        self.assertIn("ramp: bright", self.label(), "dark has no layers")

    def test_histogram(self):
        self.open("#view=main/ramp/dark/reference&layout=single")
        self.press_key("h")
        self.settle()
        text = self.page.text(".histogram figcaption")
        negative = sum(x < 4 or y < 4 for x in range(64) for y in range(32))
        self.assertIn(f"dark min −0.0625 · mean {(31.5 / 64 + 15.5 / 64 + 0.25) / 3 - 1 / 16:.3f} · max 0.922 · "
            f"{negative} pixels negative", text)
        self.page.wait("location.hash.includes('histogram=1')")
        drawn = ("(() => { const c = document.querySelector('.histogram canvas');"
                 "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
                 "for (let i = 3; i < d.length; i += 4) n += d[i] > 200; return n; })()")
        self.assertGreater(self.page.evaluate(drawn), 300)
        self.press_key("d")
        self.assertIn("mean −", self.page.text(".histogram figcaption"))
        self.assertEqual(self.marks(".histogram"), ["−25.0 %", "−12.5 %", "0 %", "+12.5 %", "+25.0 %"])
        self.press_key("h")
        self.assertFalse(self.page.evaluate("document.querySelector('.histograms').checkVisibility()"))

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
        for part in ("x 16, y 8", "bright 0.3750 0.2500 0.3750", "dark 0.1875 0.06250 0.1875",
            "reference 0.2500 0.1250 0.2500"):
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

    def choose_scene(self, index):
        self.page.evaluate("(() => { const s = document.querySelector('#main select'); s.selectedIndex = %d; "
            "s.dispatchEvent(new Event('change')); })()" % index)
        self.settle()

    def test_scenes(self):
        self.open()
        self.choose_scene(1)
        self.assertIn("stripes & more: white", self.label())
        self.press_key("2")
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
        return self.page.evaluate("[...document.querySelectorAll('.crops tbody tr')].map(r => "
            "[...r.querySelectorAll('.error')].map(e => e.innerText))")

    def test_suite_inset_has_the_error_of_each_crop(self):
        self.open()
        rows = self.crops()
        total = [(0.125 ** 2) / (((x + y) / 64 + 0.25) ** 2 / 9 + 0.01) for y in range(8, 16) for x in range(8, 24)]
        self.assertEqual(rows, [["reference", f"relMSE {sum(total) / len(total):.2g}",
            f"relMSE {sum(total) / len(total) / 4:.2g}", "relMSE 0"]])

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
            "(async () => { const blob = await (await fetch('data:image/png;base64,%s')).blob();"
            "const image = await createImageBitmap(blob);"
            "const context = new OffscreenCanvas(image.width, image.height).getContext('2d');"
            "context.drawImage(image, 0, 0);"
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
        link = ("#view=main/stripes%20%26%20more/reference/bright&layout=single&mode=image"
                "&exposure=-1&gain=0&zoom=100&x=11.5&y=5")
        self.open(link)
        self.assertEqual(self.colour(0.5, 0.5), (188, 188, 188), "pixel 11 is 1, one stop darker")
        left, top, width, height = self.page.box(STAGE)
        self.assertEqual(self.colour(0.5 + 100 / width, 0.5), (0, 0, 0),
            "pixel 12, 100 screen pixels to the right, is 0")
        self.press_key("r")
        self.page.evaluate("document.querySelector('#main canvas').focus()")
        self.press_key("r")
        self.page.wait("location.hash.includes('exposure=0')")
        self.assertEqual(self.page.evaluate("location.hash"), link.replace("exposure=-1", "exposure=0"))

    def test_link_in_a_table(self):
        self.open()
        self.page.press(".table a")
        self.page.wait("document.querySelector('#main canvas').ariaLabel.includes('squared error')")
        self.assertIn("bright (relMSE 0.09) left, reference (reference) right",
            self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))

    def test_link_without_names(self):
        self.open("#layout=grid&mode=error&gain=2")
        self.assertEqual(self.label(), "ramp: reference (reference), bright (relMSE 0.09), dark (relMSE 0.02), broken "
            "(relMSE 0); squared error, +2 stops")

    def test_unknown_names_are_passed_over(self):
        self.open("#view=main/no/no/no&layout=no&mode=no&zoom=no&insets=1,2")
        self.assertIn("ramp: bright", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))
        self.open("#view=nobody/%E0%A4%A")
        self.assertIn("ramp: bright", self.page.evaluate("document.querySelector('#main canvas').ariaLabel"))


class SmallScreen(PageTest):
    size = (390, 844)

    def test_nothing_sticks_out(self):
        for hash in ("", "#mode=difference&histogram=1", "#layout=grid&mode=layer&layer=N"):
            self.open(hash)
            self.assertLessEqual(self.page.evaluate("document.documentElement.scrollWidth"), 390, hash)

    def test_tables_wrap_or_scroll(self):
        """Heads of columns wrap; a table that is still too wide scrolls, with a shade that tells so."""
        self.open()
        heads, figures = self.page.evaluate("""[
            [...document.querySelectorAll('.table thead .number')].map(h => getComputedStyle(h).whiteSpace),
            [...document.querySelectorAll('figure.table')].map(f => [f.getBoundingClientRect().right,
                getComputedStyle(f).overflowX, getComputedStyle(f).backgroundAttachment])]""")
        self.assertGreater(len(figures), 0)
        self.assertEqual(set(heads), {"normal"})
        for right, overflow, attachment in figures:
            self.assertLessEqual(right, 390)
            self.assertEqual((overflow, attachment), ("auto", "local, scroll"))

    def test_controls_picture_and_values_are_seen_together(self):
        self.open("#layout=grid&mode=error")
        self.page.evaluate("document.querySelector('#main').scrollIntoView({block: 'start', behavior: 'instant'})")
        self.settle()
        top, bottom, stage = self.page.evaluate("['.head', '.scale', '.stage'].map((q, i) => "
            "document.querySelector('#main ' + q)"
                                                ".getBoundingClientRect()[['top', 'bottom', 'height'][i]])")
        self.assertGreaterEqual(top, 0)
        self.assertLessEqual(bottom, 844)
        self.assertGreaterEqual(stage, 190)

    def test_two_fingers_zoom(self):
        self.open()
        x, y = self.stage_point(0.5, 0.5)

        def touch(kind, *points):
            self.page.command("Input.dispatchTouchEvent", type=kind,
                touchPoints=[{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(points)])
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
        return subprocess.run([os.environ["COVARY"], "view", *arguments], cwd=self.folder.name, capture_output=True,
            text=True, timeout=60, **more)

    def write(self, name, value, size=(4, 3), layers=(), **more):
        channels = {c: [value] * (size[0] * size[1]) for c in "RGB"}
        for layer, numbers in layers:
            channels.update({layer: [numbers] * (size[0] * size[1])})
        (Path(self.folder.name) / name).write_bytes(exr(channels, size, **more))
        return name

    def open_page(self, name, hash=""):
        self.page.open(f"file://{self.folder.name}/{name}{hash}")
        self.page.wait("document.querySelector('.stage canvas').ariaBusy === 'false'")

    def test_images_at_hand(self):
        self.write("a.exr", 0.5), self.write("b.exr", 0.6), self.write("r.exr", 0.5)
        result = self.covary("a.exr", "b.exr", "--reference", "r.exr", "-o", "out.html", "--inset", "1,1,2,1",
            "--title", "Two")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))
        self.page.open(f"file://{self.folder.name}/out.html")
        self.page.wait("document.querySelector('.crops')")
        self.assertEqual(self.page.evaluate("[...document.querySelectorAll('.methods button')].map(b => "
            "b.innerText.replace(/\\s+/g, ' '))"),
                         ["1 r reference", "2 a relMSE 0", "3 b relMSE 0.0385"])

    def test_layers_flip_and_predicted_error(self):
        errors = [(f"StdError.{c}", 0.05) for c in "RGB"]
        others = [(f"N.{c}", 0.5) for c in "XYZ"] + [(f"group00.{c}", 1) for c in "RGB"] + [("depth.Z", 3), ("A", 1)]
        self.write("a.exr", 0.5, layers=errors + others)
        self.write("r.exr", 0.4)
        self.assertEqual(self.covary("a.exr", "-o", "out.html").returncode, 0)
        self.open_page("out.html", "#mode=predicted")
        predicted = 0.05 ** 2 / (0.5 ** 2 + 0.01)
        self.assertIn(f"a (predicted relMSE {predicted:.3g}); predicted error",
            self.page.evaluate("document.querySelector('canvas').ariaLabel"))
        self.assertEqual(self.page.evaluate("[...document.querySelector('[aria-label=\"Layer of the "
            "file\"]').options].map(o => o.value)"),
                         ["", "N", "StdError", "depth.Z"])
        self.page.move(*self.middle())
        self.assertIn(f"predicted error {predicted:.2g}", self.page.text(".pixel"))
        self.assertEqual(self.covary("a.exr", "-r", "r.exr", "-o", "both.html").returncode, 0)
        self.open_page("both.html", "#mode=flip&layout=single")
        self.page.move(*self.middle())
        compared = subprocess.run([os.environ["COVARY"], "compare", "a.exr", "-r", "r.exr", "--metric", "flip",
            "--json", "flip.json"],
                                  cwd=self.folder.name, capture_output=True, text=True, timeout=60)
        self.assertEqual(compared.returncode, 0, compared.stderr)
        flip = float(re.search(r"0\.\d+", compared.stdout)[0])
        self.assertIn(f"FLIP {flip:.2g}", self.page.text(".pixel"))
        self.assertIn(f"relMSE {0.1 ** 2 / (0.4 ** 2 + 0.01):.3g}, predicted {predicted:.3g}",
            self.page.text(".methods"))
        whole = (Path(self.folder.name) / "both.html").stat().st_size
        self.assertEqual(self.covary("a.exr", "-r", "r.exr", "-o", "both.html", "--small").returncode, 0)
        self.assertLess((Path(self.folder.name) / "both.html").stat().st_size, whole)
        self.open_page("both.html")
        self.assertEqual(self.page.evaluate("['flip', 'predicted', 'ssim'].map(m => "
            "document.querySelector(`[data-value=${m}]`).disabled)"),
                         [True, True, False])

    def test_sequences_play_and_keep_what_is_chosen(self):
        for frame in (1, 2, 3):
            self.write(f"a_{frame:02}.exr", frame / 4), self.write(f"b_{frame:02}.exr", 0.1)
        result = self.covary("a_##.exr", "b_##.exr", "-r", "b_02.exr", "-o", "play.html", "--fps", "5")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.open_page("play.html", "#mode=error&layout=single")
        shown = "document.querySelector('canvas').ariaLabel"
        self.assertIn("frame 1: a (relMSE", self.page.evaluate(shown))
        slider, play = "[aria-label=Frame]", "document.querySelector('[title^=\"Play\"]').innerText"
        self.page.evaluate(f"(() => {{ const s = document.querySelector('{slider}'); s.value = 2;"
            "s.dispatchEvent(new Event('input')); })()")
        self.assertIn("frame 3: a (relMSE", self.page.evaluate(shown))
        self.assertIn("error", self.page.evaluate(shown), "the view stays")
        self.page.key("k")
        self.assertEqual(self.page.evaluate(play), "Stop")
        for frame in (1, 2, 3, 1):  # begins again after the last one
            self.page.wait(f"{shown}.startsWith('frame {frame}:')")
        self.page.key("k")
        self.assertEqual(self.page.evaluate(play), "Play")
        self.assertEqual(self.covary("a_##.exr", "-o", "one.html", "--frames", "2-3").returncode, 0)
        self.open_page("one.html")
        self.assertEqual(self.page.evaluate("[...document.querySelector('[aria-label=Scene]').options].map(o => "
            "o.value)"), ["frame 2", "frame 3"])
        self.assertIn("either all images are names with '#', or none",
            self.covary("a_##.exr", "a_01.exr", "-o", "two.html").stderr)
        self.assertIn("--frames needs frames", self.covary("a_01.exr", "-o", "two.html", "--frames", "1").stderr)

    def middle(self):
        left, top, width, height = self.page.box(".stage")
        return left + width / 2, top + height / 2

    def test_everything_fits_a_desktop_window(self):
        self.addCleanup(self.page.resize, *self.size)
        self.page.resize(1400, 900)
        for size in ((128, 72), (64, 96)):
            for name, value in (("a.exr", 0.5), ("b.exr", 0.6), ("c.exr", 0.4), ("r.exr", 0.5)):
                self.write(name, value, size)
            self.assertEqual(self.covary("a.exr", "b.exr", "c.exr", "--reference", "r.exr", "-o",
                "fit.html").returncode, 0)
            for hash in ("", "#mode=error", "#layout=grid&mode=difference"):
                self.open_page("fit.html", hash)
                title, values, scale, stage = self.page.evaluate(
                    "['h1', '.pixel', '.scale', '.stage'].map((q, i) =>"
                    " document.querySelector(q).getBoundingClientRect()[i % 3 ? 'bottom' : 'height'])")
                self.assertLess(title, 30, "a small title")
                self.assertLessEqual(max(values, scale), 900, f"{size} {hash}")
                if "grid" not in hash:
                    self.assertGreater(stage, 0.7 * 900, f"{size} {hash}: the picture has most of the window")

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
        self.assertEqual(result.returncode, 0, "the page is there")
        self.assertIn("no browser could be opened; open ", result.stderr)

    def test_wrong_usage(self):
        self.write("a.exr", 0.5)
        (Path(self.folder.name) / "b.exr").write_bytes(exr({c: [1] * 4 for c in "RGB"}, (2, 2)))
        page = ("a.exr", "-o", "o.html")
        for code, message, *arguments in (
                (2, "must end in .html", "a.exr", "-o", "a.png"),
                (2, "expected X,Y,WIDTH,HEIGHT", *page, "--inset", "1,2"),
                (2, "does not fit into the 4 x 3 pixels", *page, "--inset", "3,0,2,1"),
                (1, "frame of 4 x 3 pixels, b.exr one of 2 x 2", "a.exr", "b.exr", "-o", "o.html")):
            result = self.covary(*arguments)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)
            self.assertFalse((Path(self.folder.name) / "o.html").exists())


if __name__ == "__main__":
    unittest.main()
