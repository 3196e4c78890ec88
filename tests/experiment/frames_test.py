#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Experiments on scenes with frames, whose numbers are those of `covary compare`."""
import json
import sys
import unittest

from experiment_test import COVARY, SCENES, ExperimentTest


class Sequence(ExperimentTest):
    def setUp(self):
        super().setUp()
        self.suite["scenes"] = [{"name": "room", "file": "room.xml", "resolution": "64x48", "frames": "1-3",
                                 "camera_path": "room-path.json"}]
        self.suite["methods"] = [{"name": "mixture", "options": ["--denoise", "auto", "--oidn", "off"]},
                                 {"name": "history", "options": ["--denoise", "auto", "--oidn", "off", "--history",
                                                                 "on"]}]
        self.suite.update(budgets=[{"spp": 8}], baseline="mixture", seeds=1)
        self.suite["reference"] = {"spp": 64}

    def test_numbers_are_those_of_compare(self):
        results = self.results()
        self.assertTrue(results["complete"])
        images = {cell["method"]: cell["runs"][0]["image"] for cell in results["cells"]}
        references = results["scenes"][0]["reference"]["files"]
        lines = self.run_covary([COVARY, "compare", images["history"], "-r", references[0], "--reference2",
                                 references[1], "--baseline", images["mixture"], "--metric", "relmse,flip",
                                 "--json"]).stdout
        told, cell = json.loads(lines), results["cells"][1]
        self.assertEqual([frame["frame"] for frame in cell["frames"]], [1, 2, 3])
        for name in ("relmse", "flip", "temporal", "temporal_flip"):
            self.assertAlmostEqual(cell[name]["value"], told[name], 6, name)
        for name, region in told["worst_region"].items():
            self.assertAlmostEqual(cell["worst_region"][name], region["ratio"], 6, name)
        for ours, theirs in zip(cell["frames"], told["frames"]):
            for name in ("relmse", "temporal", "temporal_flip"):
                self.assertEqual(ours[name] is None, theirs[name] is None)
                if ours[name] is not None:
                    self.assertAlmostEqual(ours[name], theirs[name], 6)
        mixture = results["cells"][0]
        self.assertAlmostEqual(cell["temporal_gain"]["value"], mixture["temporal"]["value"] / cell["temporal"]["value"])
        report = (self.path / "out" / "report.html").read_text()
        self.assertIn("Changes from frame to frame, 8 spp", report)
        self.assertIn("temporal error of room, 8 spp from the first to the last frame", report)
        # Nothing is rendered again; a camera path of other content is another scene.
        before = {p: p.stat().st_mtime_ns for p in (self.path / "out/cache/runs").glob("*/image_*.exr")}
        self.assertEqual(len(before), 12)
        self.results()
        self.assertEqual({p: p.stat().st_mtime_ns for p in before}, before)

    def test_wrong_input(self):
        self.suite["scenes"][0]["frames"] = "3-1"
        self.bad(2, "scene 'room': frames '3-1': expected FIRST-LAST")
        del self.suite["scenes"][0]["frames"]
        self.bad(2, "scene 'room': 'camera_path' has no effect without 'frames'")
        self.suite["scenes"][0].update(frames="1-2", camera_path="nowhere.json")
        result = self.results(code=1)
        self.assertIn("nowhere.json", result["failures"][0]["message"])


if __name__ == "__main__":
    sys.exit(unittest.main())
