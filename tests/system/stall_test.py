"""Tests stalls: the client, the server or both are stopped for some time (SIGSTOP). No hand may receive a force step,
and no force may remain.

The environment variable TANDEM_STALLS sets the number of stalls of each duration; the default is 3.
"""

import os
import signal
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, read_trace, start_client

STALLS = int(os.environ.get("TANDEM_STALLS", "3"))
DURATIONS_S = (0.02, 0.07, 0.2, 0.5)
RECOVERY_S = 0.9
LATE_S = 0.021
ZERO_WITHIN_TICKS = 25  # 20 ticks, plus a margin for a machine that has just resumed
SLEW_N_PER_MS = 4.0  # slew limit of the simulated device (SafetySettings)
PRESSES = """{"points": [{"t_s": 0, "position_m": [0, 0, 0], "phase": "approach"},
 {"t_s": 1.5, "position_m": [0.073, 0, 0], "phase": "hold"}, {"t_s": 600, "position_m": [0.073, 0, 0]}]}"""


def force_n(row):
    return [row[f"displayed_force_{axis}_n"] for axis in "xyz"]


def length(vector):
    return sum(number * number for number in vector) ** 0.5


def stop_for(processes, seconds):
    for process in processes:
        os.kill(process.pid, signal.SIGSTOP)
    time.sleep(seconds)
    for process in reversed(processes):
        os.kill(process.pid, signal.SIGCONT)


class Stall(ProgramTest):
    def run_stalls(self, stops_client, stops_server, transport):
        trace = self.path("trace.csv")
        with Server("--scene", "wall") as server:
            client = start_client(server.port, "--hand", self.write("press.json", PRESSES), "--transport", transport,
                                  "--trace", trace, "--duration", "600s")
            time.sleep(3.5)
            self.assertIsNone(client.poll(), "it ended by itself")
            processes = ([client] if stops_client else []) + ([server.process] if stops_server else [])
            for _ in range(STALLS):
                for duration_s in DURATIONS_S:
                    stop_for(processes, duration_s)
                    time.sleep(RECOVERY_S)
            client.send_signal(signal.SIGINT)
            finish(client)
        rows = read_trace(trace)
        self.check_steps(rows)
        late = self.check_late_ticks(rows)
        if stops_client:
            self.assertGreaterEqual(late, STALLS * (len(DURATIONS_S) - 1), "the client was not stopped")

    def check_steps(self, rows):
        self.assertGreater(max(length(force_n(row)) for row in rows), 3, "there was no force to lose")
        for before, row in zip(rows, rows[1:]):
            step = length([a - b for a, b in zip(force_n(row), force_n(before))])
            self.assertLessEqual(step, SLEW_N_PER_MS + 1e-6, f"at {row['t_s']} s")

    def check_late_ticks(self, rows):
        """Checks that after each late tick the force soon falls to zero and does not rise before that. Returns the
        number of late ticks."""
        count = ticks = 0
        falling_from = None
        for before, row in zip(rows, rows[1:]):
            now = length(force_n(row))
            if (row["local_ns"] - before["local_ns"]) * 1e-9 > LATE_S + 0.001:
                count += 1
                falling_from, ticks = length(force_n(before)), 0
            if falling_from is None:
                continue
            ticks += 1
            self.assertTrue(now == 0 or ticks < ZERO_WITHIN_TICKS, f"at {row['t_s']} s it is not zero, {ticks} ticks after")
            self.assertLessEqual(now, falling_from + 1e-6, f"at {row['t_s']} s it rises before it was zero")
            falling_from = None if now == 0 else now
        return count

    def test_of_the_client(self):
        self.run_stalls(True, False, "udp")

    def test_of_the_client_over_tcp(self):
        self.run_stalls(True, False, "tcp")

    def test_of_the_server(self):
        self.run_stalls(False, True, "udp")

    def test_of_the_server_over_tcp(self):
        self.run_stalls(False, True, "tcp")

    def test_of_both(self):
        self.run_stalls(True, True, "udp")

    def test_of_both_over_tcp(self):
        self.run_stalls(True, True, "tcp")


if __name__ == "__main__":
    unittest.main()
