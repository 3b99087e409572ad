"""Tests a server that writes checkpoints and is killed by kill -9. The next server must continue from the checkpoint,
and all users must rejoin automatically."""

import glob
import json
import os
import random
import signal
import subprocess
import time
import unittest

from secure_test import SecureServer, SecureTest, start_client
from support import PATIENCE_S, finish, free_port, program, read_trace, replay_killed, run

KILLS = int(os.environ.get("TANDEM_KILLS", "4"))
# Upper bound of a peg's motion within one second while two hands move it [m].
MOST_MOVED_M = 0.05


class KeptServer(SecureServer):
    """A server with --resume that records. `end` stops the server with a signal."""

    def __init__(self, folder, port, number):
        self.records = os.path.join(folder, f"records{number}")
        super().__init__(folder, "--resume", "--record", self.records, port=port, scene="peg_in_hole")

    def end(self, sign=signal.SIGKILL):
        self.process.send_signal(sign)
        self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        self.process.stdout.close()
        self.process.stderr.close()

    def recording(self):
        return glob.glob(os.path.join(self.records, "*.mcap"))[0]


class Restarts(SecureTest):
    def bodies(self, server, number):
        folder = self.path(f"tables{number}")
        is_exported, _, err = replay_killed("export", server.recording(), "--out", folder)
        self.assertTrue(is_exported, err)
        return read_trace(os.path.join(folder, "bodies.csv"))

    def moved(self, one, other):
        return max(abs(one[f"peg_p_{axis}_m"] - other[f"peg_p_{axis}_m"]) for axis in "xyz")

    def test_go_on_where_the_killed_server_was(self):
        seed = int(os.environ.get("TANDEM_TEST_SEED", "1"))
        print(f"TANDEM_TEST_SEED={seed}")
        moments = random.Random(seed)
        port = free_port()
        server = KeptServer(self.folder, port, 0)
        invitations = [server.invitation("--name", name) for name in ("anna", "ben")]
        clients = []
        for invitation, name, hand in zip(invitations, ("anna", "ben"), ("peg-left", "peg-right")):
            clients.append(start_client("--join", invitation, "--hand", hand, "--duration", f"{60 + 10 * KILLS}s"))
            server.wait_for(f"{name}.*joined")
        before = None
        for number in range(KILLS + 1):
            time.sleep(moments.uniform(1.0, 3.0))
            ended = time.time()
            server.end()
            rows = self.bodies(server, number)
            self.assertLess(ended - rows[-1]["unix_s"], 1.0)
            if before is not None:
                self.assertLess(self.moved(rows[0], before), MOST_MOVED_M, "at most a second was lost")
            played = replay_killed("play", server.recording(), "--json")
            self.assertTrue(played[0], played)
            before = rows[-1]
            if number == KILLS:
                break
            server = KeptServer(self.folder, port, number + 1)
            server.wait_for("continues from its state of")
            for name in ("anna", "ben"):
                server.wait_for(f"{name}.*joined")
        for client in clients:
            client.kill()
            client.communicate()

    def test_a_token_that_was_used_stays_used_and_a_drained_server_goes_on(self):
        port = free_port()
        server = KeptServer(self.folder, port, 0)
        used, unused = server.invitation("--name", "anna"), server.invitation("--name", "ben")
        client = start_client("--join", used, "--duration", "60s")
        server.wait_for("anna.*joined")
        time.sleep(0.5)
        server.end()
        server = KeptServer(self.folder, port, 1)
        server.wait_for("anna.*joined")
        self.assert_refused(["used before"], "--join", used)
        self.assert_joined(start_client("--join", unused, "--duration", "1s"))
        server.end(signal.SIGTERM)
        server = KeptServer(self.folder, port, 2)
        server.wait_for("anna.*joined")
        client.kill()
        client.communicate()
        server.end()

    def test_a_run_without_the_option_between_two_with_it_makes_nothing_valid_again(self):
        port = free_port()
        server = KeptServer(self.folder, port, 0)
        client = start_client("--join", server.invitation("--name", "anna"), "--duration", "60s")
        server.wait_for("anna.*joined")
        time.sleep(0.7)  # time for the next checkpoint, which includes the session
        server.end()
        os.kill(client.pid, signal.SIGSTOP)  # prevents anna from rejoining before the last run
        with SecureServer(self.folder, port=port) as server:
            used = server.invitation("--name", "ben")
            self.assert_joined(start_client("--join", used, "--duration", "1s"))
        server = KeptServer(self.folder, port, 2)
        self.assert_refused(["used before"], "--join", used)
        os.kill(client.pid, signal.SIGCONT)
        code, _, err = finish(client)
        self.assertNotEqual(code, 0)
        self.assertIn("cannot be resumed", err)
        server.end()

    def test_two_servers_do_not_share_a_folder(self):
        with SecureServer(self.folder, "--resume") as server:
            result = run("tandem-server", "--scene", "free", "--port", "0", "--resume", "--state", server.state)
            self.assert_setup_error(result, "--state", "another server")

    def test_what_a_server_left_that_was_killed_while_it_wrote_is_removed(self):
        with SecureServer(self.folder, "--resume") as server:
            left = os.path.join(server.state, "checkpoint.pb.a1B2c3")
        with open(left, "w") as file:
            file.write("half")
        with SecureServer(self.folder, "--resume"):
            self.assertFalse(os.path.exists(left))

    def test_without_the_option_everything_begins_anew(self):
        with SecureServer(self.folder) as server:
            self.assertFalse(os.path.exists(os.path.join(server.state, "checkpoint.pb")))


if __name__ == "__main__":
    unittest.main()
