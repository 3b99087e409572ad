"""Tests the long runs: parts of deploy/nightly by name, and the times and the verdict that deploy/nightly and .ci/run
print."""

import os
import re
import subprocess
import tempfile
import unittest

from support import PATIENCE_S, SOURCE

import needs  # from tests/support; support.py adds this folder to the path

NIGHTLY = os.path.join(SOURCE, "deploy", "nightly")
PARTS = ["tests", "stalls", "asan", "lab", "soak", "tsan", "ubsan", "tidy", "packages"]
STEPS = """
set -uo pipefail
run=example
. "$1"
step good true
step bad sh -c 'exit 3'
step 'sleeps a while' sleep 1
summary "$2"
"""


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    return done.returncode, done.stdout, done.stderr


def steps(script, max_min="1"):
    return run("bash", "-c", script, "bash", os.path.join(SOURCE, "deploy", "steps.sh"), max_min)


def table_of_readme():
    """Returns the (part, minutes) rows of the table in tests/README.md."""
    with open(os.path.join(SOURCE, "tests", "README.md"), encoding="utf-8") as file:
        return re.findall(r"^\| `(\w+)` \| (\d+) min \|", file.read(), re.MULTILINE)


class Nightly(unittest.TestCase):
    def test_lists_its_parts_as_the_readme_does_and_none_takes_more_than_an_hour(self):
        code, out, err = run(NIGHTLY, "--list")
        self.assertEqual(code, 0, err)
        listed = [tuple(line.split()[:2]) for line in out.splitlines()]
        self.assertEqual([name for name, _ in listed], PARTS)
        self.assertEqual(listed, table_of_readme())
        for name, minutes in listed:
            self.assertLessEqual(int(minutes), 60, name)

    def test_without_a_part_runs_all_and_with_some_those_in_their_order(self):
        def commands(*parts):
            code, out, err = run(NIGHTLY, "--dry-run", *parts)
            self.assertEqual(code, 0, err)
            return out.splitlines()

        alone = {part: commands(part) for part in PARTS}
        for part, lines in alone.items():
            self.assertEqual(len(lines), 2, f"{part} builds what it runs: {lines}")
        self.assertEqual(commands(), sum(alone.values(), []))
        self.assertEqual(commands("tidy", "asan"), alone["tidy"] + alone["asan"])
        self.assertEqual(len({lines[1] for lines in alone.values()}), len(PARTS), "no two run the same")

    def test_every_nightly_test_is_in_exactly_one_part(self):
        lines = run(NIGHTLY, "--dry-run")[1].splitlines()
        for preset, left_out, name in (("nightly", "stalls", "stall_test"), ("asan-nightly", "soak", "stress.soak")):
            chosen = [line.split(preset + " ", 1)[1] for line in lines if f"--preset {preset} " in line]
            self.assertEqual([re.sub(r"-j\d+ ", "", one) for one in chosen], [f"-E {name}", f"-R {name}"], left_out)

    def test_an_unknown_part_is_an_error_that_names_the_parts_and_runs_nothing(self):
        for arguments in (["stall"], ["tidy", "all"], ["--tidy"], [""]):
            code, out, err = run(NIGHTLY, *arguments)
            self.assertEqual((code, out), (2, ""))
            self.assertEqual(len(err.splitlines()), 1, err)
            for part in PARTS:
                self.assertIn(part, err)


class Steps(unittest.TestCase):
    def test_each_step_has_its_time_and_a_verdict_and_a_failure_is_named_last(self):
        code, out, err = steps(STEPS)
        self.assertEqual(code, 1)
        self.assertIn("example: FAILED: bad", err)
        self.assertRegex(out, r"(?m)^  good +0 min 0\d s  passed$")
        self.assertRegex(out, r"(?m)^  bad +0 min 0\d s  FAILED \(3\)$")
        self.assertRegex(out, r"(?m)^  sleeps a while +0 min 0[1-9] s  passed$")
        self.assertRegex(out, r"(?m)^  all +0 min 0[1-9] s  of at most 1 min$")

    def test_where_all_pass_it_says_so(self):
        code, out, err = steps(STEPS.replace("step bad sh -c 'exit 3'", ""))
        self.assertEqual((code, err), (0, ""))
        self.assertTrue(out.endswith("example: everything holds\n"), out)

    def test_a_run_that_takes_longer_than_it_may_is_warned_of(self):
        code, _, err = steps(STEPS.replace("step bad sh -c 'exit 3'", ""), "0")
        self.assertEqual(code, 0)
        self.assertIn("WARNING: it took longer than it may", err)

    def test_continuous_integration_ends_with_its_first_failure_and_prints_the_times(self):
        with open(os.path.join(SOURCE, ".ci", "run"), encoding="utf-8") as file:
            script = file.read()
        begin = script.index("step packages")
        before = script[:begin].replace("log=build/", f"log={tempfile.gettempdir()}/")
        builder = "setsid sleep 600 & builder=$!; echo \"builder $builder\"\n"
        code, out, err = run("bash", "-c", before + builder + "step one true\nstep two false\nstep three true\n",
                             os.path.join(SOURCE, ".ci", "run"))
        self.assertEqual(code, 1, err)
        self.assertRegex(out, r"(?m)^  one +.* passed$")
        self.assertRegex(out, r"(?m)^  two +.* FAILED \(1\)$")
        self.assertNotIn("three", out)
        self.assertIn("of at most 40 min", out)
        self.assertIn("ci: FAILED: two", err)
        self.assertFalse(os.path.exists("/proc/" + re.search(r"builder (\d+)", out).group(1)), "the compilers go on")

    def test_shellcheck_finds_nothing(self):
        needs.programs("shellcheck")
        scripts = [os.path.join(SOURCE, *name.split("/")) for name in (".ci/run", "deploy/nightly", "deploy/test", "deploy/steps.sh")]
        code, out, _ = run("shellcheck", "-x", *scripts)
        self.assertEqual(code, 0, out)


if __name__ == "__main__":
    unittest.main()
