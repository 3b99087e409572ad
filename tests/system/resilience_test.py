"""Tests programs that are killed, stopped or disconnected in mid-session. No force may remain without a partner, and no
body may remain held."""

import itertools
import json
import math
import os
import signal
import time
import unittest

from support import PATIENCE_S, SOURCE, ProgramTest, Server, finish, full_pipe, read_trace, start_client

import wire  # from tests/attack; support.py adds this folder to the path

ZERO_WITHIN_S = 0.150
RELEASE_WITHIN_S = 2.0


def force_n(row):
    return math.sqrt(sum(row[f"displayed_force_{axis}_n"] ** 2 for axis in "xyz"))


class ServerKilled(ProgramTest):
    def test_forces_fall_to_zero_and_the_client_rejoins(self):
        trace = self.path("trace.csv")
        server = Server("--scene", "peg_in_hole")
        client = start_client(server.port, "--hand", "peg-left", "--duration", "14s", "--json", "--trace", trace)
        time.sleep(3.0)
        server.kill()
        time.sleep(1.5)
        with Server("--scene", "peg_in_hole", port=server.port):
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["status"]["state"], "active")
        self.assertGreaterEqual(summary["reconnects"], 1)
        self.assertTrue(summary["silences"], "the client reports the silence")
        for silence in summary["silences"]:
            self.assertLessEqual(silence["zero_after_ms"], 150.0)
            self.assertTrue(silence["why"])
        self.check_trace(read_trace(trace))

    def check_trace(self, rows):
        """Checks the trace: 150 ms after the last arrival of a state, the displayed force must be zero."""
        self.assertGreater(max(force_n(row) for row in rows), 0.05, "there was a force to lose")
        silent = [row for row in rows if row["state_age_s"] > ZERO_WITHIN_S]
        self.assertGreater(len(silent), 500, "the server was away for more than a second")
        for row in silent:
            self.assertEqual(force_n(row), 0.0, f"at {row['t_s']} s, {row['state_age_s']} s after the last arrival")
        after = [row for row in rows if row["t_s"] > silent[-1]["t_s"] + 1.0]
        self.assertGreater(max(map(force_n, after)), 0.05, "the force comes back with the server")


class RoomReset(ProgramTest):
    RESETS = 3
    PRESSES = {"points": [{"t_s": 0, "position_m": [0, 0, 0], "phase": "approach"}, {"t_s": 1.5, "position_m": [0.0863, 0, 0]},
                          {"t_s": 600, "position_m": [0.0863, 0, 0]}]}

    def write_scene(self):
        """Writes a scene with the block on its spring, and with a second tool for the operator."""
        with open(os.path.join(SOURCE, "server/scenes/push.json")) as file:
            scene = json.load(file)
        scene["tools"].append({"name": "operator's", "placement": {"position_m": [-0.05, 0.3, 0]}, "mass_kg": 0.03})
        scene["limits"] = {"manipulators": 2}
        return self.write("scene.json", json.dumps(scene))

    def test_what_a_hand_presses_on_goes_back_without_a_step_of_force(self):
        trace = self.path("trace.csv")
        with Server("--scene", self.write_scene()) as server:
            client = start_client(server.port, "--hand", self.write("hand.json", json.dumps(self.PRESSES)), "--trace", trace)
            time.sleep(1.0)
            operator = wire.RawClient(server.port)
            operator.join("olga", wire.OPERATOR)
            for reset in range(self.RESETS + 1):
                if reset > 0:
                    operator.stream.sendall(wire.control(wire.RESET_ROOM))
                for _ in range(30):
                    operator.send_state()
                    time.sleep(0.05)
            client.send_signal(signal.SIGINT)
            _, _, err = finish(client)
            operator.close()
        self.assertIn("the operator has reset the room", err)
        pressing = [row for row in read_trace(trace) if row["t_s"] > 2.5][:-100]
        forces = [force_n(row) for row in pressing]
        self.assertGreater(min(forces), 1, "the hand pressed all the time")
        self.assertGreater(max(forces) - min(forces), 0.2, "the block went back, and was pushed away again")
        steps = [math.dist(*([row[f"displayed_force_{axis}_n"] for axis in "xyz"] for row in pair)) for pair in itertools.pairwise(pressing)]
        self.assertLess(max(steps), 0.5)


class ManySessions(ProgramTest):
    # Number of sessions before memory is measured for the first time: up to three models exist at a time.
    SESSIONS_BEFORE = 4
    SESSIONS = 10
    # Permitted growth of memory. Each model needs 22 MB; unreleased models would cause a growth of 220 MB.
    GROWTH_MB = 30

    def resident_mb(self, process):
        with open(f"/proc/{process.pid}/smaps_rollup") as file:
            return next(int(line.split()[1]) / 1024 for line in file if line.startswith("Rss:"))

    def test_each_new_session_costs_no_more_memory(self):
        server = Server("--scene", "two_boxes")
        client = start_client(server.port, "--name", "again", "--duration", "600s")
        server.wait_for_log(r"again.*joined")
        for session in range(self.SESSIONS_BEFORE + self.SESSIONS):
            server.kill()
            server = Server("--scene", "two_boxes", port=server.port)
            server.wait_for_log(r"again.*joined")
            time.sleep(1)
            if session == self.SESSIONS_BEFORE - 1:
                before_mb = self.resident_mb(client)
        grown_mb = self.resident_mb(client) - before_mb
        client.send_signal(signal.SIGINT)
        self.assertEqual(finish(client)[0], 0)
        with server:
            pass
        self.assertLess(grown_mb, self.GROWTH_MB)


