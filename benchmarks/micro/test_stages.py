# SPDX-License-Identifier: Apache-2.0
"""Tests of the table of stages: python -m unittest test_stages."""
import unittest

from stages import best_runs, history_row, summarize, table, with_row


def run(name, cpu, **values):
    return {"run_name": name, "run_type": "iteration", "cpu_time": cpu, "real_time": 3 * cpu, "time_unit": "ms",
            **values}


class StagesTest(unittest.TestCase):
    def test_the_fastest_repetition_counts(self):
        stages = summarize([run("a", 3), run("a", 2), {**run("a", 1), "run_type": "aggregate"}])
        self.assertAlmostEqual(stages["a"]["seconds"], 2e-3)

    def test_stages_of_all_threads_are_timed_by_the_clock(self):
        self.assertAlmostEqual(summarize([run("a/real_time", 2)])["a/real_time"]["seconds"], 6e-3)

    def test_each_stage_has_its_own_limit(self):
        stages = summarize([run("multiply_add", 1, items_per_second=100.0),
                            run("read_array/268435456", 1, bytes_per_second=10.0),
                            run("pilot", 1, flops=70.0), run("moments", 1, bytes=2.0),
                            run("nearest_hits/room", 1, items_per_second=50.0), run("paths/room", 1, rays=20.0),
                            run("paths/materials", 1, rays=20.0), run("find", 1)])
        self.assertEqual((stages["pilot"]["limit"], stages["pilot"]["of_limit"]), ("arithmetic", 0.7))
        self.assertEqual((stages["moments"]["limit"], stages["moments"]["of_limit"]), ("memory", 0.2))
        self.assertEqual((stages["paths/room"]["limit"], stages["paths/room"]["of_limit"]), ("rays", 0.4))
        self.assertNotIn("limit", stages["paths/materials"])
        self.assertNotIn("limit", stages["find"])

    def test_the_earlier_run_is_compared_by_name(self):
        lines = table({"a": {"seconds": 0.001}, "b": {"seconds": 0.002}}, {"a": {"seconds": 0.002}})
        self.assertEqual(lines[2:], ["| a | 1 |  | 0.50 |", "| b | 2 |  |  |"])

    def test_a_run_is_a_row_of_the_history(self):
        head = "| program | date | processor | peak | pilot | find |"
        runs = [run("multiply_add", 1, items_per_second=2e11), run("pilot", 28, flops=70.0), run("other", 3)]
        text = with_row(f"# Results\n\n{head}\n|---|---|---|---|---|---|\n| old | | | | 1 | 2 |\n\nMore.\n",
                        lambda found: history_row(found, summarize(runs), best_runs(runs), "covary 1", "2026-01-02",
                                                  "A"))
        self.assertEqual(text.split("\n")[4:], ["| old | | | | 1 | 2 |",
                                                "| covary 1 | 2026-01-02 | A | 100 | 28 |  |", "", "More.", ""])

    def test_a_history_without_its_table_is_refused(self):
        with self.assertRaisesRegex(ValueError, "expected a table"):
            with_row("# Results\n", lambda head: "")
        with self.assertRaisesRegex(ValueError, "expected a table with the columns program"):
            history_row("| a | b |", {}, {}, "", "", "")


if __name__ == "__main__":
    unittest.main()
