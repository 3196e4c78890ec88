# SPDX-License-Identifier: Apache-2.0
"""What the pages of docs/papers name: functions, files, tests, suites, options and measured numbers.

A page is a list of what a paper describes. Each item says in italics what became of it (STATES), and names

- code, `function` in `folder/file.cpp`, with the file's path below src/ or the repository;
- tests, `Suite.Name`, and options, `--option value`;
- suites, `covary experiment NAME`;
- numbers that stand elsewhere, as the text of a link to a section of a page of docs/, or to a suite: [gain 2.5](...).
  If the head of a table's column is such a link, the column's numbers are meant.
"""
import re
from functools import lru_cache

STATES = ("As described", "Differently", "Partly", "Not done")
PATH = r"[\w./-]+\.(?:h|cpp|py)"
NAME = r"`[A-Za-z_][\w:]*`"
CODE = re.compile(rf"({NAME}(?:(?:, | and ){NAME})*) in `({PATH})`")
TEST = re.compile(r"[A-Z]\w*\.[A-Z]\w*")
LINK = re.compile(r"\[([^\]]*)\]\(([^)\s]+)\)")
NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")
SMALLER = "*As described*, measured smaller"
STATE = re.compile(rf"\*({'|'.join(STATES)})\*")


def paragraphs(text):
    """(number of the first line, text in one line) of items, paragraphs and rows of tables; no blocks of code."""
    found, fenced, open_paragraph = [], False, False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.startswith("```")
        if fenced or line.startswith(("```", "    ")) or not line.strip():
            open_paragraph = False
        elif open_paragraph and not line.startswith(("- ", "|", "#")):
            found[-1] = (found[-1][0], found[-1][1] + " " + line.strip())
        else:
            found.append((number, line.strip()))
            open_paragraph = not line.startswith(("|", "#"))
    return found


def with_links(text):
    """`text` with [words](link) in place of [words][id]."""
    links = dict(re.findall(r"^\[(\w+)\]: (\S+)$", text, re.M))
    return re.sub(r"\[([^\]]*)\]\[(\w+)\]", lambda match: f"[{match[1]}]({links[match[2]]})", text)


def items(text):
    return [(number, words) for number, words in paragraphs(text) if words.startswith("- ")]


def states(text):
    """How many items are in each state."""
    found = [STATE.findall(words) for _, words in items(text)]
    return {state: sum(states == [state] for states in found) for state in STATES}


def measured_smaller(text):
    """How many items are as described, but so far measured at a smaller size."""
    return sum(SMALLER in words for _, words in items(text))


def slug(heading):
    """The anchor of a heading."""
    return re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-")


def section(text, anchor):
    """Of a page, with the sections below it; None: there is none. All of it without an anchor."""
    if not anchor:
        return text
    level, lines = 0, []
    for line in text.splitlines():
        if match := re.match(r"(#+) (.*)", line):
            if level and len(match[1]) <= level:
                break
            if not level and slug(match[2]) == anchor:
                level = len(match[1])
        if level:
            lines.append(line)
    return "\n".join(lines) if level else None


def numbers(text):
    return {number.rstrip(",").replace(",", "") for number in NUMBER.findall(text)}


def read(path):
    return path.read_text(encoding="utf-8")


class Tree:
    """The sources of a repository."""

    def __init__(self, root):
        self.root = root
        self.code = lru_cache(None)(self._code)

    def find(self, path):
        return next((at for at in (self.root / path, self.root / "src" / path) if at.is_file()), None)

    def find_suite(self, name):
        """A suite, or a paper of several."""
        return self.find(f"suites/{name}.json") or self.find(f"suites/papers/{name}.json")

    def _code(self, path):
        """Without comments."""
        text = read(path)
        if path.suffix == ".py":
            return re.sub(r'""".*?"""|#[^\n]*', "", text, flags=re.S)
        return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)

    @lru_cache(None)
    def tests(self):
        files = [*(self.root / "src").rglob("*_test.cpp"), *(self.root / "tests").rglob("*_test.cpp")]
        macro = re.compile(r"^TEST\w*\((\w+),\s*(\w+)\)", re.M)
        return {".".join(names) for file in files for names in macro.findall(read(file))}

    @lru_cache(None)
    def literals(self):
        """Strings of the program, which are the names of its options among others."""
        files = [file for folder in ("src", "apps") for file in (self.root / folder).rglob("*.*")
                 if file.suffix in (".h", ".cpp")]
        return {text for file in files for text in re.findall(r'"(?:-\w,)?(?:--)?([\w-]+)[=",]', read(file))}

    def defines(self, path, name):
        return all(re.search(rf"\b{part}\b", self.code(path)) for part in name.split("::"))


