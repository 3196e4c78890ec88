# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, driven over a pipe by the Chrome DevTools protocol with the standard library alone: messages are
JSON ended by a zero byte, sent to the browser's file descriptor 3 and read from 4.
https://chromedevtools.github.io/devtools-protocol/"""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
KEY_CODES = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Enter": 13, "Escape": 27, " ": 32}


class Browser:
    """One page of one browser; `with Browser() as page:`."""

    def __init__(self, size=(1280, 900), timeout=20):
        program = next((p for p in map(shutil.which, PROGRAMS) if p), None)
        if program is None:
            raise FileNotFoundError(f"none of {', '.join(PROGRAMS)} is installed; scripts/setup installs chromium")
        self.timeout = timeout
        self.folder = tempfile.TemporaryDirectory()
        self.downloads = os.path.join(self.folder.name, "downloads")
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()
        command = [program, "--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--disable-gpu",
                   "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
                   "--disable-background-networking", "--hide-scrollbars", "--force-device-scale-factor=1",
                   f"--user-data-dir={self.folder.name}/profile", "about:blank"]
        self.log = open(os.path.join(self.folder.name, "log"), "w+b")
        self.process = subprocess.Popen(["/bin/bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "bash",
                                         *command],
                                        pass_fds=(to_browser, from_browser), stdout=self.log, stderr=self.log,
                                        env={**os.environ, "TMPDIR": self.folder.name})
        os.close(to_browser)
        os.close(from_browser)
        self.buffer, self.next_id, self.session, self.errors = b"", 0, None, []
        target = next(t for t in self.command("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.command("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime"):
            self.command(f"{domain}.enable")
        self.command("Page.setDownloadBehavior", behavior="allow", downloadPath=self.downloads)
        self.resize(*size)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)
        os.close(self.write_end)
        os.close(self.read_end)
        self.log.close()
        time.sleep(0.1)  # children of the browser may still write to its folder
        shutil.rmtree(self.folder.name, ignore_errors=True)

    # ---- protocol ---------------------------------------------------------------------------------------------------

    def command(self, method, **parameters):
        self.next_id += 1
        message = {"id": self.next_id, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.next_id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def receive(self):
        deadline = time.monotonic() + self.timeout
        while b"\0" not in self.buffer:
            ready, _, _ = select.select([self.read_end], [], [], max(0, deadline - time.monotonic()))
            data = os.read(self.read_end, 1 << 20) if ready else b""
            if not data:
                self.log.seek(0)
                log = self.log.read().decode(errors="replace")
                raise TimeoutError("the browser does not answer; its log: " + log[-2000:])
            self.buffer += data
        text, self.buffer = self.buffer.split(b"\0", 1)
        message = json.loads(text)
        if message.get("method") == "Runtime.exceptionThrown":
            details = message["params"]["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        return message

    # ---- what a reader does ------------------------------------------------------------------------------------------

    def open(self, address):
        """Opens a page in place of the one shown, also where only the part behind '#' differs."""
        self.command("Page.navigate", url="about:blank")
        self.command("Page.navigate", url=address)
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'")

    def resize(self, width, height, mobile=False):
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                     mobile=mobile)

    def colour_scheme(self, name):
        self.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def evaluate(self, expression):
        """The value of a JavaScript expression, or of what its promise resolves to."""
        result = self.command("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails'].get('exception', {}).get('description')}")
        return result["result"].get("value")

    def wait(self, condition):
        """Until a JavaScript expression, or what its promise resolves to, is true."""
        deadline = time.monotonic() + self.timeout
        while not self.evaluate(f"Promise.resolve({condition}).then(Boolean)"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"not true after {self.timeout} s: {condition}; errors of the page: {self.errors}")
            time.sleep(0.02)

    def mouse(self, kind, x, y, buttons=0, **more):
        self.command("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=buttons,
                     button="left" if kind != "mouseMoved" or buttons else "none", **more)

    def move(self, x, y):
        self.mouse("mouseMoved", x, y)

    def click(self, x, y):
        self.mouse("mousePressed", x, y, 1, clickCount=1)
        self.mouse("mouseReleased", x, y, 0, clickCount=1)

    def drag(self, x0, y0, x1, y1):
        self.move(x0, y0)
        self.mouse("mousePressed", x0, y0, 1, clickCount=1)
        for t in (0.5, 1):
            self.mouse("mouseMoved", x0 + (x1 - x0) * t, y0 + (y1 - y0) * t, 1)
        self.mouse("mouseReleased", x1, y1, 0, clickCount=1)

    def wheel(self, x, y, pixels):
        self.mouse("mouseWheel", x, y, deltaX=0, deltaY=pixels)

    def key(self, key, shift=False):
        code = f"Digit{key}" if key.isdigit() else f"Key{key.upper()}" if key.isalpha() and len(key) == 1 else key
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else "")
        event = {"key": key.upper() if shift else key, "code": code, "modifiers": 8 if shift else 0,
                 "windowsVirtualKeyCode": KEY_CODES.get(key, ord(key[0].upper()))}
        self.command("Input.dispatchKeyEvent", type="keyDown", text=text, **event)
        self.command("Input.dispatchKeyEvent", type="keyUp", **event)

    def box(self, selector):
        """The rectangle of an element in the window, (left, top, width, height), scrolled into view."""
        return self.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
                             "e.scrollIntoView({block: 'center', behavior: 'instant'}); "
                              "const b = e.getBoundingClientRect();"
                             "return [b.left, b.top, b.width, b.height]; })()")

    def press(self, selector):
        """Clicks the middle of an element."""
        left, top, width, height = self.box(selector)
        self.click(left + width / 2, top + height / 2)

    def text(self, selector):
        return self.evaluate(f"document.querySelector({json.dumps(selector)}).innerText")

    def downloaded(self, ending):
        """The bytes of the first complete download with this ending."""
        deadline = time.monotonic() + self.timeout
        while time.monotonic() < deadline:
            names = os.listdir(self.downloads) if os.path.isdir(self.downloads) else []
            for name in names:
                if name.endswith(ending):
                    with open(os.path.join(self.downloads, name), "rb") as file:
                        return name, file.read()
            self.evaluate("0")  # lets the browser go on
            time.sleep(0.05)
        raise TimeoutError(f"no download ends in {ending}; there are {names}")

    def screenshot(self, path, whole=False):
        image = self.command("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        with open(path, "wb") as file:
            file.write(base64.b64decode(image["data"]))
