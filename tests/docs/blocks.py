# SPDX-License-Identifier: Apache-2.0
"""The blocks of code on the pages of the documentation. Blocks that are indented, or fenced without a language, are for
the shell; others are fenced with their language, what is no code with `text`. JSON and XML may have a file's name after
the language: ```json suite.json.

What cannot run here says why, in the page: a paragraph "*Not run in tests: REASON.*" before the block, or, in a shell's
block, a line "# Not run in tests: REASON" before the lines that it is about."""
import re
from dataclasses import dataclass, field

#: Fenced blocks that are no code.
TEXTS = ("text", "{toctree}")
LANGUAGES = ("python", "json", "xml", "cpp", "cmake", *TEXTS)
MARK = re.compile(r"^(?:\*|# )Not run in tests: (.+?)\.?\*?$")


@dataclass
class Block:
    page: str
    line: int
    language: str  #: "sh" for the shell
    file: str = ""  #: name after the language
    lines: list = field(default_factory=list)
    reason: str = ""  #: why it does not run

    @property
    def text(self):
        return "\n".join(self.lines) + "\n"

    def commands(self):
        """Of the shell: (number of the line, command, reason why it does not run), continued lines joined."""
        reason, start, parts = self.reason, 0, []
        for number, line in enumerate(self.lines, self.line):
            if match := MARK.match(line.strip()):
                reason = match[1]
                continue
            if not parts and (not line.strip() or line.lstrip().startswith("#")):
                continue
            start = start if parts else number
            parts.append(line)
            if not line.endswith("\\"):
                yield start, "\n".join(parts), reason
                parts = []


def blocks_of(page, text):
    """All of a page, in order."""
    lines, found, at, before = text.splitlines(), [], 0, ""
    while at < len(lines):
        line = lines[at]
        is_fence = line.lstrip().startswith("```")
        if not is_fence and not (line.startswith("    ") and (at == 0 or not lines[at - 1].strip())):
            before = line if line.strip() else before
            at += 1
            continue
        mark = MARK.match(before.strip())
        if is_fence:
            indent = len(line) - len(line.lstrip())
            words = line.strip()[3:].split()
            end = next(i for i in range(at + 1, len(lines)) if lines[i].lstrip().startswith("```"))
            block = Block(page, at + 2, words[0] if words else "sh", " ".join(words[1:]),
                          [text[indent:] for text in lines[at + 1:end]])
            at = end + 1
        else:
            end = at
            while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
                end += 1
            block = Block(page, at + 1, "sh", "", [text[4:] for text in lines[at:end]])
            while not block.lines[-1].strip():
                block.lines.pop()
            at = end
        block.reason = mark[1] if mark else ""
        found.append(block)
        before = ""
    return found


def pages_of(source):
    return [source / "README.md", source / "CONTRIBUTING.md", *sorted((source / "docs").rglob("*.md"))]


def all_blocks(source):
    return [block for page in pages_of(source)
            for block in blocks_of(str(page.relative_to(source)), page.read_text(encoding="utf-8"))]
