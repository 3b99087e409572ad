"""Tests that the table of lab/TOUCH.md contains the results of those trials that its text describes."""

import importlib.util
import pathlib
import re
import unittest

LAB = pathlib.Path(__file__).resolve().parents[3] / "lab"
SPEC = importlib.util.spec_from_file_location("make_touch_table", LAB / "make_touch_table.py")
TABLE = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(TABLE)


def row(silence_ms, error, outcome="completed"):
    return {"silence_max_ms": silence_ms, "path_error_of_peak": error, "path_torque_error_of_peak": None,
            "hold_force_least_ratio": 1 - error, "limit_cycle_m_per_s": error / 100, "force_step_max_n_per_ms": error,
            "energy_created_max_j": error / 1000, "energy_of_late_display_j": error / 10, "outcome": outcome,
            "return_step_max_n_per_ms": None if silence_ms <= 110 else error}


class TouchTable(unittest.TestCase):
    def test_silent_seeds_are_counted_and_in_no_other_cell(self):
        cells = TABLE.default_cells([row(60, 0.01), row(110, 0.03), row(111, 0.9, "dropped")])
        self.assertEqual(cells, ["2.0 (3.0)", "–", "0.98 (0.97)", "0.20 (0.30)", "0.02 (0.03)", "0.0 (0.0)", "2 (1)", "1: 0.90", "–"])

    def test_what_did_not_complete_is_named(self):
        self.assertEqual(TABLE.default_cells([row(0, 0.5, "dropped"), row(0, 0.1)])[-1], "1 dropped")
        self.assertEqual(TABLE.other_cell([row(0, 0.5, "weak"), row(0, 0.1, "weak")]), "30 (50) 2 weak")

    def test_only_the_text_between_the_marks_is_replaced(self):
        text = f"a\n{TABLE.BEGIN}\nold\n{TABLE.END}\nb"
        self.assertEqual(TABLE.replaced(text, "new"), f"a\n{TABLE.BEGIN}\nnew\n{TABLE.END}\nb")
        with self.assertRaises(SystemExit):
            TABLE.replaced("a b", "new")

    def test_a_row_of_one_case_replaces_that_row_alone(self):
        text = "|a|b|\n| `wall` | 1 |\n| `push` | 2 |\n| `push` | other | table |"
        self.assertEqual(TABLE.with_rows(text, ["| `push` | 3 |"]), text.replace("| `push` | 2 |", "| `push` | 3 |"))
        with self.assertRaises(SystemExit):
            TABLE.with_rows(text, ["| `mass` | 3 |"])

    def test_every_case_is_shipped_and_the_page_has_a_row_of_each_and_of_no_other(self):
        for case in TABLE.CASES:
            self.assertTrue((LAB / "experiments" / f"{case}.json").is_file(), case)
        text = TABLE.PAGE.read_text(encoding="utf-8")
        made = text.split(TABLE.BEGIN)[1].split(TABLE.END)[0]
        self.assertEqual(re.findall(r"^\| `(\w+)`", made, re.MULTILINE), TABLE.CASES, "make the table anew")


if __name__ == "__main__":
    unittest.main()
