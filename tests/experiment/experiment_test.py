#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Experiments as a user runs them, on a scene of 32 x 24 pixels: results, interruptions, failures, the cache."""
import copy
import csv
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import terminal  # noqa: E402

COVARY = os.environ["COVARY"]
SCENES = Path(__file__).resolve().parents[2] / "scenes"
SUITES = SCENES.parent / "suites"
# Seconds after which a command hangs; sanitizers (scripts/sanitized) are slow.
TIMEOUT = 1200 if "SANITIZED" in os.environ else 120

SUITE = {
    "name": "tiny",
    "scenes": [{"name": "room", "file": "room.xml", "resolution": "32x24"}],
    "methods": [{"name": "pt", "options": ["--estimator", "none"], "unbiased": True},
                {"name": "iicv", "options": ["--estimator", "iicv"]}],
    "budgets": [{"spp": 24}, {"spp": 48}],
    "seeds": 2,
    "common_options": ["--rfilter", "box"],
    "baseline": "pt",
    "reference": {"spp": 128},
}


def catches(pid, sent):
    """Whether the process has a handler for the signal, that is, has begun the work that it saves when interrupted."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False
    mask = next(line for line in status.splitlines() if line.startswith("SigCgt:")).split()[1]
    return bool(int(mask, 16) >> (sent - 1) & 1)


def children(pid):
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def is_render(pid):
    try:
        return b"\0render\0" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def processor_seconds(pid):
    """What the process has used so far; 0 once it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait_for(condition):
    deadline = time.monotonic() + 100
    while not condition():
        assert time.monotonic() < deadline, "nothing happened for 100 s"
        time.sleep(0.005)


def is_locked(path):
    """Whether a process holds the lock. Does not try to take it, which could get in that process's way."""
    locks = [line.split() for line in Path("/proc/locks").read_text().splitlines()]
    return path.exists() and any(lock[5].endswith(f":{path.stat().st_ino}") for lock in locks)


def without_times(value):
    """Results without what depends on the clock, the machine's load and the folder."""
    dropped = {"seconds", "efficiency", "equal_time", "date", "command", "files", "origin", "image",
               "peak_memory_bytes", "equal_processor_time", "processor"}
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k not in dropped}
    if isinstance(value, list):
        return [without_times(v) for v in value if not (isinstance(v, str) and "times its processor time" in v)]
    return value


class ExperimentTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        self.suite = copy.deepcopy(SUITE)

    def command(self, *arguments, out="out"):
        (self.path / "suite.json").write_text(json.dumps(self.suite, indent=1))
        return [COVARY, "experiment", "suite.json", "-o", out, "--scenes", str(SCENES), "--threads", "2", *arguments]

    def run_covary(self, command, **more):
        return subprocess.run(command, cwd=self.path, capture_output=True, text=True, timeout=TIMEOUT, **more)

    def results(self, *arguments, out="out", code=0, **more):
        done = self.run_covary(self.command(*arguments, out=out), **more)
        self.assertEqual(done.returncode, code, done.stderr)
        self.stderr = done.stderr
        return json.loads((self.path / out / "results.json").read_text())

    def bad(self, code, message, *arguments):
        done = self.run_covary(self.command(*arguments))
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(message, done.stderr)

    def runs(self, out="out"):
        """Time stamps of the images in the cache."""
        return {p: p.stat().st_mtime_ns for p in (self.path / out / "cache" / "runs").glob("*/image.exr")}


