# SPDX-License-Identifier: Apache-2.0
"""What commands write: never over their inputs, each other or what others made; in the format that the name tells; as
JSON that any reader takes."""
import json
import os
import subprocess
import threading
import unittest

from cli_test import COVARY, SLOWDOWN, CliTest
from exr_reader import read_exr
from exr_writer import exr, film

WARNING_FREE = {"covary:scene_hash": "abc", "covary:settings": "path max_depth=5; filter box radius=0.5",
                "covary:sampling": "independent"}


class OutputsTest(CliTest):
    def attributed(self, name, seed, rgb=(1, 2, 3), **changes):
        """An image that says where it comes from."""
        attributes = {**WARNING_FREE, "covary:seed": str(seed), **{f"covary:{k}": v for k, v in changes.items()}}
        return self.image(name, rgb, attributes=attributes)


class Overwriting(OutputsTest):
    def setUp(self):
        super().setUp()
        for seed, name in ((1, "a.exr"), (2, "b.exr")):
            self.write(name, film(seed, groups=3))
        self.write("pt.exr", film(3, groups=3, sampling="independent"))
        os.symlink("a.exr", self.path / "link.exr")
        os.link(self.path / "a.exr", self.path / "hard.exr")

    def test_no_input_is_overwritten(self):
        for name in ("a.exr", "./a.exr", "link.exr", "hard.exr"):
            message = f"'{name}' is a file that the same command reads"
            with self.subTest(name):
                self.bad(2, "-o " + message, "merge", "a.exr", "b.exr", "-o", name)
                self.bad(2, "-o " + message, "denoise", "a.exr", "-o", name)
                self.bad(2, "-o " + message, "combine", "--crn", "a.exr", "--independent", "pt.exr", "-o", name)
                self.bad(2, "-o " + message, "combine", "--crn", "b.exr", "--independent", "a.exr", "-o", name)
                self.bad(2, message, "convert", "b.exr", "a.exr", name)
        self.write("a.png", b"picture")
        self.write("list", b"an image without an ending")
        self.bad(2, "--json 'list' is a file that the same command reads", "compare", "list", "-r", "a.exr", "--json",
                 "list")
        self.bad(2, "--error-map 'a.png' is a file that the same command reads", "compare", "a.png", "-r", "a.exr",
                 "--error-map", "a.png")
        self.bad(2, "--error-map 'a.png' is a file that the same command reads", "compare", "b.exr", "-r", "a.exr",
                 "--reference2", "a.png", "--error-map", "a.png")
        self.write("a.html", b"page")
        self.bad(2, "-o 'a.html' is a file that the same command reads", "view", "a.html", "-o", "a.html")

    def test_no_output_is_written_twice(self):
        self.write("x", b"")
        os.symlink("x", self.path / "y.exr")
        self.bad(2, "-o 'y.exr' and --json 'x' are the same file", "combine", "--crn", "a.exr", "--independent",
                 "pt.exr", "-o", "y.exr",
                 "--json", "x")
        self.bad(2, "--json 'o.exr' names an image", "combine", "--crn", "a.exr", "--independent", "pt.exr", "-o",
                 "o.exr", "--json", "o.exr")

    def test_error_maps_replace_only_their_own(self):
        self.image("r.exr", (1, 1, 1))
        maps = ("compare", "a.exr", "b.exr", "-r", "r.exr", "--error-map", "m.png")
        self.write("m-b.png", b"a photograph")
        refused = "already exists, and 'covary compare' did not make it; give another name, or --overwrite"
        self.bad(2, f"--error-map 'm-b.png' {refused}", *maps)
        self.assertFalse((self.path / "m-a.png").exists(), "nothing is written before all names are checked")
        self.good(*maps, "--overwrite")
        self.good(*maps)  # its own
        self.write("given.png", b"a photograph")
        one = ("compare", "a.exr", "-r", "r.exr", "--error-map", "given.png")
        self.bad(2, f"--error-map 'given.png' {refused}", *one)
        self.assertEqual((self.path / "given.png").read_bytes(), b"a photograph")
        self.good(*one, "--overwrite")
        self.bad(2, "--overwrite needs --error-map", *one[:4], "--overwrite")

    def test_convert_replaces_only_its_own(self):
        before = (self.path / "b.exr").read_bytes()
        self.write("photograph.png", b"a photograph")
        self.write("old.hdr", b"#?RADIANCE")
        for names in (("a.exr", "b.exr"), ("a.exr", "pt.exr", "b.exr"), ("a.exr", "photograph.png"),
                      ("a.exr", "old.hdr")):
            self.bad(2, f"the output '{names[-1]}' already exists, and 'covary convert' did not make it; give another "
                     "name, or --overwrite to replace it", "convert", *names)
        self.assertEqual((self.path / "b.exr").read_bytes(), before)
        for name in ("new.exr", "new.png"):
            self.good("convert", "a.exr", name)
            self.good("convert", "b.exr", name)  # its own
        self.good("convert", "--overwrite", "a.exr", "b.exr")
        self.assertNotEqual((self.path / "b.exr").read_bytes(), before)

    def test_results_replace_only_those_of_the_same_command(self):
        self.write("third.exr", film(4, groups=3, sampling="independent", command="covary render x.xml -o third.exr"))
        before = (self.path / "third.exr").read_bytes()
        merge = ("merge", "a.exr", "b.exr")
        combine = ("combine", "--crn", "a.exr", "--independent", "pt.exr", "--force", "--quiet")
        for command in (merge, combine, ("denoise", "a.exr", "b.exr", "--oidn", "off"), ("denoise", "a.exr")):
            self.bad(2, f"-o 'third.exr' already exists, and 'covary {command[0]}' did not make it; give another name, "
                     "or --overwrite to replace it", *command, "-o", "third.exr")
        self.assertEqual((self.path / "third.exr").read_bytes(), before)
        for command in (merge, combine):
            self.good(*command, "-o", "o.exr", "--overwrite")
            self.good(*command, "-o", "o.exr")  # its own
        self.write("empty.exr", b"")  # as mktemp leaves it
        self.good(*merge, "-o", "empty.exr")

    def test_write_protected_files_stay(self):
        self.write("o.exr", b"kept")
        (self.path / "o.exr").chmod(0o444)
        message = "cannot write o.exr: the file there is write-protected"
        self.bad(1, message, "merge", "a.exr", "b.exr", "-o", "o.exr", "--overwrite")
        self.bad(1, message, "convert", "--overwrite", "a.exr", "o.exr")
        self.bad(1, message, "combine", "--crn", "a.exr", "--independent", "pt.exr", "-o", "o.exr")
        self.assertEqual((self.path / "o.exr").read_bytes(), b"kept")

    def test_files_used_twice_are_refused_by_combine(self):
        combine = ("combine", "-o", "o.exr")
        self.bad(2, "--crn 'a.exr' and --independent 'a.exr' are the same file", *combine, "--crn", "a.exr",
                 "--independent", "a.exr")
        self.bad(2, "--crn 'a.exr' and --independent 'link.exr' are the same file", *combine, "--crn", "a.exr",
                 "--independent", "link.exr", "--force")
        self.bad(2, "--crn 'a.exr' and --crn 'a.exr' are the same file", *combine, "--crn", "a.exr", "a.exr", "a.exr",
                 "--independent", "pt.exr")


