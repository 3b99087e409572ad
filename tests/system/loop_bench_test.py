"""Tests that tandem-lab bench loop measures the loop of the real client. The results depend on the machine and are not
checked."""

import json
import os
import subprocess
import unittest

from support import PATIENCE_S, ProgramTest, program
from window_test import WindowTest

NO_DISPLAY = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}


def bench(*arguments, environment):
    done = subprocess.run([program("tandem-lab"), "bench", "loop", "--seconds", "1", *arguments], env=environment,
                          capture_output=True, text=True, timeout=5 * PATIENCE_S)
    return done.returncode, done.stdout, done.stderr


class LoopBench(ProgramTest):
    def assert_figures(self, figures):
        late, tick = figures["lateness_us"], figures["tick_us"]
        self.assertLessEqual(0, late["p50"])
        self.assertTrue(late["p50"] <= late["p99"] <= late["p999"] <= late["max"], late)
        self.assertTrue(0 < tick["p50"] <= tick["p99"], tick)
        self.assertGreaterEqual(figures["missed"], 0)

    def test_a_run_prints_lateness_ticks_and_what_was_missed(self):
        code, out, err = bench("--json", environment=NO_DISPLAY)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assert_figures(report)
        self.assert_figures(report["headless"])
        self.assertIsNone(report["with_window"])

    def test_a_window_without_a_display_is_one_line(self):
        self.assert_setup_error(bench("--with-window", environment=NO_DISPLAY), "--with-window", "DISPLAY", "xvfb-run")


class LoopBenchWithWindow(WindowTest):
    def test_headless_and_window_run_in_turn(self):
        code, out, err = bench("--with-window", "--pairs", "2", "--json", environment=self.display.environment())
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        for which in ("headless", "with_window"):
            self.assertEqual(len(report[which]["runs"]), 2)
            LoopBench.assert_figures(self, report[which])
        claims = [check["claim"] for check in report["checks"] if check["scope"] == "with window"]
        self.assertEqual(len(claims), 3)


if __name__ == "__main__":
    unittest.main()