class Results(ExperimentTest):
    """What one experiment leaves behind."""

    @classmethod
    def setUpClass(cls):
        cls.first = cls()
        cls.first.setUp()
        cls.addClassCleanup(cls.first.doCleanups)
        cls.shared = cls.first.results()

    def setUp(self):
        super().setUp()
        if hasattr(self, "shared"):
            self.path = self.first.path

    def test_numbers(self):
        results = self.shared
        self.assertEqual(results["format"], "covary-experiment 1")
        self.assertTrue(results["complete"])
        self.assertEqual([(c["method"], c["budget"]["spp"]) for c in results["cells"]],
                         [("pt", 24), ("pt", 48), ("iicv", 24), ("iicv", 48)])
        for cell in results["cells"]:
            with self.subTest(cell["method"]):
                self.assertEqual((cell["seeds"], cell["pixels"]), ([1, 2], 32 * 24))
                relmse = cell["relmse"]
                self.assertAlmostEqual(relmse["value"], sum(r["relmse"] for r in cell["runs"]) / 2)
                self.assertAlmostEqual(relmse["value"], relmse["squared_bias"]["value"] + relmse["variance"]["value"])
                self.assertLess(relmse["low"], relmse["value"])
                self.assertAlmostEqual(cell["seconds"]["method"]["value"],
                                       sum(cell["seconds"][k]["value"] for k in ("render", "estimate", "then")))
                self.assertGreater(cell["peak_memory_bytes"], 1e6)
        pt, iicv = results["cells"][1], results["cells"][3]
        self.assertEqual(pt["equal_sample"]["value"], 1)
        self.assertAlmostEqual(iicv["equal_sample"]["value"], pt["relmse"]["value"] / iicv["relmse"]["value"])
        self.assertGreater(iicv["equal_sample"]["value"], 1.5)
        self.assertIsNone(pt["predicted_over_true"]["value"])
        # Ten other pairs of seeds give 0.72 to 1.12, mean 0.97, standard deviation 0.13: four of these to both sides. A
        # prediction that is half or twice as large as it should be is outside.
        self.assertTrue(0.5 < iicv["predicted_over_true"]["value"] < 1.5, iicv["predicted_over_true"])
        self.assertEqual({s["method"] for s in results["slopes"]}, {"pt", "iicv"})
        # The numbers are those of `covary compare`.
        run, files = iicv["runs"][0], results["scenes"][0]["reference"]["files"]
        compared = self.run_covary([COVARY, "compare", run["image"], "--reference", files[0], "--reference2", files[1],
                                    "--metric", "relmse,mse,mae,flip", "--json"])
        for name, value in json.loads(compared.stdout).items():
            if name in ("relmse", "mse", "mae", "flip"):
                self.assertAlmostEqual(run[name], value, places=12)
        # The command line is one that can be typed, and gives the same image.
        again = self.run_covary(run["command"].replace("covary", COVARY, 1).split() + ["-o", "again.exr", "--quiet"])
        self.assertEqual(again.returncode, 0, again.stderr)
        compared = self.run_covary([COVARY, "compare", run["image"], "--reference", "again.exr", "--metric", "mse",
                                    "--json"])
        self.assertEqual(json.loads(compared.stdout)["mse"], 0)

    def test_csv(self):
        results = self.shared
        with open(self.path / "out" / "results.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        values = {(r["method"], r["budget"], r["seed"], r["quantity"]): r for r in rows}
        self.assertEqual(len(values), len(rows))
        for cell in results["cells"]:
            row = values[cell["method"], str(cell["budget"]["spp"]), "", "relmse"]
            self.assertEqual((row["scene"], row["unit"]), ("room", "spp"))
            self.assertEqual(float(row["value"]), cell["relmse"]["value"])
            self.assertEqual(float(row["high"]), cell["relmse"]["high"])
            for run in cell["runs"]:
                row = values[cell["method"], str(cell["budget"]["spp"]), str(run["seed"]), "flip"]
                self.assertEqual(float(row["value"]), run["flip"])
        self.assertIn("<!doctype html>", (self.path / "out" / "report.html").read_text()[:200].lower())

    def test_finished_runs_are_not_run_again(self):
        first, before = self.shared, self.runs()
        self.assertEqual(len(before), 10)
        second = self.results()
        self.assertEqual(self.runs(), before)
        self.assertEqual([c["runs"] for c in second["cells"]], [c["runs"] for c in first["cells"]])  # times, too
        # Another seed only adds to what is there.
        self.suite["seeds"] = [1, 2, 3]
        self.results("--spp", "24")
        after = self.runs()
        self.assertEqual(len(after), 12)
        self.assertEqual({p: t for p, t in after.items() if p in before}, before)
        self.assertEqual(list((self.path / "out" / "cache" / "passes").iterdir()), [])


class Kinds(ExperimentTest):
    def test_time_budget(self):
        self.suite["budgets"] = [{"seconds": 0.2}]
        self.suite["seeds"] = 1
        for cell in self.results()["cells"]:
            spent = cell["seconds"]["over_budget"]
            self.assertAlmostEqual(spent, cell["seconds"]["method"]["value"] / 0.2)
            self.assertIsNone(cell["equal_sample"]["value"])
            self.assertIsNotNone(cell["equal_time"]["value"])
            flagged = [w for w in json.loads((self.path / "out" / "results.json").read_text())["warnings"]
                       if f"{cell['method']}, 0.2 s: took" in w]
            self.assertEqual(bool(flagged), abs(spent - 1) > 0.1, flagged)

    def test_training_counts(self):
        """A method that learns takes no more samples than the others, and its training is part of its time."""
        self.suite["methods"][1] = {"name": "learns", "options": ["--estimator", "none", "--integrator",
                                                                  "controlled-path", "--set", "cv-train=8"]}
        self.suite["budgets"], self.suite["seeds"] = [{"spp": 24}], 1
        learns = next(c for c in self.results()["cells"] if c["method"] == "learns")
        self.assertEqual(learns["samples_per_pixel"], 24)
        self.assertFalse(learns["equal_sample_normalised"])
        facts = [json.loads(p.read_text()) for p in (self.path / "out" / "cache" / "runs").glob("*/*.json")]
        trained = [f for f in facts if f.get("training_samples_per_pixel") == 8]
        self.assertEqual(len(trained), 1)
        self.assertGreaterEqual(learns["seconds"]["render"]["value"], trained[0]["seconds"]["train"])

    def test_later_commands(self):
        more = self.run_covary([COVARY, "render", str(SCENES / "room.xml"), "--resolution", "32x24", "--rfilter", "box",
                                "--spp", "24", "--estimator", "none", "--seed", "99", "-o", "more.exr", "--quiet",
                                "--no-preview"])
        self.assertEqual(more.returncode, 0, more.stderr)
        merge = ["merge", str(self.path / "more.exr")]
        self.suite["methods"][1] = {"name": "merged", "options": ["--estimator", "none"], "then": [merge]}
        self.suite["budgets"], self.suite["seeds"] = [{"spp": 24}], 1
        cells = {c["method"]: c for c in self.results()["cells"]}
        self.assertGreater(cells["merged"]["seconds"]["then"]["value"], 0)
        self.assertLess(cells["merged"]["relmse"]["value"], cells["pt"]["relmse"]["value"])
        self.assertIn(" && covary merge ", cells["merged"]["runs"][0]["command"])


class Parts(ExperimentTest):
    """--part, by processes side by side with one cache."""

    def setUp(self):
        super().setUp()
        self.suite["scenes"].append({"name": "wall", "file": "wall.xml", "resolution": "16x12"})
        self.suite["budgets"] = [{"spp": 24}]

    def test_make_the_whole(self):
        expected = without_times(self.results(out="whole"))
        commands = [self.command("--part", f"{k}/3") for k in (1, 2, 3)]  # writes the suite, which they read
        processes = [subprocess.Popen(command, cwd=self.path, stderr=subprocess.PIPE) for command in commands]
        for process in processes:
            _, errors = process.communicate(timeout=TIMEOUT)
            self.assertEqual(process.returncode, 0, errors)
        self.assertFalse((self.path / "out" / "results.json").exists())
        runs = self.runs()
        self.assertEqual(len(runs), 2 * (2 + 2 * 2))
        self.assertEqual(without_times(self.results()), expected)
        self.assertEqual(self.runs(), runs, "all of them were there")
        self.assertEqual(list((self.path / "out" / "cache" / "passes").iterdir()), [])

    def test_share_nothing(self):
        sizes = []
        for k in (1, 2, 3, 4, 5, 6, 7, 8, 9):
            done = self.run_covary(self.command("--part", f"{k}/9", out=f"out{k}"))
            self.assertEqual(done.returncode, 0, done.stderr)
            sizes.append(len(self.runs(f"out{k}")))
        # Two halves of the reference, then two seeds with two methods each, for both scenes.
        self.assertEqual(sizes, [1, 1, 2, 2, 1, 1, 2, 2, 0])

    def test_failures(self):
        self.suite["methods"].append({"name": "wrong", "options": ["--estimator", "iicv", "--groups", "2"]})
        done = self.run_covary(self.command("--part", "1/1"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("failed: room, wrong, 24 spp: ", done.stderr)
        self.assertIn("2 of the experiment's parts failed; above stands which and why", done.stderr)

    def test_wrong_parts(self):
        for part in ("0/3", "4/3", "3", "a/b", "1/0"):
            self.bad(2, f"--part '{part}'", "--part", part)

    def test_one_and_the_whole_exclude_each_other(self):
        process = subprocess.Popen(self.command("--reference-spp", "100000", "--part", "1/2"), cwd=self.path,
                                   stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: is_locked(self.path / "out" / "cache" / "lock-1-of-2"))
            self.bad(1, "is in use by another experiment")
            self.bad(1, "is in use by another experiment", "--part", "1/2")
        finally:
            process.kill()
            process.wait()


class Resume(ExperimentTest):
    def test_killed_at_random_and_resumed(self):
        self.suite["budgets"] = [{"spp": 24}]
        expected = without_times(self.results(out="whole"))
        random.seed(1)
        killed = 0
        for sent in (signal.SIGKILL, signal.SIGKILL, signal.SIGINT):
            process = subprocess.Popen(self.command(), cwd=self.path, stderr=subprocess.PIPE, text=True)
            wait_for(lambda: catches(process.pid, signal.SIGINT))
            time.sleep(random.uniform(0, 0.5))
            process.send_signal(sent)
            _, errors = process.communicate(timeout=TIMEOUT)
            if sent == signal.SIGINT and process.returncode != 0:
                self.assertEqual(process.returncode, 130, errors)
                self.assertRegex(errors, "interrupted after .* the same command continues")
            killed += process.returncode != 0
        self.assertGreater(killed, 0)
        self.assertEqual(without_times(self.results()), expected)

    def test_interrupted_at_a_terminal(self):
        """Ctrl-C reaches every process of the terminal's foreground group. The render then saves its films."""
        self.suite["budgets"], self.suite["seeds"] = [{"spp": 24}], 1
        long = ("--reference-spp", "4000")
        expected = without_times(self.results(*long, out="whole"))
        command = self.command(*long)
        pid, keyboard = terminal.start(self, command, self.path)
        # Long enough for the first samples, and a small part of the reference.
        wait_for(lambda: any(is_render(child) and catches(child, signal.SIGINT) and processor_seconds(child) > 1
                             for child in children(pid)))
        os.write(keyboard, b"\x03")
        shown, exit_code = terminal.finish(pid, keyboard)
        self.assertEqual(exit_code, 130, shown)
        self.assertIn("interrupted after 0 of", shown)
        films = list((self.path / "out" / "cache" / "passes").glob("*/*.exr"))
        self.assertEqual([film.name for film in films], ["independent.exr"])
        info = self.run_covary([COVARY, "info", str(films[0]), "--json"])
        self.assertEqual(json.loads(info.stdout)["attributes"]["covary:complete"], "false")
        self.assertEqual(without_times(self.results(*long)), expected)

    def test_long_ones_say_how_long(self):
        """Before the first run, with what would take less; Ctrl-C ends it."""
        pid, keyboard = terminal.start(self, self.command("--reference-spp", "1000000"), self.path)
        wait_for(lambda: any(is_render(child) and b"1000000" in Path(f"/proc/{child}/cmdline").read_bytes() and
                             catches(child, signal.SIGINT) for child in children(pid)))
        os.write(keyboard, b"\x03")
        shown, exit_code = terminal.finish(pid, keyboard)
        self.assertEqual(exit_code, 130, shown)
        self.assertRegex(shown, r"about [\d:]+ for \d+ runs, by the speed of path tracing on cores without other work; "
                                r"--quick, --resolution and --reference-spp \(two of 1000000\) take less")
        self.assertRegex(shown, r"\[0/\d+, [\d:]+ left\]")

    def test_optional_methods_are_left_out(self):
        """What the machine lacks is a warning for an optional method, and a failure for any other."""
        self.suite["budgets"], self.suite["seeds"] = [{"spp": 24}], 1
        method = {"name": "oidn", "options": ["--estimator", "none"], "then": [["denoise"]]}
        without = {"env": os.environ | {"COVARY_OIDN": "/nowhere"}}
        self.suite["methods"].append({**method, "optional": True})
        results = self.results("--reference-spp", "64", **without)
        self.assertEqual(results["failures"], [])
        self.assertEqual({cell["method"] for cell in results["cells"]}, {"pt", "iicv"})
        self.assertIn("room: the method 'oidn' is left out: ", "".join(results["warnings"]))
        self.assertIn("/nowhere", "".join(results["warnings"]))
        self.assertIn("At equal samples (24 spp) 'iicv' has the lowest error", self.stderr)
        self.suite["methods"][-1] = method
        self.assertEqual(len(self.results("--reference-spp", "64", code=1, **without)["failures"]), 1)

    def test_passes_are_shared(self):
        self.suite["methods"] += [{"name": "paper", "options": ["--estimator", "iicv", "--paper", "--set", "k=9"]},
                                  {"name": "iduw", "options": ["--estimator=iduw"]},
                                  {"name": "other split", "options": ["--estimator", "iicv", "--split", "3:1"]},
                                  {"name": "polynomials", "options": ["--estimator", "polynomials"]}]
        self.suite["budgets"] = [{"spp": 24}]
        self.suite["seeds"] = 1
        self.results("--keep-passes")
        folders = list((self.path / "out" / "cache" / "passes").iterdir())
        pairs = [f for f in folders if (f / "crn.exr").exists()]
        self.assertEqual(len(pairs), 2)
        self.assertEqual(len(folders) - len(pairs), 2, "films of single passes belong to one method: pt, and the fit")

    def test_one_experiment_at_a_time(self):
        process = subprocess.Popen(self.command("--reference-spp", "100000"), cwd=self.path, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: is_locked(self.path / "out" / "cache" / "lock"))
            self.bad(1, "is in use by another experiment")
        finally:
            process.kill()
            process.wait()


class Failures(ExperimentTest):
    def test_the_rest_goes_on(self):
        (self.path / "gone.xml").write_text("<scene")
        self.suite["scenes"].append({"name": "gone", "file": str(self.path / "gone.xml")})
        self.suite["methods"].append({"name": "wrong", "options": ["--estimator", "iicv", "--groups", "2"]})
        self.suite["methods"].append({"name": "late", "options": ["--estimator", "none"],
                                      "then": [["merge", "nothing.exr"]]})
        self.suite["budgets"] = [{"spp": 24}]
        results = self.results(code=1)
        self.assertFalse(results["complete"])
        self.assertEqual([c["method"] for c in results["cells"]], ["pt", "iicv"])
        failures = {(f["scene"], f["method"]): f for f in results["failures"]}
        self.assertEqual(set(failures), {("gone", ""), ("room", "wrong"), ("room", "late")})
        self.assertIn("gone.xml", failures["gone", ""]["message"])
        self.assertEqual(failures["room", "wrong"]["exit_code"], 2)
        self.assertEqual(failures["room", "wrong"]["runs_not_tried"], 1)
        self.assertIn("2 groups are too few", failures["room", "wrong"]["message"])
        self.assertIn("nothing.exr", failures["room", "late"]["message"])
        self.assertIn("failed: gone", self.stderr)

    def test_scenes_that_are_missing_are_told_at_once(self):
        self.suite["scenes"] += [{"name": name, "file": f"{name}.xml"} for name in ("gone", "away")]
        done = self.run_covary(self.command())
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^covary: 'suite.json': there are no .*gone.xml, no .*away.xml; --scenes names ")
        self.assertFalse((self.path / "out" / "cache").exists())


class Programs(ExperimentTest):
    """Methods of the user's own: commands that make images of what was rendered."""

    def setUp(self):
        super().setUp()
        self.suite["budgets"] = [{"spp": 16}]
        self.suite["methods"] += [{"name": "copy", "options": ["--estimator", "none"], "program": "mine"}]

    def test_makes_the_image(self):
        """A copy has the error of the mean, to the last bit; what the program was told is right."""
        told = self.path / "told.txt"
        copy_it = 'mine=cp "$COVARY_IMAGE" "$COVARY_OUTPUT"; env | grep ^COVARY_ | sort >> "$TOLD"'
        env = os.environ | {"TOLD": str(told)}
        cells = {c["method"]: c for c in self.results("--program", copy_it, env=env)["cells"]}
        self.assertEqual(cells["copy"]["relmse"], cells["pt"]["relmse"])
        self.assertNotEqual(cells["copy"]["relmse"], cells["iicv"]["relmse"])
        lines = told.read_text().splitlines()
        self.assertEqual({line.partition("=")[2] for line in lines if line.startswith("COVARY_SEED=")}, {"1", "2"})
        self.assertEqual({line.partition("=")[2] for line in lines if line.startswith("COVARY_SPP=")}, {"16"})
        self.assertIn(f"COVARY_SCENE={SCENES / 'room.xml'}", lines)
        before = self.runs()
        self.results("--program", copy_it, env=env)
        self.assertEqual(self.runs(), before, "nothing is made again")
        self.results("--program", copy_it.replace("cp ", "cp -p "), env=env)
        self.assertEqual(len(self.runs()), len(before) + 2, "another command, another result")

    def test_a_scene_that_changes_meanwhile_is_told(self):
        scene = self.path / "room.xml"
        scene.write_bytes((SCENES / "room.xml").read_bytes())
        self.suite["scenes"][0]["file"] = str(scene)
        change_it = 'mine=sed -i s/0.78,/0.77,/ "$COVARY_SCENE"; cp "$COVARY_IMAGE" "$COVARY_OUTPUT"'
        results = self.results("--program", change_it, code=1)
        self.assertIn(f"'{scene}' has changed since the experiment began", results["failures"][0]["message"])
        self.assertTrue(self.results("--program", change_it)["complete"])

    def test_a_changed_file_is_another_program(self):
        script = self.path / "mine.sh"
        script.write_text('cp "$COVARY_IMAGE" "$COVARY_OUTPUT"\n')
        self.results("--program", "mine=sh mine.sh")
        before = self.runs()
        script.write_text('cp -p "$COVARY_IMAGE" "$COVARY_OUTPUT"\n')
        self.results("--program", "mine=sh mine.sh")
        self.assertEqual(len(self.runs()), len(before) + 2)

    def test_without_a_suite(self):
        """Each program is a method, with films in groups and auxiliary features."""
        done = self.run_covary([COVARY, "experiment", str(SCENES / "room.xml"), "--print", "--program", "a=true"])
        self.assertEqual(json.loads(done.stdout)["methods"][-1],
                         {"name": "a", "options": ["--estimator", "none", "--groups", "8", "--aovs"], "program": "a"})
        done = self.run_covary([COVARY, "experiment", "room", "--print", "--renderer", "b=true", "--methods-only", "b"])
        suite = json.loads(done.stdout)
        self.assertEqual(suite["methods"][1:], [{"name": "b", "options": [], "program": "b", "renders": False}])
        self.assertEqual(Path(suite["scenes"][0]["file"]).name, "room.xml")
        self.suite["scenes"] = [{"name": "own", "file": "own.xml"}, {"name": "box", "file": "box"}]
        (self.path / "named.json").write_text(json.dumps(self.suite))
        suite = json.loads(self.run_covary([COVARY, "experiment", str(self.path / "named.json"), "--print"]).stdout)
        self.assertEqual([scene["file"] for scene in suite["scenes"]], ["own.xml", str(SCENES / "box.xml")])

    def test_given_images(self):
        """Of which the program says how long they took."""
        copy_it = 'given=cp "$COVARY_SCENE.$COVARY_SEED.exr" "$COVARY_OUTPUT" && echo seconds 12.5'
        failed = self.results("--renderer", copy_it, "--program", 'mine=cp "$COVARY_IMAGE" "$COVARY_OUTPUT"',
                              code=1)["failures"]
        self.assertEqual([failure["method"] for failure in failed], ["given"])
        self.bad(2, "--renderer 'mine' is the name of a --program, too", "--program", "mine=true", "--renderer",
                 "mine=true")

    def test_the_image_of_a_crop_may_be_an_image_of_its_own(self):
        self.suite["scenes"][0]["crop"] = "5,3,16,12"
        cells = {c["method"]: c for c in self.results(
            "--program", f'mine={COVARY} convert "$COVARY_IMAGE" whole.pfm --overwrite && {COVARY} convert whole.pfm '
                         '"$COVARY_OUTPUT" --overwrite')["cells"]}
        self.assertAlmostEqual(cells["copy"]["relmse"]["value"], cells["pt"]["relmse"]["value"], 6)

    def test_given_images_of_another_filter_are_told(self):
        """They would seem worse than what the experiment renders."""
        for seed in ("1", "2"):
            self.run_covary([COVARY, "render", str(SCENES / "room.xml"), "--resolution", "32x24", "--spp", "16",
                             "--seed", seed, "--rfilter", "gaussian", "--estimator", "none", "--no-preview", "-o",
                             str(self.path / f"given-{seed}.exr")])
        self.suite["methods"][-1] = {"name": "copy", "options": [], "program": "mine", "renders": False}
        warnings = self.results("--renderer", f'mine=cp {self.path}/given-$COVARY_SEED.exr "$COVARY_OUTPUT"; '
                                              'echo seconds 1')["warnings"]
        told = [text for text in warnings if "pixel filters" in text]
        self.assertTrue(told, warnings)
        self.assertIn("room: renders of copy and ", told[0])
        self.assertIn("were rendered with different pixel filters: 'gaussian", told[0])

    def test_a_program_that_waits_is_told(self):
        """It takes a thousand seconds by the clock, and hardly any of the processor."""
        results = self.results("--program", 'mine=cp "$COVARY_IMAGE" "$COVARY_OUTPUT"; echo seconds 1000; '
                                            'echo processor_seconds 1e-3')
        told = [text for text in results["warnings"] if text.startswith("room, copy, 16 spp: by the clock it took ")]
        self.assertEqual(len(told), 1, results["warnings"])
        self.assertIn(" times its processor time: the machine was busy with other work, or ", told[0])
        copy = next(cell for cell in results["cells"] if cell["method"] == "copy")
        self.assertLess(copy["equal_time"]["value"], 0.1)
        self.assertGreater(copy["equal_processor_time"]["value"], 0.1)

    def test_a_program_that_tells_its_seconds_alone(self):
        """Its processor time is then unknown, and not that of the command."""
        results = self.results("--program", 'mine=cp "$COVARY_IMAGE" "$COVARY_OUTPUT"; echo seconds 1000')
        copy = next(cell for cell in results["cells"] if cell["method"] == "copy")
        self.assertLess(copy["equal_time"]["value"], 0.1)
        self.assertEqual((copy["seconds"]["processor"]["value"], copy["equal_processor_time"]["value"]), (0, None))
        told = [text for text in results["warnings"] if "processor time" in text]
        self.assertFalse([text for text in told if ", copy," in text], "a busy machine may be told of the others")

    def test_mistakes(self):
        self.bad(2, "method 'copy' is made by a program of your own: give --program mine=COMMAND")
        self.bad(2, "--program 'mine': expected NAME=COMMAND", "--program", "mine")
        self.bad(2, "--program 'mine' is given twice", "--program", "mine=true", "--program", "mine=true")
        failed = self.results("--program", "mine=echo no idea >&2; exit 3", code=1)["failures"]
        self.assertEqual([(f["method"], f["exit_code"], f["message"]) for f in failed], [("copy", 3, "no idea")])
        self.results("--program", "mine=python3 -c 'd = {}; d[5]'", code=1)
        self.assertIn("failed: room, copy, 16 spp: KeyError: 5\n", self.stderr)
        failed = self.results("--program", "mine=true", code=1)["failures"]
        self.assertIn("without writing the image that COVARY_OUTPUT names", failed[0]["message"])
        self.suite["scenes"][0]["frames"] = "1-2"
        self.bad(2, "method 'copy': a program makes single images, not frames", "--program", "mine=true")


class Mistakes(ExperimentTest):
    def test_methods_that_render_refuses(self):
        refused = ((["--estimator", "iidw"], "; did you mean 'iduw' or 'iicv'?"),
                   (["--windwo", "3"], "method 'wrong': unknown option '--windwo'"),
                   (["--estimater", "iicv"], "unknown option '--estimater'; did you mean '--estimator'?"),
                   (["--estimator", "iduw", "--set", "k=3"], "--set k is an option of --estimator iicv, cv-baseline"),
                   (["--set", "k=-3"], "--set k: '-3': expected a whole number of at least 1"))
        for options, message in refused:
            with self.subTest(options):
                self.suite["methods"] = [*SUITE["methods"], {"name": "wrong", "options": options}]
                self.bad(2, message)
                self.bad(2, "method 'wrong': ")
                self.assertFalse((self.path / "out").exists())

    def test_all_at_once_with_lines(self):
        (self.path / "suite.json").write_text('{\n "name": "x",\n "scene": [],\n "methods": [{"nam": "a"}]\n}')
        done = self.run_covary([COVARY, "experiment", "suite.json", "-o", "out"])
        self.assertEqual(done.returncode, 1)
        self.assertIn("suite.json:3: scene: unknown key; did you mean 'scenes'", done.stderr)
        self.assertIn("suite.json:4: methods[0].nam: unknown key; did you mean 'name'", done.stderr)
        self.assertFalse((self.path / "out").exists())

    def test_files_of_others_are_not_replaced(self):
        (self.path / "out").mkdir()
        for name in ("report.html", "results.csv", "results.json"):
            file = self.path / "out" / name
            file.write_text("somebody's")
            self.bad(2, f"-o 'out': out/{name} exists and was not made by an experiment", "--quiet")
            self.assertEqual(file.read_text(), "somebody's")
            file.unlink()
        suite = self.path / "results.json"
        suite.write_text(json.dumps(self.suite))
        done = self.run_covary([COVARY, "experiment", "results.json", "-o", ".", "--scenes", str(SCENES)])
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("-o './results.json' is a file that the same command reads", done.stderr)

    def test_wrong_choices(self):
        self.bad(2, "the suite has no scene 'romo'; did you mean 'room'", "--scenes-only", "romo")
        self.bad(2, "--seeds 'x': expected a number of seeds", "--seeds", "x")
        self.bad(2, "the seed 900000001 is reserved for references", "--seeds", "3,900000001")
        self.bad(1, "crop '99x99' does not fit into the 32 x 24 frame", "--crop", "99x99")
        nowhere = "--scenes 'nowhere': there is no such folder"
        for code, arguments, message in (
                (2, ["qiuck"], "no suite is named 'qiuck'; did you mean 'quick'"),
                (2, [], "no suite given"),
                (2, ["iicv-table1", "-o", "out"],
                 "needs --scenes DIR, the folder that holds bathroom2/scene_v3.xml (`covary scenes iicv-table1` says "
                 "where its scenes come from)"),
                (1, ["iicv-table1", "-o", "out", "--scenes", "nowhere"], nowhere),
                (1, ["iicv", "-o", "out", "--scenes", "nowhere"], nowhere)):
            done = self.run_covary([COVARY, "experiment", *arguments])
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(message, done.stderr)


class Foreign(ExperimentTest):
    """A suite from elsewhere is data: its options name no file, folder, library or server."""

    def refused(self, place, message):
        done = self.run_covary(self.command("--print"))
        self.assertEqual(done.returncode, 1, done.stdout)
        line = done.stderr.splitlines()[0].removeprefix("covary: ")
        self.assertRegex(line, r"^suite\.json:\d+: ")
        number = int(line.split(":")[1])
        self.assertIn(place, line)
        self.assertIn(message, line)
        self.assertEqual(sorted(p.name for p in self.path.iterdir()), ["suite.json"])
        return (self.path / "suite.json").read_text().splitlines()[number - 1]

    def test_options_of_methods(self):
        for option, value, what in (("--oidn", "evil.so", "a library"), ("--save-training", "x", "a file"),
                                    ("--load-training", "x", "a file"), ("--save-stages", "x", "a folder"),
                                    ("--display-server", "example.org:80", "a server"), ("--json", "x", "a file"),
                                    ("--passes", "x", "a folder"),
                                    ("--passes", "x", "a folder"), ("-o", "x", "a file"),
                                    ("--output", "x", "a file")):
            with self.subTest(option):
                for words in [option, value], [option + ("=" if option.startswith("--") else "") + value]:
                    self.suite["methods"] = [*SUITE["methods"], {"name": "evil", "options": ["--aovs", *words]}]
                    line = self.refused("methods[2].options[1]: method 'evil': " + option,
                                        f"'{value}' names {what}, which a suite may not")
                    self.assertIn(words[0], line)

    def test_options_of_all_methods(self):
        self.suite["common_options"] = ["--aovs", "--json", "x"]
        self.refused("common_options[1]: --json", "'x' names a file")
        self.suite["common_options"] = ["other.xml"]  # a scene of its own
        self.bad(2, "'other.xml' belongs to no option")

    def test_commands_after_the_render(self):
        for step, place, message in ((["denoise", "--oidn", "evil.so"], "[0][1]", "--oidn 'evil.so' names a library"),
                                     (["combine", "--crn", "x", "--light", "y"], "[0][1]", "--crn 'x' names a file"),
                                     (["combine", "--force", "--features", "x"], "[0][2]",
                                      "--features 'x' names a file"),
                                     (["convert", "x.exr"], "[0][0]", "-o"),
                                     (["denoise", "-o", "x"], "[0][1]", "-o 'x' names a file"),
                                     (["view", "--quiet"], "[0][0]", "--quiet"),
                                     (["remove"], "[0][0]", "remove")):
            with self.subTest(step):
                self.suite["methods"] = [*SUITE["methods"], {"name": "evil", "then": [step]}]
                self.refused("methods[2].then" + place + ": method 'evil': ", message)

    def test_values_are_allowed(self):
        self.suite["methods"].append(
            {"name": "all", "then": [["denoise", "--clean-features"]],
             "options": ["--denoise", "balanced", "--oidn", "off", "--split", "1:3", "--until", "relmse=0.1", "--crop",
                         "0,0,8,8", "-D", "a=b", "--set", "k=3", "--integrator", "path", "--aovs"]})
        done = self.run_covary(self.command("--print"))
        self.assertEqual((done.returncode, done.stderr), (0, ""))


class References(ExperimentTest):
    def render(self, name, seed, spp=128, rfilter="box", more=()):
        done = self.run_covary([COVARY, "render", str(SCENES / "room.xml"), "--resolution", "32x24", "--rfilter",
                                rfilter,
                                "--estimator", "none", "--seed", str(seed), "--spp", str(spp), "-o", name, "--quiet",
                                "--no-preview", *more])
        self.assertEqual(done.returncode, 0, done.stderr)
        return str(self.path / name)

    def without_attributes(self, path):
        """A copy that does not say how it was made."""
        copy = str(path).replace(".exr", "-unknown.exr")
        done = self.run_covary([COVARY, "convert", "--accept-changed", str(path), copy])
        self.assertEqual(done.returncode, 0, done.stderr)
        return copy

    def test_given_files(self):
        self.suite["budgets"] = [{"spp": 24}]
        a, b = self.render("a.exr", 77), self.render("b.exr", 78)
        results = self.results("--reference", a, b)
        self.assertEqual(results["scenes"][0]["reference"]["files"], [a, b])
        # A seed that a run has, too.
        reused = self.render("c.exr", 2)
        results = self.results("--reference", a, reused, code=1)
        self.assertIn("the seed 2 is also that of a run", results["failures"][0]["message"])
        self.assertEqual(results["cells"], [])

    def test_what_given_files_say(self):
        self.suite["budgets"], self.suite["seeds"] = [{"spp": 24}], 1
        self.suite["methods"].pop()
        shallow = self.render("shallow.exr", 77, more=("--max-depth", "2"))
        narrow = self.render("tent.exr", 78, rfilter="tent")
        warnings = self.results("--reference", shallow, narrow)["warnings"]
        for text in (f"room: {shallow} and {narrow} were rendered with different settings",
                     f"room: renders of pt and {shallow} were rendered with "
                     "different settings: 'path ",
                     f"room: renders of pt and {narrow} were rendered with different pixel filters"):
            self.assertTrue(any(text in w for w in warnings), warnings)
        # Nothing tells the seeds of this one, but that it is one file.
        unknown = self.without_attributes(shallow)
        failures = self.results("--reference", unknown, unknown, code=1)["failures"]
        self.assertIn("is given as both halves of the reference", failures[0]["message"])

    def test_unknown_seeds_show_in_the_numbers(self):
        """Without attributes nothing says which seeds a reference has; its noise does."""
        self.suite["budgets"] = [{"spp": 48}]
        self.suite["seeds"] = 3
        self.suite["methods"].pop()
        self.suite["scenes"][0]["resolution"] = "64x48"
        names = []
        for name, seed in (("a", 77), ("b", 2)):
            done = self.run_covary([COVARY, "render", str(SCENES / "room.xml"), "--resolution", "64x48", "--rfilter",
                                    "box", "--estimator", "none", "--seed", str(seed), "--spp", "128", "-o",
                                    name + ".exr", "--quiet", "--no-preview"])
            self.assertEqual(done.returncode, 0, done.stderr)
            names.append(self.without_attributes(self.path / (name + ".exr")))
        results = self.results("--reference", *names)
        self.assertTrue(any("pt, 48 spp: render 2 leans to the second reference" in w for w in results["warnings"]),
                        results["warnings"])


class BuiltIn(ExperimentTest):
    def test_list(self):
        lines = self.run_covary([COVARY, "experiment", "--list"]).stdout.splitlines()
        self.assertTrue(all(line[20] == " " != line[21] for line in lines), "in columns")
        names = [line.split()[0] for line in lines]
        self.assertEqual(set(names), {path.stem for path in [*SUITES.glob("*.json"), *SUITES.glob("papers/*.json")]})
        done = self.run_covary([COVARY, "experiment", "iicv-table1", "--print", "--scenes-only", "house", "--seeds",
                                "2"])
        suite = json.loads(done.stdout)
        self.assertEqual(([s["name"] for s in suite["scenes"]], suite["seeds"]), (["house"], [1, 2]))

    def test_names_with_commas_can_be_chosen(self):
        done = self.run_covary([COVARY, "experiment", "guiding-scenes", "--print", "--methods-only", "path",
                                "guided, cv rgb"])
        self.assertEqual([m["name"] for m in json.loads(done.stdout)["methods"]], ["path", "guided, cv rgb"])
        done = self.run_covary([COVARY, "experiment", "room", "--print", "--methods-only", "pt,default,iicv"])
        self.assertEqual([m["name"] for m in json.loads(done.stdout)["methods"]], ["pt", "default", "iicv"])
        done = self.run_covary([COVARY, "experiment", "room", "--print", "--methods-only", "pt,iicvv"])
        self.assertIn("the suite has no method 'iicvv'; did you mean 'iicv'", done.stderr)

    def test_a_folder_is_refused_with_its_scenes(self):
        (self.path / "kitchen" / "more").mkdir(parents=True)
        for name in ("scene_v3.xml", "more/scene.pbrt", "notes.txt"):
            (self.path / "kitchen" / name).write_text("")
        for command in (("experiment", "kitchen", "--print"), ("render", "kitchen", "-o", "a.exr")):
            done = self.run_covary([COVARY, *command])
            self.assertEqual(done.returncode, 2)
            self.assertIn("'kitchen' is a folder, not a scene; give one that it holds: kitchen/scene_v3.xml "
                          "kitchen/more/scene.pbrt\n", done.stderr)

    def test_a_comma_too_many(self):
        (self.path / "s.json").write_text('{\n "budgets": [{"spp": 4},\n ]\n}')
        done = self.run_covary([COVARY, "experiment", "s.json", "--print"])
        self.assertIn("s.json:3:2: not JSON: no comma may stand before the end of a list or object; ", done.stderr)
        self.assertIn("; the line is ' ]'\n", done.stderr)

    def test_the_help_shows_what_is_usual(self):
        text = self.run_covary([COVARY, "experiment", "--help"]).stdout
        for option in ("--spp", "--time", "--seeds", "--methods-only", "--baseline"):
            self.assertIn(option + " ", text)

    def test_one_scene(self):
        done = self.run_covary([COVARY, "experiment", str(SCENES / "room.xml"), "--quick", "-o", "out", "--resolution",
                                "24x16", "--seeds", "1", "--spp", "24", "--reference-spp", "32", "--quiet"])
        self.assertEqual(done.returncode, 0, done.stderr)
        results = json.loads((self.path / "out" / "results.json").read_text())
        left_out = {"oidn"} if any("'oidn' is left out" in text for text in results["warnings"]) else set()
        self.assertEqual({c["method"] for c in results["cells"]},
                         {"pt", "oidn", "default", "own filters", "balanced", "iicv", "iicv, error", "bdpt",
                          "controlled", "guided"} - left_out)
        self.assertEqual(results["scenes"][0]["name"], "room")

    def test_quick_scales_frames_down(self):
        done = self.run_covary([COVARY, "experiment", str(SCENES / "room.xml"), "--quick", "--methods-only", "pt",
                                "--spp", "4", "--seeds", "1", "--reference-spp", "4", "-o", "out"])
        self.assertEqual(done.returncode, 0, done.stderr)
        width, height = json.loads((self.path / "out" / "results.json").read_text())["scenes"][0]["frame"]
        self.assertEqual((width, height), (220, 146))


class Papers(ExperimentTest):
    """A paper's tables and figures, as small as can be."""

    def paper(self, *arguments, out="out"):
        small = ("--seeds", "1", "--threads", "2", "--resolution", "16x12")
        few = () if "--reference-spp" in arguments else ("--reference-spp", "16")
        return self.run_covary([COVARY, "experiment", *arguments, *small, *few, "-o", out])

    def test_parts_make_one_report_and_go_on(self):
        scenes = self.path / "scenes"
        (scenes / "bathroom2").mkdir(parents=True)
        (scenes / "bathroom2" / "scene_v3.xml").write_text((SCENES / "room.xml").read_text())
        command = ("iicv", "--only", "fig6,fig12", "--scenes", str(scenes), "--quick", "--spp", "24", "--crop", "16x12",
                   "--methods-only", "pt", "iicv-paper", "iicv-paper 1:1")
        done = self.paper(*command)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("of the paper's scenes are missing in", done.stderr)
        self.assertIn("  glass-of-water/scene_v3.xml, in fig", done.stderr)
        self.assertIn("Scenes of covary take their place in fig2", done.stderr)
        self.assertRegex(done.stderr, r"fig6 +about +\S+.*, \d+ runs: Fig\. 6")
        self.assertRegex(done.stderr, r"together +about ")
        data = json.loads((self.path / "out" / "results.json").read_text())
        self.assertEqual(data["paper"], "iicv")
        parts = {part["names"][0]: part for part in data["parts"]}
        self.assertEqual((set(parts), parts["fig2"]["own_scenes"]), ({"fig6", "fig2"}, True))
        self.assertEqual([s["name"] for s in parts["fig2"]["results"]["scenes"]], ["room", "materials"])
        page = (self.path / "out" / "report.html").read_text()
        self.assertIn("fig2-summary", page)
        for name in ("fig2", "fig6"):
            for file in ("report.html", "results.json", "results.csv"):
                self.assertTrue((self.path / "out" / name / file).exists(), (name, file))
        runs = self.runs()
        done = self.paper(*command)
        self.assertEqual((done.returncode, self.runs()), (0, runs), done.stderr)
        self.assertRegex(done.stderr, r"fig6 +about +0:00, (\d+) runs, \1 made before")

    def test_estimate_of_parts_that_train(self):
        """So few samples as are tried first are all training."""
        parts = ("controlled-mixtures", "--only", "fig7", "--scenes-only", "room, Edges02", "--methods-only", "off",
                 "--spp", "32")
        done = self.paper(*parts, "--reference-spp", "64")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"fig7 +about +0:0[1-9], 3 runs: Fig\. 7")
        self.assertNotIn("do not render", done.stderr)
        done = self.paper(*parts, "--reference-spp", "16", out="few")
        self.assertIn("without scenes that do not render: room, Edges02: 16 samples per pixel, of which the training "
                      "takes 16, leave none", done.stderr)

    def test_mistakes(self):
        for message, *words in (
                ("'iicv' has no part 'tabel1'; did you mean 'table1'", "iicv", "--only", "tabel1"),
                ("--only chooses parts of a paper (controlled-mixtures, dependent-tests, iicv); 'quick' is a suite",
                 "quick", "--only", "table1"),
                ("--size renders whole frames; give it without --crop and --resolution", "iicv", "--size", "64x36"),
                ("did you mean 'iicv'", "iicw")):
            done = self.paper(*words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(message, done.stderr)

    def test_size_renders_whole_frames(self):
        command = [COVARY, "experiment", "dependent-tests", "--only", "fig1"]
        done = self.run_covary([*command, "--size", "20x20", "--print"])
        for scene in json.loads(done.stdout)[0]["scenes"]:
            self.assertNotIn("resolution", scene)
        done = self.run_covary([*command, "--size", "24x16", "--spp", "4", "--seeds", "1", "--reference-spp", "4",
                                "--methods-only", "dependent", "--scenes-only", "box", "-o", "out"])
        self.assertEqual(done.returncode, 0, done.stderr)
        results = json.loads((self.path / "out" / "fig1" / "results.json").read_text())
        self.assertEqual(results["scenes"][0]["frame"], [19, 19], "in the scene's own shape")


if __name__ == "__main__":
    unittest.main()
