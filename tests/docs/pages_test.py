# SPDX-License-Identifier: Apache-2.0
"""Every line of code in the documentation, as it stands, page by page and in order, in a folder with the files that its
readers have (files.py). pages_test.py [PAGE…]: only these, e.g. docs/start.md."""
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from blocks import TEXTS, all_blocks
from elsewhere import BLOCKS_ELSEWHERE, ELSEWHERE
from files import Files, inputs_of, sandbox_environment

SOURCE, COVARY = Path(os.environ["SOURCE"]), Path(os.environ["COVARY"])
PAGES = [word for word in sys.argv[1:] if word.endswith(".md")]
SECONDS = 1800  # for a command, at most
TARGET_MISSED = 3  # exit code: an image as good as --spp allows


def elsewhere(command):
    return any(command.startswith(start) for start, _, _ in ELSEWHERE)


class Page:
    def __init__(self, name, blocks):
        self.name, self.blocks = name, [block for block in blocks if block.page == name]
        self.problems, self.ran, self.not_run, self.python = [], 0, [], []
        self.holder = tempfile.TemporaryDirectory()
        self.folder = Path(self.holder.name)
        self.environment = sandbox_environment(os.environ, COVARY, sys.executable, self.folder)
        self.files = Files(SOURCE, self.folder, blocks, self.environment)
        (self.folder / "build").symlink_to(COVARY.parents[1])

    def run(self, place, words, text):
        start = time.monotonic()
        done = subprocess.run(words, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=SECONDS, check=False)
        self.ran += 1
        print(f"{place}: {time.monotonic() - start:.1f} s: {text.splitlines()[0]}", flush=True)
        if done.returncode not in (0, TARGET_MISSED):
            self.problems.append(f"{place}: {text}\n  exit code {done.returncode}: {done.stderr.strip()[-1000:]}")

    def shell(self, block):
        for line, command, reason in block.commands():
            place = f"{block.page}:{line}"
            if reason:
                self.not_run.append(f"{place}: {reason}")
            elif elsewhere(command.strip()):
                self.not_run.append(f"{place}: runs elsewhere")
            else:
                for name in inputs_of(shlex.split(re.sub(r"(?m)\s#\s.*$", "", command))):
                    self.files.make(name)
                self.run(place, ["/bin/bash", "-ec", command], command)

    def check(self):
        for block in self.blocks:
            place = f"{block.page}:{block.line}"
            if block.language == "sh":
                self.shell(block)
            elif block.language in TEXTS:
                continue
            elif block.reason:
                self.not_run.append(f"{place}: {block.reason}")
            elif any(block.page == page and text in block.text for page, text, _, _ in BLOCKS_ELSEWHERE):
                self.not_run.append(f"{place}: runs elsewhere")
            elif block.language == "python":
                self.python.append(block)
            elif not block.file:
                self.problems.append(f"{place}: {block.language} without the name of a file that the page reads")
        self.run_python()
        self.holder.cleanup()

    def run_python(self):
        """All blocks of the page in one program; a block starts at its line, for messages."""
        if not self.python:
            return
        self.files.make("scene.xml")  # the reader's own
        text, at = "", 1
        for block in self.python:
            text += "\n" * (block.line - at) + block.text
            at = block.line + len(block.lines)
        self.folder.joinpath("page.py").write_text(text, encoding="utf-8")
        self.run(f"{self.name}: Python", [sys.executable, "page.py"], f"{len(self.python)} blocks")


class Pages(unittest.TestCase):
    def test_every_line_runs(self):
        blocks = all_blocks(SOURCE)
        ran, not_run, problems = 0, [], []
        for name in PAGES or dict.fromkeys(block.page for block in blocks):
            page = Page(name, blocks)
            page.check()
            ran, not_run, problems = ran + page.ran, not_run + page.not_run, problems + page.problems
        print(f"{ran} commands and programs ran; {len(not_run)} did not:", *not_run, sep="\n  ")
        self.assertEqual(problems, [], "\n\n".join(problems))
        self.assertGreater(*((ran + len(not_run), 0) if PAGES else (ran, 100)))


if __name__ == "__main__":
    unittest.main(argv=[word for word in sys.argv if word not in PAGES])
