# SPDX-License-Identifier: Apache-2.0
"""Command lines of README.md and docs/: the program knows every command and option in them, and takes those of code
blocks as they stand, in a folder without their files."""
import itertools
import os
import re
import shlex
import unittest
from pathlib import Path

from cli_test import CliTest

SOURCE = Path(os.environ["SOURCE"])
PAGES = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *sorted((SOURCE / "docs").rglob("*.md"))]
OF_PYTHON = "--cluster"  # of the program `covary` that pip installs (python/covary/_main.py)


def code_blocks(text):
    """Lines of code: indented by four blanks after an empty line, or fenced without a language or as sh."""
    fenced = language = None
    indented = empty = False
    for line in text.splitlines():
        if line.startswith("```"):
            fenced, language = not fenced, line[3:].strip()
        elif fenced:
            if language in ("", "sh", "bash", "console"):
                yield line
        elif line.startswith("    ") and (empty or indented):
            indented = True
            yield line.strip()
        elif line.strip():
            indented = False
        empty = not line.strip()


def commands_in(lines):
    """The words of each call of the program; lines that end in a backslash are joined."""
    for line in re.sub(r"\\\n\s*", " ", "\n".join(lines)).splitlines():
        if match := re.match(r"(?:build/release/)?covary ([a-z-]+\b.*)", line):
            words = shlex.shlex(match[1], posix=True, punctuation_chars="|>&;")
            words.whitespace_split, words.commenters = True, ""  # a # within a word is none
            yield list(itertools.takewhile(lambda word: not re.match("[|>&;]+$|#$|# ", word), words))


class Documentation(CliTest):
    def test_options_exist(self):
        """Also those of calls in running text."""
        known, wrong = {}, []
        for page in PAGES:
            text = page.read_text()
            inline = re.findall(r"`covary ([a-z]+)((?:\s[^`]*)?)`", text)
            blocks = [(words[0], " ".join(words[1:])) for words in commands_in(code_blocks(text))]
            for command, rest in inline + blocks:
                if command not in known:
                    known[command] = self.run_covary(command, "--help-all").stdout
                for option in re.findall(r"(?<!\S)--?[a-zA-Z][a-z0-9-]*", rest):
                    if option == OF_PYTHON:
                        continue
                    if not known[command] or not re.search(rf"(?<!\S){option}(?![\w-])", known[command]):
                        wrong.append(f"{page.relative_to(SOURCE)}: covary {command} {option}")
        self.assertGreater(len(known), 8)
        self.assertEqual(wrong, [])

    def test_command_lines_are_accepted(self):
        """They end for want of a file at the latest, and not with the code of wrong usage; experiments are planned."""
        tried, wrong = 0, []
        (self.path / "room").touch()  # or the scene of this name is rendered
        for page in PAGES:
            for words in commands_in(code_blocks(page.read_text())):
                follows = words[0] == "view" and "--live" in words  # until it is stopped
                if follows or any("…" in word for word in words) or OF_PYTHON in words:
                    continue
                tried += 1
                result = self.run_covary(*words, *(["--print"] if words[0] == "experiment" else []))
                if result.returncode == 2:
                    wrong.append(f"{page.relative_to(SOURCE)}: {shlex.join(words)}: {result.stderr.strip()}")
        self.assertGreater(tried, 30)
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