class Formats(OutputsTest):
    def test_films_are_exr(self):
        self.write("a.exr", film(1, groups=3))
        self.write("b.exr", film(2, groups=3))
        self.write("pt.exr", film(3, groups=3, sampling="independent"))
        for name in ("o.png", "o.jpg", "o.hdr", "o", "o.exr2"):
            message = f"-o '{name}': the name must end in .exr; 'covary convert' makes PNG"
            self.bad(2, message, "merge", "a.exr", "b.exr", "-o", name)
            self.bad(2, message, "denoise", "a.exr", "-o", name)
            self.bad(2, message, "combine", "--crn", "a.exr", "--independent", "pt.exr", "-o", name)
        self.good("merge", "a.exr", "b.exr", "-o", "o.EXR")

    def test_pages_and_pictures(self):
        self.image("a.exr", (1, 1, 1))
        self.bad(2, "-o 'a.htmll': the name must end in .html, .htm", "view", "a.exr", "-o", "a.htmll")
        self.bad(2, "the output 'a.bmp': the name must end in .exr, .png, .hdr, .pfm, .jpg, .jpeg, .tif, .tiff",
                 "convert", "a.exr", "a.bmp")

    def test_convert_writes_what_the_name_says(self):
        values = [0.5 + 0.25 * i for i in range(12)]
        self.write("a.exr", exr({c: values for c in "RGB"}, (4, 3), attributes={"covary:seed": "3",
                                                                                "covary:film": "1"}))
        magic = {"o.png": b"\x89PNG", "o.jpg": b"\xff\xd8", "o.jpeg": b"\xff\xd8", "o.hdr": b"#?RADIANCE",
                 "o.pfm": b"PF\n4 3\n-1.0\n",
                 "o.tif": b"II*\0", "o.TIFF": b"II*\0", "o.exr": b"\x76\x2f\x31\x01"}
        for name, start in magic.items():
            self.good("convert", "a.exr", name)
            self.assertTrue((self.path / name).read_bytes().startswith(start), name)
            error = json.loads(self.good("compare", name, "-r", "a.exr", "-m", "mse", "--json").stdout)["mse"]
            if name in ("o.pfm", "o.tif", "o.TIFF", "o.exr"):
                self.assertEqual(error, 0, name)
            elif name == "o.hdr":
                self.assertLess(error, 1e-3)
        self.assertEqual(read_exr((self.path / "o.exr").read_bytes())["G"], values)
        info = json.loads(self.good("info", "o.exr", "--json").stdout)
        self.assertEqual(info["attributes"]["covary:seed"], "3")
        self.assertEqual(info["attributes"]["covary:film"], "1", "with all channels, a film remains one")
        self.good("convert", "a.exr", "o.exr", "-e", "1")
        info = json.loads(self.good("info", "o.exr", "--json").stdout)
        self.assertNotIn("covary:film", info["attributes"])

    def test_exr_keeps_window_and_exposure(self):
        self.image("crop.exr", (1, 2, 3), size=(10, 8), window=(3, 2, 4, 5))
        self.good("convert", "crop.exr", "brighter.exr", "-e", "1.5")
        self.good("convert", "brighter.exr", "dark.exr", "-e", "-2")
        info = json.loads(self.good("info", "dark.exr", "--json").stdout)
        self.assertEqual((info["frame"], info["window"]), ([10, 8], [3, 2, 4, 5]))
        self.assertEqual(info["attributes"]["covary:exposure"], "-0.5")
        self.assertAlmostEqual(read_exr((self.path / "dark.exr").read_bytes())["B"][0], 3 * 2 ** -0.5, 6)

    def test_pictures_say_who_made_them(self):
        self.image("a.exr", (1, 1, 1))
        self.good("convert", "a.exr", "a.png")
        self.assertRegex((self.path / "a.png").read_bytes(), rb"iTXtSoftware\0{5}covary")

    def test_a_denoised_film_is_no_film(self):
        done = self.run_covary("denoise", self.write("f.exr", film(1)), "-o", "o.exr")
        if done.returncode != 0:
            return self.assertIn("pip install pyoidn", done.stderr)
        attributes = json.loads(self.good("info", "o.exr", "--json").stdout)["attributes"]
        self.assertEqual(attributes["covary:seed"], "1")
        self.assertFalse({"covary:film", "covary:groups"} & set(attributes))


