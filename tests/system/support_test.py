"""Tests that a failed test in real time is repeated only if the host has taken the processors of this machine."""

import contextlib
import io
import os
import re
import tempfile
import unittest
from unittest import mock

import support
import needs  # from tests/support; support.py adds this folder to the path


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
        """Runs a test while the host takes this many of each 100 ticks. Returns (result, number of runs)."""
        times = [(100 * i, taken_of_100 * i) for i in range(10)]
        OfPrograms.runs = 0
        result = unittest.TestResult()
        with mock.patch.object(support, "_wanted_and_taken", side_effect=times), \
                mock.patch.object(needs, "note_left_out") as note, \
                contextlib.redirect_stderr(io.StringIO()) as said:
            OfPrograms(name).run(result)
        self.assertEqual(note.call_count, len(result.skipped), "what is skipped is counted")
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


class OfPackages(support.ProgramTest):
    files = ("/usr/share/pymol/of_no_version.pdb",)

    def claims(self):
        self.fail("went on")


class OfProgramsOfNoPackage(support.ProgramTest):
    programs = ("umockdev-of-no-version",)

    def claims(self):
        self.fail("went on")


class OfMachine(unittest.TestCase):
    def claims(self):
        needs.skip_unless_of_machine(self, True, "processors")
        needs.skip_unless_of_machine(self, False, "a third arm")
        self.fail("went on")


class Needs(unittest.TestCase):
    """A claim that cannot be tested must either fail or be counted as left out."""

    def run_one(self, test, required=""):
        """Runs a test. Returns (result, lines of the list of left-out claims)."""
        result = unittest.TestResult()
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
            path = os.path.join(folder, "left_out.txt")
            with mock.patch.dict(os.environ, {"TANDEM_LEFT_OUT": path, "TANDEM_REQUIRE": required}):
                test.run(result)
            lines = open(path, encoding="utf-8").read().splitlines() if os.path.exists(path) else []
        return result, lines

    def test_a_missing_package_fails_by_its_name_and_with_the_remedy(self):
        for test, package in ((OfPackages("claims"), "pymol-data"), (OfProgramsOfNoPackage("claims"), "umockdev-of-no-version")):
            result, lines = self.run_one(test)
            ((_, failure),) = result.failures
            self.assertIn(f"needs the Debian package {package}: ", failure)
            self.assertIn("deploy/install-deps --all", failure)
            self.assertNotIn("went on", failure)
            self.assertEqual(lines, [])

    def test_what_the_machine_lacks_is_counted_where_not_all_is_required(self):
        result, lines = self.run_one(OfMachine("claims"))
        self.assertTrue(result.wasSuccessful())
        self.assertEqual(len(result.skipped), 1)
        self.assertEqual(lines, ["__main__.OfMachine.claims: this machine lacks what the test needs: a third arm"])

    def test_what_the_machine_lacks_fails_where_all_is_required(self):
        result, lines = self.run_one(OfMachine("claims"), "all")
        ((_, failure),) = result.failures
        self.assertIn("a third arm (TANDEM_REQUIRE=all)", failure)
        self.assertEqual(lines, [])

    def test_every_package_and_program_is_one_that_is_installed_by_deploy_install_deps(self):
        with open(os.path.join(support.SOURCE, "deploy", "install-deps"), encoding="utf-8") as file:
            installed = {line.split()[0] for line in file if line[:1].isalpha()}
        with open(os.path.join(support.SOURCE, "tests", "support", "needs.cpp"), encoding="utf-8") as file:
            of_cpp = set(re.findall(r'"/usr/[^"]*", "([^"]*)"', file.read()))
        self.assertGreater(len(of_cpp), 5)
        # Debian always installs "util-linux".
        of_python = {*needs.FOLDERS.values(), *needs.PROGRAMS.values()} - {"util-linux"}
        self.assertLessEqual(of_cpp | of_python, installed)


if __name__ == "__main__":
    unittest.main()
