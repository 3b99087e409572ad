"""Tests runs that did not fulfil their purpose: exit code 1, one line with the reason, and JSON that does not report
success."""

import json
import resource
import signal
import subprocess
import time
import unittest

from support import ProgramTest, Server, finish, program, start_client

import hostile_server  # from tests/attack; support.py adds this folder to the path


class NoState(ProgramTest):
    """A server whose states do not arrive, like one behind a firewall that blocks UDP."""

    def setUp(self):
        super().setUp()
        self.server = Server("--scene", "wall")
        self.server.__enter__()
        self.lies = hostile_server.Silent()
        self.proxy = hostile_server.Proxy(self.server.port, self.lies)
        self.addCleanup(self.server.__exit__)
        self.addCleanup(self.proxy.close)

    def test_a_session_without_a_single_state_is_not_active_at_its_end(self):
        self.lies.is_lying = True
        for arguments in ((), ("--role", "observer")):
            code, out, err = finish(start_client(self.proxy.port, "--duration", "1s", "--json", *arguments))
            self.assertEqual(code, 1, err)
            self.assertIn("no state was received from the server before the end", err)
            self.assertIn("--transport tcp", err)
            status = json.loads(out)["status"]
            self.assertEqual(status["state"], "silent")
            self.assertIn("no state was received", status["why"])

    def test_one_in_which_states_come_is(self):
        code, out, err = finish(start_client(self.proxy.port, "--duration", "1s", "--json"))
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads(out)["status"], {"state": "active", "why": ""})

    def test_states_of_a_session_that_was_lost_do_not_count_for_the_next(self):
        client = start_client(self.proxy.port, "--duration", "4s", "--json")
        self.server.wait_for_log("joined room")
        time.sleep(1)
        self.lies.is_lying = True
        code, out, err = finish(client)
        self.assertEqual(code, 1, err)
        self.assertNotEqual(json.loads(out)["status"]["state"], "active", err)


class NotDone(ProgramTest):
    def run_client(self, *arguments, **more):
        with Server("--scene", "wall") as server:
            client = subprocess.Popen([program("tandem-client"), "--insecure", "--headless", "--device", "sim", "--server",
                                       f"127.0.0.1:{server.port}", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                      text=True, **more)
            return finish(client)

    def test_a_parameter_that_the_server_does_not_let_one_set(self):
        code, _, err = self.run_client("--duration", "1s", "--set", "coupling.stiffness_n_per_m=300@100ms")
        self.assertEqual(code, 1, err)
        self.assertIn("--set: the server refused 1 of the settings", err)

    def test_a_parameter_whose_time_does_not_come(self):
        code, _, err = self.run_client("--duration", "1s", "--role", "operator", "--set",
                                       "coupling.stiffness_n_per_m=300@5s")
        self.assertEqual(code, 1, err)
        self.assertIn("--set: the run ended before 1 of the parameters were set", err)

    def test_parameters_that_are_set(self):
        code, _, err = self.run_client("--duration", "1s", "--role", "operator", "--set",
                                       "coupling.stiffness_n_per_m=300@100ms")
        self.assertEqual(code, 0, err)

    def test_a_recording_for_which_the_disk_has_no_room(self):
        def small_disk():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

        code, _, err = self.run_client("--duration", "4s", "--hand", "circle", "--record", self.path("a.mcap"),
                                       preexec_fn=small_disk)
        self.assertEqual(code, 1, err)
        self.assertIn("a recording is incomplete", err)


if __name__ == "__main__":
    unittest.main()