class Special(OutputsTest):
    def setUp(self):
        super().setUp()
        self.write("a.exr", film(1))
        self.write("b.exr", film(2))
        self.good("merge", "a.exr", "b.exr", "-o", "ab.exr")
        self.merged = read_exr((self.path / "ab.exr").read_bytes())

    def test_links_are_followed(self):
        (self.path / "folder").mkdir()
        os.symlink("folder/target.exr", self.path / "link.exr")  # not there yet
        for _ in range(2):
            self.good("merge", "a.exr", "b.exr", "-o", "link.exr")
            self.assertTrue((self.path / "link.exr").is_symlink())
            self.assertEqual(read_exr((self.path / "folder" / "target.exr").read_bytes()), self.merged)
        self.assertEqual([p.name for p in (self.path / "folder").iterdir()], ["target.exr"])

    def test_devices(self):
        self.good("merge", "a.exr", "b.exr", "-o", "/dev/null")
        self.good("convert", "a.exr", "/dev/null")
        self.bad(1, "cannot write /dev/full: No space left on device", "merge", "a.exr", "b.exr", "-o", "/dev/full")
        self.assertFalse(os.path.exists("/dev/null.png"))

    def test_standard_output(self):
        done = subprocess.run([COVARY, "merge", "a.exr", "b.exr", "-o", "/dev/stdout"], cwd=self.path,
                              capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(read_exr(done.stdout), self.merged)

    def test_pipes(self):
        os.mkfifo(self.path / "pipe")
        received = []
        reader = threading.Thread(target=lambda: received.append((self.path / "pipe").read_bytes()))
        reader.start()
        self.good("merge", "a.exr", "b.exr", "-o", "pipe")
        reader.join()
        self.assertEqual(read_exr(received[0]), self.merged)


class Json(OutputsTest):
    NAME = b"caf\xe9.exr"  # Latin-1, as on old disks

    def setUp(self):
        super().setUp()
        (self.path / "plain.exr").write_bytes(film(1, groups=3))
        with open(os.fsencode(self.path) + b"/" + self.NAME, "wb") as file:
            file.write(film(2, groups=3, sampling="independent"))

    def json_of(self, *arguments):
        done = subprocess.run([COVARY, *arguments], cwd=self.path, capture_output=True, timeout=60 * SLOWDOWN)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout.decode("utf-8"))

    def test_names_that_are_not_utf_8(self):
        self.assertEqual(self.json_of("info", self.NAME, "--json")["file"], "caf\ufffd.exr")
        self.assertEqual(self.json_of("compare", self.NAME, "-r", "plain.exr", "--json")["image"], "caf\ufffd.exr")
        output = b"combin\xe9.exr"
        combined = self.json_of("combine", "--crn", "plain.exr", "--independent", self.NAME, "-o", output, "--force",
                                "--quiet", "--json", "-")
        self.assertEqual(combined["output"], "combin\ufffd.exr")
        self.assertTrue(os.path.exists(os.fsencode(self.path) + b"/" + output))
        done = subprocess.run([COVARY, "view", self.NAME, "-o", "page.html"], cwd=self.path, capture_output=True,
                              timeout=60 * SLOWDOWN)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("caf\ufffd", (self.path / "page.html").read_text(encoding="utf-8"))


