# SPDX-License-Identifier: Apache-2.0
"""covary render --live and covary view --live as a reader uses them, in headless Chromium, and as strangers would like
to use them."""
import http.client
import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

for folder in ("report", "cli"):
    sys.path.insert(0, str(Path(__file__).parent.parent / folder))
from browser import Browser  # noqa: E402
from exr_reader import read_exr  # noqa: E402
from exr_writer import exr  # noqa: E402

ROOM = str(Path(os.environ["SCENES"]) / "room.xml")
SIZE = (96, 64)
ENDLESS = "1000000"  # samples that no test waits for
PATIENCE = 60


class Program:
    """A command with --live, its address read from what it says."""

    def __init__(self, folder, *words):
        self.process = subprocess.Popen([os.environ["COVARY"], *words], cwd=folder, stderr=subprocess.PIPE,
                                        stdout=subprocess.DEVNULL, text=True,
                                        env={k: v for k, v in os.environ.items() if k not in ("DISPLAY",
                                                                                              "WAYLAND_DISPLAY")})
        self.said = ""
        while True:
            line = self.process.stderr.readline()
            self.said += line
            found = re.match(r"live: (http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/)$", line.rstrip())
            if found:
                break
            if not line:
                raise AssertionError(f"no address; the program said: {self.said}")
        self.address, self.port, self.token = found[1], int(found[2]), found[3]
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.said += line

    def wait(self):
        code = self.process.wait(PATIENCE)
        self.reader.join(PATIENCE)
        return code

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
        self.wait()
        self.process.stderr.close()

    def ask(self, path, method="GET", body=None, **header):
        """(status, body) of a request, with any Host and Origin."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        connection.putrequest(method, path, skip_host="Host" in header, skip_accept_encoding=True)
        data = b"" if body is None else json.dumps(body).encode()
        for name, value in {"Content-Length": str(len(data)), **header}.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(data)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content

    def state(self, has=-1, reader="test"):
        status, body = self.ask(f"/{self.token}/state", "POST", {"reader": reader, "has": has})
        assert status == 200, body
        return json.loads(body)

    def act(self, what, **more):
        status, body = self.ask(f"/{self.token}/act", "POST", {"do": what, **more})
        assert status == 200, body

    def until(self, condition):
        """The first state for which the condition holds, asked as a reader who takes everything."""
        deadline, state = time.monotonic() + PATIENCE, self.state()
        while not condition(state):
            if time.monotonic() > deadline:
                raise AssertionError(f"the state is {state}")
            time.sleep(0.02)
            state = self.state(state["version"])
        return state

    def image(self, name, info):
        """[channel][pixel] of an image."""
        status, data = self.ask(f"/{self.token}/image/{name}")
        assert status == 200
        n = info["width"] * info["height"]
        values = struct.unpack(f"<{len(data) // 2}e", data)
        return [list(values[c * n:(c + 1) * n]) for c in range(info["channels"])]


def half(values):
    return list(struct.unpack(f"<{len(values)}e", struct.pack(f"<{len(values)}e", *values)))


class LiveTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def start(self, *options, name="out.exr", live=("--live",)):
        program = Program(self.folder, "render", ROOM, "-o", name, "--resolution", f"{SIZE[0]}x{SIZE[1]}",
                          "--no-preview", *live, *options)
        self.addCleanup(program.end)
        return program

    def render(self, name, *options, code=0):
        result = subprocess.run([os.environ["COVARY"], "render", ROOM, "-o", name, "--resolution",
                                 f"{SIZE[0]}x{SIZE[1]}", "--no-preview", "--quiet", *options], cwd=self.folder,
                                capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(result.returncode, code, result.stderr)
        return self.pixels(name)

    def render_frame(self, frame):
        path = str(Path(ROOM).parent / "room-path.json")
        subprocess.run([os.environ["COVARY"], "render", ROOM, "-o", "f_#.exr", "--resolution", f"{SIZE[0]}x{SIZE[1]}",
                        "--frames", frame, "--camera-path", path, "--spp", "8", "--estimator", "none", "--quiet",
                        "--no-preview"], cwd=self.folder, check=True, timeout=PATIENCE)

    def pixels(self, name):
        channels = read_exr((self.folder / name).read_bytes())
        return [channels[c] for c in "RGB"]

    def open(self, program, size=(1200, 900)):
        page = Browser(size)
        self.addCleanup(page.__exit__)
        self.addCleanup(lambda: self.assertEqual(page.errors, [], "errors of the page"))
        page.open(program.address)
        return page

    def paused(self, *options):
        program = self.start(*options)
        program.until(lambda state: state.get("done", 0) > 0)
        program.act("pause")
        return program

    def shown(self, page):
        """What the stage shows, in words."""
        page.wait("document.querySelector('.comparer canvas')")
        return page.evaluate("document.querySelector('.comparer canvas').ariaLabel")

    def press(self, page, text):
        page.wait(f"[...document.querySelectorAll('.buttons button')].some(b => b.innerText === '{text}' "
                  "&& !b.disabled && !b.hidden)")
        page.evaluate(f"[...document.querySelectorAll('.buttons button')].find(b => b.innerText === '{text}').click()")


class Picture(LiveTest):
    def test_first_picture_refresh_and_wipe(self):
        start = time.monotonic()
        program = self.start("--spp", ENDLESS)
        first = program.until(lambda state: state["pictures"])
        self.assertLess(time.monotonic() - start, 2)
        self.assertEqual([p["name"] for p in first["pictures"]], ["Mean", "Denoised"])
        page = self.open(program)
        page.wait("document.querySelector('.numbers').innerText.includes('samples per second')")
        self.assertRegex(self.shown(page), r"^room: Mean \(.*\) left, Denoised \(.*\) right; picture")
        page.wait("/Mean \\([\\d.e+]+ samples per pixel, predicted relMSE/.test("
                  "document.querySelector('.comparer canvas').ariaLabel)")
        before = self.shown(page)
        page.wait(f"document.querySelector('.comparer canvas').ariaLabel !== {json.dumps(before)}")
        # The wipe, by the keyboard.
        page.evaluate("document.querySelector('.handle').focus()")
        page.key("ArrowLeft")
        self.assertEqual(page.evaluate("document.querySelector('.handle').ariaValueNow"), "48")
        # The error map, its values, and the plot.
        page.evaluate("document.querySelector('.comparer canvas').focus()")
        page.key("u")
        page.wait("document.querySelector('.comparer canvas').ariaLabel.includes('predicted')")
        page.wait("document.querySelector('.plot canvas')")
        self.assertIn("Predicted relMSE", page.text(".plot figcaption"))
        left, top, width, height = page.box(".stage")
        page.move(left + width * 0.3, top + height / 2)
        page.wait("/x \\d+, y \\d+/.test(document.querySelector('.pixel').innerText)")
        self.assertIn("predicted error", page.text(".pixel"))

    def test_bits_and_last_picture(self):
        """The image has the same bits without a page; the page ends with it."""
        plain = self.render("plain.exr", "--spp", "96")
        program = self.start("--spp", "96")
        last = program.until(lambda state: state.get("ended"))
        images = {p["id"]: program.image(p["id"], last["images"][p["id"]]) for p in last["pictures"]}
        program.state(last["version"])
        self.assertEqual(program.wait(), 0, program.said)
        self.assertEqual(self.pixels("out.exr"), plain)
        self.assertEqual(last["ended"], "'out.exr' is complete.")
        self.assertEqual(images["picture"], [half(channel) for channel in plain])
        self.assertFalse((self.folder / "out.passes").exists())

    def test_methods_have_the_same_bits(self):
        for options in (("--estimator", "none"), ("--estimator", "iicv"), ("--estimator", "polynomials"),
                        ("--integrator", "bdpt"), ("--adaptive",), ("--until", "relmse=0.01"),
                        ("--sampler", "sobol", "--crop", "10,20,30,16")):
            with self.subTest(options):
                plain = self.render("plain.exr", "--overwrite", "--spp", "96", *options)
                program = self.start("--overwrite", "--spp", "96", *options)
                last = program.until(lambda state: state.get("ended"))
                program.state(last["version"])
                program.wait()
                self.assertEqual(self.pixels("out.exr"), plain, program.said)

    def test_adaptive_pairs_are_combined_on_the_way(self):
        """The filtered and combined image of dependent tests, while its second pass goes on."""
        program = self.start("--estimator", "dependent-tests", "--paper", "--set", "dependent-spp=8", "--spp", ENDLESS)
        state = program.until(lambda state: len(state["pictures"]) == 2 and "samples" in state["pictures"][1]["label"])
        self.assertEqual([p["name"] for p in state["pictures"]], ["Mean", "Image"])
        self.assertNotIn("ended", state)
        shown = program.image("picture", state["images"]["picture"])
        self.assertEqual((len(shown), len(shown[0])), (3, SIZE[0] * SIZE[1]))
        mean = sum(map(sum, shown)) / (3 * len(shown[0]))
        reference = self.render("mean.exr", "--estimator", "none", "--spp", "64")
        self.assertAlmostEqual(mean, sum(map(sum, reference)) / (3 * len(reference[0])), delta=0.1 * mean)

    def test_phone(self):
        page = self.open(self.start("--spp", ENDLESS), (390, 844))
        self.shown(page)
        self.assertLessEqual(page.evaluate("document.documentElement.scrollWidth"), 390)

    def test_two_readers(self):
        program = self.start("--spp", ENDLESS)
        pages = [self.open(program), self.open(program)]
        for page in pages:
            page.wait("/Mean \\([\\d.e+]+ samples/.test(document.querySelector('.comparer canvas')?.ariaLabel)")
        self.press(pages[0], "Pause")
        pages[1].wait("document.querySelector('.phase').innerText === 'paused'")


class Buttons(LiveTest):
    def test_stop_and_write_then_resume(self):
        whole = self.render("whole.exr", "--spp", "512", "--estimator", "none")
        program = self.paused("--spp", "512", "--estimator", "none")
        page = self.open(program)
        self.shown(page)
        self.press(page, "Stop and write")
        page.wait("document.querySelector('.phase').innerText.startsWith('stopped after')")
        self.assertEqual(program.wait(), 0, program.said)
        self.assertRegex(program.said, r"stopped after [\d.]+ of 512 samples per pixel; 'out.exr' is the image so far")
        stopped = self.pixels("out.exr")
        self.assertNotEqual(stopped, whole)
        self.assertEqual(self.render("out.exr", "--spp", "512", "--estimator", "none", "--resume"), whole)

    def test_stopped_file_is_what_the_page_shows(self):
        program = self.start("--spp", ENDLESS)
        program.until(lambda state: state.get("samples_per_pixel", 0) >= 48)
        program.act("stop")
        last = program.until(lambda state: state.get("ended"))
        shown = program.image("picture", last["images"]["picture"])
        program.state(last["version"])
        self.assertEqual(program.wait(), 0, program.said)
        self.assertEqual(shown, [half(channel) for channel in self.pixels("out.exr")])
        info = subprocess.run([os.environ["COVARY"], "info", "out.exr"], cwd=self.folder, capture_output=True,
                              text=True)
        self.assertIn("false", re.search(r"covary:complete.*", info.stdout)[0])

    def test_pause(self):
        program = self.start("--spp", ENDLESS)
        program.until(lambda state: state.get("done", 0) > 0)
        program.act("pause")
        time.sleep(0.5)
        done = program.until(lambda state: state.get("paused"))["done"]
        time.sleep(0.5)
        self.assertEqual(program.state()["done"], done)
        program.act("go")
        program.until(lambda state: state["done"] > done and not state["paused"])

    def test_more_samples(self):
        """As if the finished render had been continued with twice the samples."""
        self.render("plain.exr", "--spp", "64", "--estimator", "none")
        plain = self.render("plain.exr", "--spp", "128", "--estimator", "none", "--resume")
        program = self.start("--spp", "64", "--estimator", "none", "--threads", "1")
        program.until(lambda state: state.get("can", {}).get("more"))
        program.act("more")
        program.until(lambda state: state["spp"] == 128)
        last = program.until(lambda state: state.get("ended"))
        program.state(last["version"])
        self.assertEqual(program.wait(), 0, program.said)
        self.assertEqual(self.pixels("out.exr"), plain)

    def test_raised_goal(self):
        program = self.start("--until", "relmse=0.02", "--spp", ENDLESS)
        program.until(lambda state: state.get("can", {}).get("raise"))
        program.act("raise")
        last = program.until(lambda state: state.get("ended"))
        self.assertEqual(last["until"], 0.01)
        error = [error for error in last["errors"] if error["of"] == "picture"][-1]
        self.assertLessEqual(error["relmse"], 0.01)
        self.assertTrue(error["low"] < error["relmse"] < error["high"])
        program.state(last["version"])
        self.assertEqual(program.wait(), 0, program.said)

    def test_region_first(self):
        whole = self.render("whole.exr", "--spp", "512", "--estimator", "none")
        program = self.paused("--spp", "512", "--estimator", "none")
        page = self.open(program)
        self.shown(page)
        page.evaluate("document.querySelector('.comparer canvas').focus()")
        page.key("+")
        page.key("+")
        self.press(page, "This region first")
        x, y, w, h = program.until(lambda state: state["region"])["region"]
        self.assertTrue(0 <= x and 0 <= y and x + w <= SIZE[0] and y + h <= SIZE[1] and w * h < SIZE[0] * SIZE[1])
        before = program.state()["done"]
        self.press(page, "Go on")
        program.until(lambda state: state["done"] > before + 16 * SIZE[0] * SIZE[1] + 100 * w * h)
        program.act("stop")
        last = program.until(lambda state: state.get("ended"))
        program.state(last["version"])
        self.assertEqual(program.wait(), 0, program.said)
        counts = read_exr((self.folder / "out.exr").read_bytes())["samples"]
        inside = [counts[j * SIZE[0] + i] for j in range(y, y + h) for i in range(x, x + w)]
        outside = [counts[j * SIZE[0] + i] for j in range(SIZE[1]) for i in range(SIZE[0])
                   if not (x <= i < x + w and y <= j < y + h)]
        self.assertGreater(min(inside), max(outside))
        self.assertEqual(self.render("out.exr", "--spp", "512", "--estimator", "none", "--resume"), whole)


class Ends(LiveTest):
    def test_killed(self):
        program = self.start("--spp", ENDLESS)
        page = self.open(program)
        self.shown(page)
        program.process.kill()
        page.wait("document.querySelector('.phase').classList.contains('lost')")
        self.assertIn("This is the last picture.", page.text(".phase"))
        self.assertTrue(page.text(".phase code").endswith("--resume"))
        self.assertTrue(page.evaluate("[...document.querySelectorAll('.buttons button')].every(b => b.disabled)"))
        self.assertTrue(page.evaluate("(() => { const c = document.querySelector('.stage canvas');"
                                      "return c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data[3]"
                                      " > 0; })()"))

    def test_interrupted(self):
        program = self.start("--spp", ENDLESS)
        page = self.open(program)
        self.shown(page)
        program.process.send_signal(signal.SIGINT)
        page.wait("document.querySelector('.phase').innerText.startsWith('interrupted after')")
        self.assertEqual(program.wait(), 130)

    def test_closes_with_the_render(self):
        program = self.start("--spp", "16")
        self.assertEqual(program.wait(), 0, program.said)
        with self.assertRaises(ConnectionRefusedError):
            program.ask("/")


class Strangers(LiveTest):
    def test_only_the_reader_is_answered(self):
        program = self.start("--spp", ENDLESS)
        own = f"/{program.token}/"
        self.assertEqual(program.ask(own)[0], 200)
        self.assertEqual(program.ask("/")[0], 403)
        self.assertEqual(program.ask(f"/{'0' * 32}/")[0], 403)
        self.assertEqual(program.ask(f"/{'0' * 32}/act", "POST", {"do": "stop"})[0], 403)
        self.assertEqual(program.ask(own, Host="evil.example")[0], 403)
        self.assertEqual(program.ask(own + "act", "POST", {"do": "stop"}, Origin="http://evil.example")[0], 403)
        self.assertEqual(program.ask(own + "act", "POST", {"do": "stop"}, Origin="null")[0], 403)
        for path in ("../../etc/passwd", "image/../../../../etc/passwd", "%2e%2e/%2e%2e/etc/passwd", "out.exr",
                     "image//etc/passwd", "image/%2fetc%2fpasswd"):
            status, body = program.ask(own + path)
            self.assertEqual((status, body), (404, b"not found\n"), path)
        self.assertEqual(program.ask(own + "state", "POST")[0], 400)
        self.assertIsNone(program.process.poll())

    def test_another_site_in_the_browser(self):
        program = self.start("--spp", ENDLESS)
        page = Browser()
        self.addCleanup(page.__exit__)
        page.open("data:text/html,<p>another site")
        answer = page.evaluate(f"fetch('{program.address}state', {{method: 'POST', body: '{{}}'}})"
                               ".then(() => 'answered', () => 'refused')")
        self.assertEqual(answer, "refused")
        page.evaluate(f"fetch('{program.address}act', {{method: 'POST', mode: 'no-cors', "
                      "body: '{\"do\": \"stop\"}'}).catch(() => 0)")
        time.sleep(0.5)
        self.assertIsNone(program.process.poll())

    def test_only_this_machine(self):
        program = self.start("--spp", ENDLESS)
        lines = Path("/proc/net/tcp").read_text().splitlines()
        own = [line.split()[1] for line in lines if line.split()[1].endswith(f":{program.port:04X}")
               and line.split()[3] == "0A"]
        self.assertEqual(own, [f"0100007F:{program.port:04X}"])  # 127.0.0.1


class Files(LiveTest):
    def follow(self, path):
        program = Program(self.folder, "view", "--live", path)
        self.addCleanup(program.end)
        return program

    def test_running_render_and_its_death(self):
        followed = self.follow("out.exr")
        self.assertEqual(followed.state()["phase"], "waiting for 'out.exr'")
        page = self.open(followed)
        render = subprocess.Popen([os.environ["COVARY"], "render", ROOM, "-o", "out.exr", "--resolution", "96x64",
                                   "--spp", ENDLESS, "--checkpoint", "0.2", "--quiet"], cwd=self.folder)
        try:
            page.wait("/independent \\(predicted relMSE/.test("
                      "document.querySelector('.comparer canvas')?.ariaLabel)")
            before = followed.state()["images"]["file0"]["version"]
            followed.until(lambda state: state["images"]["file0"]["version"] > before)
        finally:
            render.kill()
            render.wait()
        page.timeout = 40
        page.wait("document.querySelector('.phase').innerText.includes('this continues it: ')")
        self.assertTrue(page.text(".phase").rstrip().endswith("--resume"))

    def test_frames_and_films(self):
        for seed in (1, 2):
            self.render(f"film{seed}.exr", "--seed", str(seed), "--spp", "16", "--estimator", "none")
        followed = self.follow(".")
        state = followed.until(lambda state: len(state["pictures"]) == 3)
        self.assertEqual([p["name"] for p in state["pictures"]], ["All films", "film1", "film2"])
        means = [followed.image(i, state["images"][i]) for i in ("all", "file0", "file1")]
        for a, b, c in zip(*(channel for mean in means for channel in mean[:1])):
            self.assertAlmostEqual(a, (b + c) / 2, delta=1e-3 * max(1, a))
        self.render("film3.exr", "--seed", "3", "--spp", "16", "--estimator", "none")
        followed.until(lambda state: len(state["pictures"]) == 4)

    def test_frames_of_a_sequence(self):
        """Films of several views have no mean; the newest comes first."""
        for frame in ("1", "2"):
            self.render_frame(frame)
        followed = self.follow(".")
        state = followed.until(lambda state: len(state["pictures"]) == 2)
        self.assertEqual([p["name"] for p in state["pictures"]], ["f_2", "f_1"])
        self.assertEqual(self.follow("later/").state()["phase"],
                         "waiting for 'later/', a folder that does not exist yet")

    def test_names_are_text(self):
        name = "<img src=x onerror=alert(1)>.exr"
        (self.folder / name).write_bytes(exr({c: [0.5] * 64 for c in "RGB"}, (8, 8)))
        page = self.open(self.follow("."))
        self.shown(page)
        self.assertIn("<img src=x", page.text(".methods"))
        self.assertEqual(page.evaluate("document.querySelectorAll('img').length"), 0)


class Options(LiveTest):
    def fails(self, *words):
        result = subprocess.run([os.environ["COVARY"], *words], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(result.returncode, 2)
        return result.stderr

    def test_refused(self):
        self.assertIn("`covary view --live FOLDER` follows frames",
                      self.fails("render", ROOM, "-o", "o_#.exr", "--frames", "1-2", "--live"))
        self.assertIn("--replay is none", self.fails("render", ROOM, "--replay", "1,1,1", "--live"))
        self.assertIn("--live follows one file or folder", self.fails("view", "--live", "a.exr", "b.exr"))

    def test_port_and_tunnel(self):
        program = self.start("--spp", ENDLESS)
        port = program.port
        program.end()
        other = Program(self.folder, "render", ROOM, "-o", "b.exr", "--spp", ENDLESS, f"--live={port}")
        self.addCleanup(other.end)
        self.assertEqual(other.port, port)
        self.assertEqual(other.ask(f"/{other.token}/", Host=f"localhost:{port + 1}")[0], 200)
        result = subprocess.run([os.environ["COVARY"], "render", ROOM, "-o", "c.exr", f"--live={port}"],
                                cwd=self.folder, capture_output=True, text=True)
        self.assertIn(f"no page can be served at 127.0.0.1:{port}: Address already in use", result.stderr)
        self.assertNotEqual(result.returncode, 0)

    def test_ssh(self):
        os.environ["SSH_CONNECTION"] = "10.0.0.1 5 10.0.0.2 22"
        self.addCleanup(os.environ.pop, "SSH_CONNECTION")
        program = self.start("--spp", "16")
        program.wait()
        self.assertIn(f"ssh -L {program.port}:127.0.0.1:{program.port} HOST", program.said)


if __name__ == "__main__":
    unittest.main()
