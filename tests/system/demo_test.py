"""The README's first command does what it says, and its verdict can fail."""

import os
import subprocess
import unittest

from support import BIN, SOURCE, ProgramTest


def run_demo(*arguments):
    return subprocess.run([os.path.join(SOURCE, "deploy/demo"), "--skip-build", "--programs", BIN, *arguments],
                          capture_output=True, text=True, timeout=200)


class Demo(ProgramTest):
    def test_holds_with_the_default_stage(self):
        demo = run_demo("--out", self.folder)
        self.assertEqual(demo.returncode, 0, demo.stdout + demo.stderr)
        with open(self.path("report.html")) as file:
            report = file.read()
        for word in ("peg_in_hole", "docking_helices", "<svg"):
            self.assertIn(word, report)
        self.assertNotIn("http://", report.replace("http://www.w3.org/", ""), "readable without network")

    def test_fails_with_the_stage_that_rings_at_this_delay(self):
        demo = run_demo("--out", self.folder, "--stage", "hold")
        self.assertEqual(demo.returncode, 1, demo.stdout + demo.stderr)


if __name__ == "__main__":
    unittest.main()