class Warnings(OutputsTest):
    """What `compare` reads from attributes. Each difference alone gives one warning, in JSON, too."""

    def warnings(self, *arguments):
        done = self.good("compare", *arguments, "--json")
        found = json.loads(done.stdout.splitlines()[0])["warnings"]
        self.assertEqual(done.stderr, "".join(f"warning: {text}\n" for text in found))
        return found

    def test_nothing_to_warn_of(self):
        a, r1, r2 = self.attributed("a.exr", 1), self.attributed("r1.exr", 2), self.attributed("r2.exr", 3)
        self.assertEqual(self.warnings(a, "-r", r1, "--reference2", r2), [])
        self.assertEqual(self.warnings(self.image("other.exr", (1, 1, 1)), "-r", r1), [])

    def test_seeds(self):
        a, r = self.attributed("a.exr", "1,7"), self.attributed("r.exr", 7)
        self.assertEqual(self.warnings(a, "-r", r),
                         ["a.exr and r.exr have seed 7 in common and so share samples, which makes errors between them "
                          "wrong"])
        self.assertEqual(len(self.warnings(self.attributed("b.exr", 9), "-r", r, "--reference2", a)), 1)

    def test_one_file_twice(self):
        a, r = self.attributed("a.exr", 1), self.attributed("r.exr", 2)
        os.symlink("r.exr", self.path / "same.exr")
        self.assertEqual(self.warnings(a, "-r", r, "--reference2", "same.exr"),
                         ["r.exr and same.exr are the same file"])
        self.assertEqual(self.warnings(r, "-r", "same.exr"), ["r.exr and same.exr are the same file"])

    def test_other_scene_settings_filter_exposure_and_precision(self):
        r = self.attributed("r.exr", 2)
        cases = (({"scene_hash": "def"}, "show different scenes"),
                 ({"settings": "path max_depth=6; filter box radius=0.5"},
                  "different settings: 'path max_depth=6' and 'path max_depth=5'"),
                 ({"settings": "path max_depth=5; filter tent radius=1"},
                  "pixel filters: 'tent radius=1' and 'box radius=0.5'"),
                 ({"exposure": "1"}, "different exposures in stops: '1' and '0'"))
        for changes, message in cases:
            found = self.warnings(self.attributed("a.exr", 1, **changes), "-r", r)
            self.assertEqual(len(found), 1, found)
            self.assertIn(message, found[0])
        self.good("convert", r, "a.png")
        found = self.warnings("a.png", "-r", r)
        self.assertEqual(found,
                         ["a.png and r.exr differ in precision: a.png holds uint8 values, rounded and cut off at "
                                 "white"])


    def test_reference_that_is_none(self):
        a, r = self.attributed("a.exr", 1, samples="96"), self.attributed("r.exr", 2, samples="48")
        self.assertEqual(self.warnings(a, "-r", r),
                         ["r.exr has 48 samples per pixel, no more than a.exr with 96: its noise counts as error"])
        noisy = self.attributed("r.exr", 2, samples="200", predicted_relmse="0.008")
        a = self.attributed("a.exr", 1, samples="96", predicted_relmse="0.003")
        self.assertEqual(self.warnings(a, "-r", noisy),
                         ["r.exr has an error of its own, predicted relMSE 0.008 beside 0.003 of a.exr, which is "
                          "counted as a.exr's: render it with more samples, or give two references"])
        good = self.attributed("r.exr", 2, samples="200", predicted_relmse="0.0002")
        self.assertEqual(self.warnings("a.exr", "-r", good), [])
        a, r = self.attributed("a.exr", 1, samples="96"), self.attributed("r.exr", 2, samples="48")
        other = self.attributed("r2.exr", 3, samples="48")
        self.assertEqual(self.warnings(a, "-r", r, "--reference2", other), [], "its noise cancels")
        for changes in ({"denoiser": "Open Image Denoise"}, {"estimator": "iicv --denoise balanced"}):
            r = self.attributed("r.exr", 2, **changes)
            self.assertEqual(self.warnings(a, "-r", r),
                             ["r.exr is denoised, and so biased: it cannot be a reference for errors"])

    def test_parts_of_images(self):
        r = self.attributed("r.exr", 2, settings="bdpt light_tracing=on; filter box radius=0.5")
        cases = (({"film": "1"}, "a.exr lacks the light of its light film"),
                 ({"film": "1", "light_paths_per_sample": "256"}, "a.exr holds light paths alone"),
                 ({"complete": "false"}, "a.exr is of an interrupted render"))
        for changes, message in cases:
            a = self.attributed("a.exr", 1, settings="bdpt light_tracing=on; filter box radius=0.5", **changes)
            found = self.warnings(a, "-r", r)
            self.assertEqual(len(found), 1, found)
            self.assertIn(message, found[0])
            self.assertIn(f"warning: {message}", self.good("view", a, "-o", "page.html").stderr)


