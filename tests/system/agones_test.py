"""Tests a server that reports its state to a substitute for the Agones sidecar, and a server whose sidecar is not
reachable."""

import os
import signal
import socket
import unittest
from unittest import mock

from agones_sidecar import Sidecar
from support import PATIENCE_S, ProgramTest, Server, finish, free_port, run, start_client


class Lifecycle(ProgramTest):
    def test_from_ready_to_shutdown(self):
        with Sidecar() as sidecar:
            with Server("--scene", "wall", "--agones", str(sidecar.port)) as server:
                sidecar.wait_for("/ready")
                sidecar.wait_for("/health", 2)
                self.assertEqual(sidecar.paths(), ["/ready"], "nobody is there yet")
                finish(start_client(server.port, "--duration", "1s"))
                sidecar.wait_for("/allocate")
                finish(start_client(server.port, "--duration", "1s"))
                server.process.send_signal(signal.SIGTERM)
                self.assertEqual(server.process.wait(PATIENCE_S), 0)
            self.assertEqual(sidecar.paths(), ["/ready", "/gameserver", "/allocate", "/shutdown"])
            self.assertEqual(sidecar.state, "Shutdown")
            self.assertEqual(sidecar.wrong, [])

    def test_what_was_allocated_from_outside_is_not_allocated_again(self):
        with Sidecar() as sidecar, Server("--scene", "wall", "--agones", str(sidecar.port)) as server:
            sidecar.wait_for("/ready")
            sidecar.state = "Allocated"
            client = start_client(server.port, "--duration", "3s")
            sidecar.wait_for("/gameserver")
            finish(client)
            self.assertEqual(sidecar.count("/allocate"), 0)

    def test_the_end_of_a_given_time_is_told_too(self):
        with Sidecar() as sidecar:
            with Server("--scene", "wall", "--agones", str(sidecar.port), "--duration", "1s") as server:
                self.assertEqual(server.process.wait(PATIENCE_S), 0)
            self.assertEqual(sidecar.paths()[-1], "/shutdown")

    def test_the_port_comes_from_the_environment(self):
        with Sidecar() as sidecar, mock.patch.dict(os.environ, AGONES_SDK_HTTP_PORT=str(sidecar.port)):
            with Server("--scene", "wall", "--agones"):
                sidecar.wait_for("/ready")


class Trouble(ProgramTest):
    def test_refusals_are_tried_again(self):
        with Sidecar() as sidecar:
            sidecar.fails = 3
            with Server("--scene", "wall", "--agones", str(sidecar.port)) as server:
                sidecar.wait_for("/ready")
                server.wait_for_log("sidecar.*answers")
            told = [line for _, line in server.log if "sidecar" in line]
            self.assertRegex(told[0], "does not answer: status 500")
            self.assertEqual(len(told), 2, told)

    def test_without_a_sidecar_the_server_serves_and_says_so_once(self):
        port = free_port()
        with Server("--scene", "wall", "--agones", str(port)) as server:
            code, _, err = finish(start_client(server.port, "--duration", "3s"))
            self.assertEqual(code, 0, err)
            told = [line for _, line in server.log if "sidecar" in line]
            self.assertEqual(len(told), 1, told)
            self.assertRegex(told[0], f"127.0.0.1:{port} does not answer")
            with Sidecar(port) as late:
                late.wait_for("/ready")
                server.wait_for_log("sidecar.*answers")

    def test_a_sidecar_that_hangs_holds_up_neither_users_nor_the_end(self):
        with socket.socket() as hangs:
            hangs.bind(("127.0.0.1", 0))
            hangs.listen()
            with Server("--scene", "wall", "--agones", str(hangs.getsockname()[1])) as server:
                code, _, err = finish(start_client(server.port, "--duration", "2s"))
                self.assertEqual(code, 0, err)
                server.process.send_signal(signal.SIGTERM)
                self.assertEqual(server.process.wait(PATIENCE_S), 0)

    def test_what_is_no_port_is_refused(self):
        for port in ("0", "70000", "sidecar"):
            with self.subTest(port=port):
                self.assert_setup_error(run("tandem-server", "--insecure", "--scene", "wall", "--agones", port), "--agones", port)
        with mock.patch.dict(os.environ, AGONES_SDK_HTTP_PORT="here"):
            self.assert_setup_error(run("tandem-server", "--insecure", "--scene", "wall", "--agones"),
                                    "AGONES_SDK_HTTP_PORT", "here")


if __name__ == "__main__":
    unittest.main()
