"""Tests tandem-doctor on this machine: its findings as text and as JSON, with a reachable and an unreachable server."""

import json
import unittest

from support import ProgramTest, Server, free_port, run

VERDICTS = ("good", "warning", "bad")


class Doctor(ProgramTest):
    def examine(self, *arguments):
        code, out, err = run("tandem-doctor", "--json", "--duration", "500ms", *arguments)
        self.assertIn(code, (0, 1), err)
        report = json.loads(out)
        self.assertEqual(code, 1 if report["verdict"] == "bad" else 0)
        return {finding["check"]: finding for finding in report["findings"]}

    def test_each_finding_has_a_verdict_and_what_is_not_good_a_remedy(self):
        findings = self.examine()
        self.assertEqual(set(findings), {"devices", "clock", "timers", "priority", "idle", "lateness"})
        for finding in findings.values():
            self.assertIn(finding["verdict"], VERDICTS)
            self.assertEqual(finding["verdict"] == "good", not finding["remedy"], finding)
        self.assertGreater(findings["lateness"]["numbers"]["ticks"], 0)

    def test_the_way_to_a_server_is_measured(self):
        with Server("--scene", "two_boxes") as server:
            link = self.examine("--insecure", "--server", f"127.0.0.1:{server.port}")["link"]
        self.assertGreater(link["numbers"]["states"], 10)
        self.assertGreater(link["numbers"]["round_trip_max_ms"], 0)

    def test_a_server_that_is_not_there_is_bad(self):
        link = self.examine("--insecure", "--server", f"127.0.0.1:{free_port()}")["link"]
        self.assertEqual(link["verdict"], "bad")
        self.assertIn("tandem-server", link["remedy"])

    def test_in_words_it_has_a_line_for_each(self):
        code, out, err = run("tandem-doctor", "--duration", "100ms")
        self.assertIn(code, (0, 1), err)
        for check in ("devices", "clock", "timers", "priority", "lateness"):
            self.assertRegex(out, rf"(?m)^(good|warning|bad) +{check} ")

    def test_a_mistake_is_one_line(self):
        self.assert_setup_error(run("tandem-doctor", "--duration", "3"), "tandem-doctor: ", "3s")
        self.assert_setup_error(run("tandem-doctor", "--server", "127.0.0.1:x"), "tandem-doctor: ", "port")
        self.assert_setup_error(run("tandem-doctor", "--patience"), "tandem-doctor: ", "--patience")


if __name__ == "__main__":
    unittest.main()
