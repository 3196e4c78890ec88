# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/papers name functions, files, tests, suites, options and numbers that exist (papers.py), and their
first page counts what they list."""
import os
import tempfile
import unittest
from pathlib import Path

from papers import STATES, Tree, items, measured_smaller, problems, states, tables

SOURCE = Path(os.environ["SOURCE"])
PAGES = sorted(path for path in (SOURCE / "docs" / "papers").glob("*.md") if path.name != "index.md")
RIGHT = """# Page

- **Eq. (1)**. *As described*: `solve` and `Grid::key` in `sums/solver.cpp`, `--set ridge=0 --set penalty=pilot`;
  `Solver.IsExact`, `covary experiment table1`; [gain 2.5, error 1,536](../notes/method.md#by-scene).

| | [ours][scenes] |
|---|---|
| Door | 2.5 |

    covary experiment table1 --scenes DIR

[scenes]: ../notes/method.md#by-scene
"""


class Planted(unittest.TestCase):
    """In a tree of its own: what is wrong is found."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.root = Path(holder.name)
        for path, text in {
            "src/sums/solver.cpp": '// removed\nclass Grid { int key(); };\nint solve() { ask("ridge", "pilot"); }\n'
                                   'ask("--set", "penalty");\n',
            "src/sums/solver_test.cpp": "TEST(Solver, IsExact) {}\n",
            "suites/table1.json": "{}\n",
            "docs/notes/method.md": "# Method\n\n## By scene\n\n| Door | 2.5 | 1536 |\n\n## More\n\n7.5\n",
            "docs/papers/page.md": "",
            "tests/none": "",
        }.items():
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            (self.root / path).write_text(text)

    def problems(self, old="", new=""):
        self.assertIn(old, RIGHT)
        return problems("page.md", RIGHT.replace(old, new, 1), Tree(self.root))

    def test_right_page(self):
        self.assertEqual(self.problems(), [])

    def test_wrong_pages(self):
        for old, new, problem in (
            ("`solve`", "`removed`", "page.md:3: sums/solver.cpp has no removed"),
            ("Grid::key", "Grid::value", "page.md:3: sums/solver.cpp has no Grid::value"),
            ("solver.cpp", "solution.cpp", "page.md:3: there is no file sums/solution.cpp"),
            ("Solver.IsExact", "Solver.IsFast", "page.md:3: there is no test Solver.IsFast"),
            ("experiment table1`", "experiment table2`", "page.md:3: there is no suite table2"),
            ("experiment table1 ", "experiment table2 ", "page.md:0: there is no suite table2"),
            ("--set ridge", "--sets ridge", "page.md:3: the program has no --sets"),
            ("ridge=0", "bridge=0", "page.md:3: the program has no bridge=0"),
            ("penalty=pilot", "penalty=pirate", "page.md:3: the program has no penalty=pirate"),
            ("gain 2.5", "gain 7.5", "page.md:3: ../notes/method.md#by-scene has no 7.5"),
            ("Door | 2.5", "Door | 7.5", "page.md:8: ../notes/method.md#by-scene has no 7.5"),
            ("#by-scene", "#by-light", "page.md:3: ../notes/method.md has no section #by-light"),
            (" in `sums/solver.cpp`", "", "page.md:3: solve has no file: `solve` in `folder/file.cpp`"),
            ("*As described*", "*Done*", f"page.md:3: an item is in one state, of {', '.join(STATES)}"),
        ):
            with self.subTest(new=new):
                self.assertIn(problem, self.problems(old, new))

    def test_states(self):
        self.assertEqual(states(RIGHT), {"As described": 1, "Differently": 0, "Partly": 0, "Not done": 0})
        self.assertEqual(measured_smaller(RIGHT), 0)
        self.assertEqual(measured_smaller(RIGHT.replace("described*:", "described*, measured smaller:")), 1)


class Pages(unittest.TestCase):
    def test_what_they_name_exists(self):
        tree, found = Tree(SOURCE), []
        for page in (*PAGES, SOURCE / "docs" / "papers" / "index.md"):
            found += problems(str(page.relative_to(SOURCE)), page.read_text(encoding="utf-8"), tree)
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_counts(self):
        """The first page's table has what the pages list."""
        counted = {page.name: states(page.read_text(encoding="utf-8")) for page in PAGES}
        for page in PAGES:
            counted[page.name]["Measured smaller"] = measured_smaller(page.read_text(encoding="utf-8"))
        self.assertEqual(sum(len(items(page.read_text(encoding="utf-8"))) for page in PAGES), 168)
        head, rows = tables((SOURCE / "docs" / "papers" / "index.md").read_text(encoding="utf-8"))[0]
        columns = [*STATES, "Measured smaller"]
        self.assertEqual([cell.lower() for cell in head[1:]], ["all", *(column.lower() for column in columns)])
        for page, (_, row) in zip(PAGES, rows):
            self.assertIn(f"({page.name})", row[0])
            own = counted[page.name]
            self.assertEqual([int(cell) for cell in row[1:]], [sum(own[state] for state in STATES), *own.values()],
                             page.name)
        sums = [sum(own[column] for own in counted.values()) for column in columns]
        self.assertEqual([int(cell.strip("*")) for cell in rows[-1][1][1:]], [sum(sums[:-1]), *sums])


if __name__ == "__main__":
    unittest.main()