class ClientVanished(ProgramTest):
    def test_a_frozen_client_is_released_within_two_seconds(self):
        with Server("--scene", "peg_in_hole") as server:
            client = start_client(server.port, "--hand", "rest", "--name", "frosty", "--duration", "60s")
            server.wait_for_log(r"frosty.*joined|joined.*frosty")
            time.sleep(0.5)
            frozen = time.monotonic()
            # Like an unplugged cable: the connection stays open, but no data arrives.
            os.kill(client.pid, signal.SIGSTOP)
            left = server.wait_for_log(r"frosty.*(left|silence)", after=frozen)
            os.kill(client.pid, signal.SIGKILL)
            client.communicate()
            self.assertLessEqual(left - frozen, RELEASE_WITHIN_S)
            # The seat is free again: two more users must be able to join a room with two seats.
            others = [start_client(server.port, "--duration", "1s", "--name", name) for name in ("a", "b")]
            for process in others:
                code, _, err = finish(process)
                self.assertEqual(code, 0, err)

    def test_a_client_killed_leaves_at_once(self):
        with Server("--scene", "peg_in_hole") as server:
            client = start_client(server.port, "--name", "gone", "--duration", "60s")
            server.wait_for_log(r"gone.*joined|joined.*gone")
            killed = time.monotonic()
            client.kill()
            client.communicate()
            self.assertLessEqual(server.wait_for_log("gone.*left", after=killed) - killed, RELEASE_WITHIN_S)


class UdpBlocked(ProgramTest):
    def test_tcp_carries_the_same_session(self):
        with Server("--scene", "peg_in_hole") as server:
            code, out, err = finish(start_client(server.port, "--transport", "tcp", "--hand", "peg-left",
                                                 "--duration", "5s", "--json"))
            self.assertEqual(code, 0, err)
            summary = json.loads(out)
            self.assertEqual(summary["status"]["state"], "active")
            self.assertGreater(summary["datagrams"]["received"], 500)
            self.assertGreater(summary["force_n"]["max"], 0.05)


class Stopping(ProgramTest):
    """However a client is stopped, its last tick must display no force."""

    numbers = itertools.count()

    def start(self, server, **streams):
        self.trace = self.path(f"trace{next(self.numbers)}.csv")
        begin = time.monotonic()
        client = start_client(server.port, "--hand", "peg-left", "--name", "ender", "--trace", self.trace, **streams)
        server.wait_for_log(r"ender.*joined|joined.*ender", after=begin)
        return client

    def wait_for_force(self):
        deadline = time.monotonic() + PATIENCE_S
        while max(map(force_n, read_trace(self.trace)), default=0) <= 0.05:
            self.assertLess(time.monotonic(), deadline, "no force came")
            time.sleep(0.2)

    def assert_let_go(self, stopped_ns):
        rows = read_trace(self.trace)
        self.assertGreater(max(map(force_n, rows)), 0.05, "there was a force to end")
        self.assertEqual(force_n(rows[-1]), 0.0)
        self.assertLess((rows[-1]["local_ns"] - stopped_ns) * 1e-9, 1.0, "let go when asked, not later")

    def test_each_signal_lets_the_hand_go(self):
        with Server("--scene", "peg_in_hole") as server:
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP):
                with self.subTest(signal=number.name):
                    client = self.start(server)
                    self.wait_for_force()
                    stopped_ns = time.monotonic_ns()
                    client.send_signal(number)
                    code, _, err = finish(client)
                    self.assertEqual(code, 0, err)
                    self.assert_let_go(stopped_ns)

    def test_a_reader_that_goes_away_does_not_kill_the_client(self):
        with Server("--scene", "peg_in_hole") as server:
            reading, writing = os.pipe()
            client = self.start(server, stdout=writing)
            os.close(writing)
            os.close(reading)
            time.sleep(2.5)  # long enough for two status lines
            self.assertIsNone(client.poll(), "alive")
            stopped_ns = time.monotonic_ns()
            client.terminate()
            code, _, err = finish(client)
            self.assertEqual(code, 0, err)
            self.assert_let_go(stopped_ns)

    def test_a_terminal_that_blocks_does_not_keep_the_force_on(self):
        with Server("--scene", "peg_in_hole") as server:
            reading, writing = full_pipe()
            client = self.start(server, stdout=writing)
            os.close(writing)
            time.sleep(2.5)  # long enough for two status lines
            stopped_ns = time.monotonic_ns()
            client.terminate()
            code, _, err = finish(client)
            os.close(reading)
            self.assertEqual(code, 0, err)
            self.assert_let_go(stopped_ns)

    def test_a_second_signal_ends_a_client_that_hangs(self):
        with Server("--scene", "peg_in_hole") as server:
            pipe = self.path("pipe")
            os.mkfifo(pipe)
            # The pipe is never read, so that the main thread blocks while it writes the trace.
            reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
            client = start_client(server.port, "--hand", "peg-left", "--name", "ender", "--trace", pipe)
            server.wait_for_log(r"ender.*joined|joined.*ender")
            time.sleep(2.5)
            client.terminate()
            time.sleep(1.5)
            self.assertIsNone(client.poll(), "main still hangs")
            client.terminate()
            self.assertEqual(finish(client)[0], 1)
            os.close(reading)


if __name__ == "__main__":
    unittest.main()
