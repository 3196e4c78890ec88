# SPDX-License-Identifier: Apache-2.0
"""No block of code in the documentation is left out silently: each is in a language that pages_test.py runs or reads,
or the page says why it does not run."""
import os
import re
import unittest
from collections import Counter
from pathlib import Path

from blocks import LANGUAGES, TEXTS, all_blocks, blocks_of
from elsewhere import BLOCKS_ELSEWHERE, ELSEWHERE

SOURCE = Path(os.environ["SOURCE"])
PAGE = """Text.

    covary render a.xml \\
      -o b.exr
    # Not run in tests: needs a cluster.
    sbatch x

*Not run in tests: needs Blender.*

```python
import bpy
```

- item
  ```json suite.json
  {"a": 1}
  ```
"""


class Blocks(unittest.TestCase):
    def test_parsing(self):
        shell, python, json = blocks_of("x.md", PAGE)
        self.assertEqual([(line, text, reason) for line, text, reason in shell.commands()],
                         [(3, "covary render a.xml \\\n  -o b.exr", ""), (6, "sbatch x", "needs a cluster")])
        self.assertEqual((python.language, python.reason), ("python", "needs Blender"))
        self.assertEqual((json.file, json.text), ("suite.json", '{"a": 1}\n'))

    def test_every_block_has_a_language(self):
        wrong = [f"{block.page}:{block.line}: {block.language}: expected one of sh, {', '.join(LANGUAGES)}"
                 for block in all_blocks(SOURCE) if block.language not in (*LANGUAGES, "sh")]
        self.assertEqual(wrong, [])

    def test_indented_blocks_are_for_the_shell(self):
        """Formulas and trees are fenced, ```text, so that they are not taken for commands."""
        words = re.compile(r"(covary|make|pip|python3?|git|cmake|ctest|sbatch|SBATCH_TIMELIMIT=\S+|blender|c\+\+|"
                           r"export|apt-get|oiiotool|for|PYTHONPATH=\S+|\.|[./\w-]+/[\w.-]+|sh|cd)\s")
        wrong = [f"{block.page}:{line}: {text}" for block in all_blocks(SOURCE) if block.language == "sh"
                 for line, text, _ in block.commands() if not words.match(text.strip() + " ")]
        self.assertEqual(wrong, [])

    def test_what_runs_elsewhere_does(self):
        for _, file, text in ELSEWHERE:
            self.assertIn(text, (SOURCE / file).read_text(encoding="utf-8"), file)
        for _, _, file, text in BLOCKS_ELSEWHERE:
            self.assertIn(text, (SOURCE / file).read_text(encoding="utf-8"), file)

    def test_counts(self):
        """What does not run is counted: whoever adds to it changes the number here."""
        counts = Counter()
        for block in all_blocks(SOURCE):
            if block.language == "sh":
                for _, _, reason in block.commands():
                    counts["commands that do not run" if reason else "commands"] += 1
            elif block.language not in TEXTS:
                counts[f"{block.language} that does not run" if block.reason else block.language] += 1
        print(dict(counts))
        self.assertEqual({name: count for name, count in counts.items() if "not run" in name}, {
            "commands that do not run": 78, "python that does not run": 3, "xml that does not run": 1})
        self.assertGreaterEqual(counts["commands"], 90)
        self.assertGreaterEqual(counts["python"], 19)


if __name__ == "__main__":
    unittest.main()
