"""Tests that tandem-lab live runs a trial over sockets in real time and collects the same data as for a trial in
virtual time.

The agreement of both trials is a claim of the command itself, which may fail on a busy machine. These tests check that
the data of the trial is complete, and that exit code, table and files agree.
"""

import json
import os
import tempfile
import unittest

from support import ProgramTest, run

DURATION_S = 8
ROWS = 1000 * DURATION_S


def load(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        return json.load(file)


class Live(ProgramTest):
    def check_trial(self, folder, trial):
        for user in trial["timing"]["users"]:
            self.assertEqual(user["records_lost"], 0)
            # Each millisecond either has a tick or repeats the previous one. After a late tick, two ticks may lie in
            # one millisecond.
            self.assertGreaterEqual(user["ticks"] + user["milliseconds_without_tick"], ROWS)
            self.assertLess(user["milliseconds_without_tick"], ROWS / 2)
        for compared in trial["compared"]:
            self.assertIsNotNone(compared["virtual"], compared)
            self.assertIsNotNone(compared["live"], compared)
            apart = abs(compared["live"] - compared["virtual"])
            self.assertEqual(compared["agrees"], apart <= compared["allowed_difference"], compared)
        for name in ("results.csv", "results.h5", "report.html", "bodies.csv", "1-anna.csv", "trial.json"):
            self.assertGreater(os.path.getsize(os.path.join(folder, name)), 0, name)

    def test_a_trial_on_the_wall_at_50_ms_is_collected_whole_and_compared(self):
        with tempfile.TemporaryDirectory() as folder:
            code, out, err = run("tandem-lab", "live", "wall", "--single", "--set", "link.rtt_ms=50",
                                 "--set", f"duration_s={DURATION_S}", "--out", folder)
            self.assertIn(code, (0, 1), err)
            for words in ("wall, local-model, round trip 50 ms", "drag [N]", "contact force error [N]",
                          "felt stiffness"):
                self.assertIn(words, out)
            (trial,) = load(folder, "comparison.json")["trials"]
            self.check_trial(folder, trial)
            is_good = trial["outcome"] == "completed" and all(each["agrees"] for each in trial["compared"])
            self.assertEqual(code, 0 if is_good else 1, out)
            (live,) = load(folder, "results.json")["trials"]
            (virtual,) = load(folder, "virtual.json")["trials"]
            self.assertEqual(live.keys(), virtual.keys())
            self.assertEqual(live["rtt_ms"], 50)
            # The simulated links delay by 50 ms in both directions together. The machine can only increase this delay.
            self.assertGreater(load(folder, "trial.json")["users"][0]["metrics"]["round_trip_mean_ms"], 49)

    def test_two_users_are_both_collected_whole(self):
        with tempfile.TemporaryDirectory() as folder:
            code, out, err = run("tandem-lab", "live", "squeeze", "--single", "--set", "link.rtt_ms=20",
                                 "--set", "duration_s=2", "--out", folder, "--json")
            self.assertIn(code, (0, 1), err)
            self.assertEqual(json.loads(out), load(folder, "comparison.json"))
            (trial,) = json.loads(out)["trials"]
            self.assertEqual(len(trial["timing"]["users"]), 2)
            for user in trial["timing"]["users"]:
                self.assertEqual(user["records_lost"], 0)
                self.assertGreaterEqual(user["ticks"] + user["milliseconds_without_tick"], 2000)

    def test_what_a_live_client_cannot_do_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            code, _, err = run("tandem-lab", "live", "wall", "--single", "--set", "model.mass_scale=1.5",
                               "--set", "duration_s=0.2", "--out", folder)
            self.assertEqual(code, 2)
            self.assertIn("mass_scale", err)


if __name__ == "__main__":
    unittest.main()