def of_code(words, tree):
    """Problems with the names in backticks."""
    rest = words
    for names, path in CODE.findall(words):
        file = tree.find(path)
        for name in re.findall(r"`([\w:]+)`", names):
            if file and not tree.defines(file, name):
                yield f"{path} has no {name}"
    rest = CODE.sub(lambda match: f"`{match[2]}`", rest)
    for name in re.findall(r"`([^`]+)`", rest):
        if re.fullmatch(PATH + r"|[\w./-]+\.xml", name):
            if not tree.find(name):
                yield f"there is no file {name}"
        elif TEST.fullmatch(name):
            if name not in tree.tests():
                yield f"there is no test {name}"
        elif name.startswith("--"):
            yield from of_options(name, tree)
        elif match := re.match(r"covary experiment ([\w-]+)$", name):
            if not tree.find_suite(match[1]):
                yield f"there is no suite {match[1]}"
        elif re.fullmatch(r"[A-Za-z_][\w:]*", name) and name not in tree.literals():
            yield f"{name} has no file: `{name}` in `folder/file.cpp`"


def of_options(words, tree):
    for word in words.split():
        for name in word.lstrip("-").split("="):
            if re.fullmatch(r"[a-z][a-z0-9-]*", name) and name not in tree.literals():
                yield f"the program has no {word}"


def target(page, link, tree):
    """The text that a link of a page leads to, if its numbers are to be found there; or a problem."""
    path, _, anchor = link.partition("#")
    if "://" in link or not path.endswith((".md", ".json", ".py")):
        return None, None
    at = (tree.root / "docs" / "papers" / path).resolve()
    if not at.is_file():
        return None, f"{page}: there is no {path}"
    found = section(read(at), anchor)
    return found, None if found is not None else f"{path} has no section #{anchor}"


def of_numbers(page, words, tree):
    for text, link in LINK.findall(words):
        found, problem = target(page, link, tree)
        if problem:
            yield problem
        elif found is not None:
            for number in sorted(numbers(text) - numbers(found)):
                yield f"{link} has no {number}"


def of_table(page, head, rows, tree):
    """Numbers of the columns whose head is a link."""
    for column, cell in enumerate(head):
        if not (match := LINK.search(cell)):
            continue
        found, problem = target(page, match[2], tree)
        if problem:
            yield rows[0][0], problem
            continue
        for line, row in rows:
            for number in sorted(numbers(row[column]) - numbers(found)):
                yield line, f"{match[2]} has no {number}"


def tables(text):
    """(cells of the head, [(line, cells)]) of each."""
    found, last = [], -1
    for number, words in paragraphs(text):
        if not words.startswith("|"):
            continue
        cells = [cell.strip() for cell in words.strip("|").split("|")]
        if number != last + 1:
            found.append((cells, []))
        elif not set(cells[0]) <= set("-: "):
            found[-1][1].append((number, cells))
        last = number
    return found


def problems(page, text, tree):
    """Of a page: what it names and the sources do not have."""
    found, text = [], with_links(text)
    for line, words in paragraphs(text):
        if words.startswith("- ") and len(STATE.findall(words)) != 1:
            found.append((line, f"an item is in one state, of {', '.join(STATES)}"))
        if not words.startswith("|"):
            found += [(line, problem) for problem in (*of_code(words, tree), *of_numbers(page, words, tree))]
    for head, rows in tables(text):
        found += of_table(page, head, rows, tree)
    for name in re.findall(r"^    covary experiment ([\w-]+)", text, re.M):
        if not tree.find_suite(name):
            found.append((0, f"there is no suite {name}"))
    for path in re.findall(rf"^    ({PATH}) ", text, re.M):
        if not tree.find(path):
            found.append((0, f"there is no file {path}"))
    return [f"{page}:{line}: {problem}" for line, problem in found]


__all__ = ["STATES", "Tree", "items", "measured_smaller", "problems", "states", "tables"]