class View(OutputsTest):
    def test_warns_as_compare_does(self):
        a, r = self.attributed("a.exr", 7), self.attributed("r.exr", 7, exposure="1", samples="9")
        compared = self.good("compare", a, "-r", r).stderr
        self.assertEqual(compared.count("warning: "), 2)
        self.assertEqual(self.good("view", a, "-r", r, "-o", "page.html").stderr, compared)
        self.assertIn("have seed 7 in common", (self.path / "page.html").read_text())
        self.assertEqual(self.good("view", a, "-o", "page.html").stderr, "")

    def test_without_a_browser(self):
        self.image("a.exr", (1, 1, 1))
        self.addCleanup(lambda: [p.unlink() for p in self.path.glob("covary-view-*")])
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = self.run_covary("view", "a.exr", env={**environment, "TMPDIR": str(self.path)})
        self.assertEqual(done.returncode, 0, "the page is there")
        page = done.stdout.strip()
        self.assertTrue(page.endswith(".html") and os.path.exists(page), done.stdout)
        self.assertIn(f"note: no browser could be opened; open {page} in one", done.stderr)
        self.assertEqual(self.good("view", "a.exr", "-o", "b.html", env=environment).stdout, "")


class Numbers(OutputsTest):
    def test_whole_numbers(self):
        combine = ("combine", "--crn", "a.exr", "--independent", "b.exr", "-o", "o.exr")
        for text in ("0x10", "1e2", "3.0", "three", "9223372036854775808", "2147483648"):
            self.bad(2, f"--set k: '{text}': expected a whole number", *combine, "--set", f"k={text}")
        for text in ("0", "4097", "-1", "0x2", "18446744073709551617"):
            self.bad(2, f"--threads: '{text}': expected a whole number from 1 to 4096", *combine, f"--threads={text}")
        self.bad(2, "--explain '-1,2': expected X,Y", *combine, "--explain=-1,2")
        self.bad(2, "--spp: '0': expected a whole number from 1 to 1073741824", "experiment", "quick", "-o", "o",
                 "--spp", "24,0")
        self.bad(2, "--reference-spp: '4294967296': expected", "experiment", "quick", "-o", "o", "--reference-spp",
                 "4294967296")
        self.bad(2, "--seeds '1,18446744073709551616': expected", "experiment", "quick", "-o", "o", "--seeds",
                 "1,18446744073709551616")
        self.bad(2, "--seeds '0x3': expected", "experiment", "quick", "-o", "o", "--seeds", "0x3")

    def test_zeros_in_front_are_not_octal(self):
        self.write("crn.exr", film(1, groups=3, size=(8, 8)))
        self.write("pt.exr", film(2, groups=3, size=(8, 8), sampling="independent"))
        text = self.good("combine", "--crn", "crn.exr", "--independent", "pt.exr", "-o", "o.exr", "--force",
                         "--quiet", "--set", "k=010",
                         "--json", "-").stdout
        self.assertEqual(json.loads(text)["estimator"], "iicv --set k=10")

    def test_other_numbers(self):
        combine = ("combine", "--crn", "a.exr", "--independent", "b.exr", "-o", "o.exr")
        for text in ("nan", "inf", "-inf", "0x1p3", "1e999", "1.5x"):
            self.bad(2, f"--set ridge: '{text}': expected a number", *combine, "--set", f"ridge={text}")
            self.bad(2, f"--memory: '{text}': expected a number above 0", *combine, f"--memory={text}")
            self.bad(2, f"--time: '{text}': expected a positive number", "experiment", "quick", "-o", "o",
                     f"--time={text}")
            self.bad(2, f"--exposure: '{text}': expected a number from -100 to 100", "convert", "a.exr", "a.png",
                     f"--exposure={text}")
        self.image("a.exr", (1, 1, 1))
        self.good("convert", "a.exr", "a.png", "--exposure=+1.5e0")
        self.bad(2, "--inset '1,2,99999999999999999999,4': expected X,Y,WIDTH,HEIGHT", "view", "a.exr", "-o",
                 "a.html", "--inset",
                 "1,2,99999999999999999999,4")
        self.bad(2, "does not fit into the 4 x 3 pixels", "view", "a.exr", "-o", "a.html", "--inset",
                 "4294967297,0,1,1")

    def test_names(self):
        combine = ("combine", "--crn", "a.exr", "--independent", "b.exr", "-o", "o.exr")
        self.bad(2, "--set penalty: 'foo': expected pilot, sample, asymmetric; see", *combine,
                 "--set", "penalty=foo")
        self.bad(2, "--set penalty: '3': expected pilot", *combine, "--set", "penalty=3")
        self.bad(2, "'sampel': expected pilot, sample, asymmetric; did you mean 'sample'?", *combine,
                 "--set", "penalty=sampel")
        self.bad(2, "--estimator: 'none': expected mixture, iicv, cv-baseline, iduw", *combine, "--estimator", "none")

    def test_a_window_beyond_all_bounds(self):
        self.write("crn.exr", film(1, groups=3))
        self.write("pt.exr", film(2, groups=3, sampling="independent"))
        result = self.bad(2, "--set window: '2147483647': expected an odd whole number from 3 to 63", "combine",
                          "--crn",
                          "crn.exr", "--independent",
                          "pt.exr", "-o", "o.exr", "--set", "window=2147483647")
        self.assertNotIn("k is", result.stderr)


if __name__ == "__main__":
    unittest.main()
