"""The README's first command does what it says, and its verdict can fail."""

import os
import subprocess
import unittest

from support import BIN, SOURCE, ProgramTest

# Claims about the machine, not about the programs: a test does not fail where another load takes the processor.
MACHINE_CLAIMS = ("haptic ticks run", "mean tick rate")
TRIES = 3


def run_demo(*arguments):
    return subprocess.run([os.path.join(SOURCE, "deploy/demo"), "--skip-build", "--programs", BIN, *arguments],
                          capture_output=True, text=True, timeout=200)


def failed_claims(demo):
    lines = [line.split("FAILED", 1)[1].strip() for line in demo.stdout.splitlines() if "FAILED" in line]
    return [line for line in lines if not line.startswith(MACHINE_CLAIMS)]


class Demo(ProgramTest):
    def test_holds_with_the_default_stage(self):
        for _ in range(TRIES):
            demo = run_demo("--out", self.folder)
            self.assertEqual(failed_claims(demo), [], demo.stdout + demo.stderr)
            self.assertIn(demo.returncode, (0, 1), demo.stdout + demo.stderr)
            if demo.returncode == 0:
                break
        else:
            self.skipTest("this machine is too busy for 1 kHz; every other claim held")
        with open(self.path("report.html")) as file:
            report = file.read()
        for word in ("peg_in_hole", "docking_helices", "<svg"):
            self.assertIn(word, report)
        self.assertNotIn("http://", report.replace("http://www.w3.org/", ""), "readable without network")

    def test_fails_with_the_stage_that_rings_at_this_delay(self):
        # The passivity controllers would leave only some of the hands above the bound: 23 to 43 mm/s against 90 to 520 without it.
        demo = run_demo("--out", self.folder, "--stage", "hold", "--passivity", "off")
        self.assertEqual(demo.returncode, 1, demo.stdout + demo.stderr)
        ringing = [claim for claim in failed_claims(demo) if claim.startswith("hand at rest")]
        self.assertEqual(len(ringing), 4, "both hands of both sessions ring: " + demo.stdout)


if __name__ == "__main__":
    unittest.main()
