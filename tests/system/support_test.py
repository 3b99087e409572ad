"""A test that fails in real time is tried again only where the host took the machine's processors away."""

import contextlib
import io
import unittest
from unittest import mock

import support


class OfPrograms(support.ProgramTest):
    runs = 0

    def fails_once(self):
        OfPrograms.runs += 1
        self.assertEqual(OfPrograms.runs, 2)

    def fails(self):
        OfPrograms.runs += 1
        self.fail("always")

    def fails_in_part(self):
        OfPrograms.runs += 1
        for part in range(3):
            with self.subTest(part=part):
                self.assertNotEqual(part, 1)

    def passes(self):
        OfPrograms.runs += 1


class Retries(unittest.TestCase):
    def run_one(self, name, taken_of_100):
        """(result, number of runs) where the host takes so many of each 100 ticks."""
        times = [(100 * i, taken_of_100 * i) for i in range(10)]
        OfPrograms.runs = 0
        result = unittest.TestResult()
        with mock.patch.object(support, "_wanted_and_taken", side_effect=times), \
                contextlib.redirect_stderr(io.StringIO()) as said:
            OfPrograms(name).run(result)
        self.assertEqual(result.testsRun, 1)
        self.assertEqual(bool(said.getvalue()), OfPrograms.runs > 1 or bool(result.skipped), "each lost run is told")
        return result, OfPrograms.runs

    def test_a_failure_on_a_quiet_host_is_one(self):
        for name in ("fails", "fails_once", "fails_in_part"):
            result, runs = self.run_one(name, 1)
            self.assertEqual((len(result.failures), len(result.skipped), runs), (1, 0, 1), name)

    def test_a_failure_on_a_busy_host_is_tried_again(self):
        result, runs = self.run_one("fails_once", 20)
        self.assertEqual((result.wasSuccessful(), len(result.skipped), runs), (True, 0, 2))

    def test_one_that_never_has_the_processors_is_skipped_with_the_reason(self):
        for name in ("fails", "fails_in_part"):
            result, runs = self.run_one(name, 20)
            self.assertEqual((result.failures, runs), ([], support.TRIES), name)
            self.assertIn("20%", result.skipped[0][1])

    def test_one_that_passes_runs_once(self):
        result, runs = self.run_one("passes", 20)
        self.assertEqual((result.wasSuccessful(), len(result.skipped), runs), (True, 0, 1))


if __name__ == "__main__":
    unittest.main()
