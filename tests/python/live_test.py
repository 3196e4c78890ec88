# SPDX-License-Identifier: Apache-2.0
"""render(live=True) and render_progressively()."""
import contextlib
import io
import json
import re
import sys
import threading
import time
import types
import unittest
import urllib.request

import covary
import numpy
from common import ROOM, PackageTest

SIZE = (36, 24)


def post(address, path, body):
    request = urllib.request.Request(address + path, json.dumps(body).encode(), method="POST")
    with urllib.request.urlopen(request, timeout=10) as answer:
        return json.load(answer)


class Live(PackageTest):
    def setUp(self):
        super().setUp()
        self.scene = covary.Scene.load(ROOM, resolution=SIZE)

    def test_steps_lead_to_the_result(self):
        steps = list(covary.render_progressively(self.scene, 96))
        self.assertGreater(len(steps), 1)
        self.assertTrue(all(step.result is None for step in steps[:-1]))
        last, plain = steps[-1], covary.render(self.scene, 96)
        self.assertIsInstance(last, covary.Step)
        self.assert_same_bits(last.result.image, plain.image)
        self.assert_same_bits(last.image, plain.image)
        self.assertEqual(last.predicted_bounds, plain.predicted_bounds)
        counts = [step.samples_per_pixel for step in steps]
        self.assertEqual(counts, sorted(counts))
        self.assertEqual((counts[-1], steps[0].image.shape), (96, (24, 36, 3)))

    def test_mean_and_its_error(self):
        for step in covary.render_progressively(self.scene, 4096, "none", groups=8):
            if step.std_error is not None:
                break
        grey = step.image.mean(axis=2, keepdims=True, dtype=numpy.float64)
        expected = (step.std_error.astype(numpy.float64) ** 2 / (grey ** 2 + 0.01)).mean()
        self.assertAlmostEqual(step.predicted_relmse / expected, 1, places=4)

    def test_leaving_the_loop_ends_the_render(self):
        start = time.monotonic()
        for step in covary.render_progressively(self.scene, 1 << 29, "none"):
            self.assertGreater(step.samples_per_pixel, 0)
            break
        self.assertLess(time.monotonic() - start, 20)
        self.assertFalse([t for t in threading.enumerate() if "progressively" in t.name])

    def test_errors_are_the_callers(self):
        with self.assertRaisesRegex(covary.UsageError, "expected mixture"):
            list(covary.render_progressively(self.scene, 8, "nothing"))

    def test_page(self):
        """The address is printed; a button ends the render; the bits are those without a page."""
        plain = covary.render(self.scene, 48)
        printed, states = io.StringIO(), []

        def look(done, total):
            address = re.search(r"live: (http\S+)", printed.getvalue())[1]
            states.append(post(address, "state", {"reader": "1", "has": -1}))

        with contextlib.redirect_stderr(printed):
            result = covary.render(self.scene, 48, live=True, progress=look)
        self.assert_same_bits(result.image, plain.image)
        self.assertEqual((states[-1]["kind"], states[-1]["title"]), ("render", "room"))

        def stop(done, total):
            post(re.findall(r"live: (http\S+)", printed.getvalue())[-1], "act", {"do": "stop"})

        with contextlib.redirect_stderr(printed):
            stopped = covary.render(self.scene, 1 << 29, live=True, progress=stop)
        self.assertFalse(stopped.complete)

    def test_notebook(self):
        shown = []
        display = types.SimpleNamespace(display=shown.append, HTML=lambda text: ("html", text),
                                        IFrame=lambda address, width, height: ("frame", address))
        shell = types.SimpleNamespace(kernel=None)
        sys.modules["IPython"] = types.SimpleNamespace(get_ipython=lambda: shell, display=display)
        self.addCleanup(sys.modules.pop, "IPython")
        covary.render(self.scene, 8, "none", live=True)
        self.assertEqual([kind for kind, _ in shown], ["html", "frame"])
        self.assertRegex(shown[1][1], r"^http://127\.0\.0\.1:\d+/[0-9a-f]{32}/$")

    def test_wrong_port(self):
        for port in (0, 65536, "yes"):
            with self.assertRaises((covary.UsageError, TypeError, ValueError)):
                covary.render(self.scene, 8, live=port)


if __name__ == "__main__":
    unittest.main()
