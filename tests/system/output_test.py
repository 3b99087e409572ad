"""Tests programs whose output is not read or whose reader has ended. Forces and messages must not be delayed, and the
program must still end on request."""

import json
import os
import re
import signal
import socket
import subprocess
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, free_port, full_pipe, program, read_trace, start_client

END_WITHIN_S = 2.0
SILENCE_S = 0.150  # longest permitted time of a displayed force after the last state (SafetySettings)
PRESSES = """{"points": [{"t_s": 0, "position_m": [0, 0, 0], "phase": "approach"},
 {"t_s": 1, "position_m": [0.073, 0, 0], "phase": "hold"}, {"t_s": 600, "position_m": [0.073, 0, 0]}]}"""


def force_n(row):
    return sum(row[f"displayed_force_{axis}_n"] ** 2 for axis in "xyz") ** 0.5


def connect(port):
    """Returns a connection as soon as the server accepts one."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


class Hanging:
    """A pipe for the output of a program. The pipe is full and never read, or its read end is closed."""

    def __init__(self, is_gone=False):
        self.reading, self.writing = os.pipe() if is_gone else full_pipe()
        if is_gone:
            os.close(self.reading)
            self.reading = None

    def __enter__(self):
        return self.writing

    def __exit__(self, *_):
        os.close(self.writing)
        if self.reading is not None:
            os.close(self.reading)


class ServersReader(ProgramTest):
    def start(self, *arguments, **streams):
        self.port = free_port()
        streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **streams}
        server = subprocess.Popen([program("tandem-server"), "--insecure", "--port", str(self.port), "--scene", "wall", *arguments],
                                  **streams)
        self.addCleanup(lambda: (server.kill(), server.wait()))
        connect(self.port).close()
        return server

    def hold_the_wall(self, server):
        """Lets a hand press on the wall while 30 connections are opened and closed, each of which causes log lines."""
        trace = self.path("trace.csv")
        client = start_client(self.port, "--hand", self.write("press.json", PRESSES), "--trace", trace,
                              "--duration", "600s")
        time.sleep(2.5)
        for _ in range(30):
            connect(self.port).close()
            time.sleep(0.05)
        self.assertIsNone(server.poll(), "the server serves")
        client.send_signal(signal.SIGINT)
        code, _, err = finish(client)
        self.assertEqual(code, 0, err)
        rows = [row for row in read_trace(trace) if row["t_s"] > 1.5]
        self.assertGreater(len(rows), 1000)
        self.assertLess(max(row["state_age_s"] for row in rows), SILENCE_S, "states go on")
        self.assertGreater(max(map(force_n, rows)), 3, "there is a wall")

    def assert_ends(self, server, number):
        asked = time.monotonic()
        server.send_signal(number)
        self.assertEqual(server.wait(PATIENCE_S), 0)
        self.assertLess(time.monotonic() - asked, END_WITHIN_S)

    def test_hangs(self):
        with Hanging() as pipe:
            server = self.start(stderr=pipe)
            self.hold_the_wall(server)
            self.assert_ends(server, signal.SIGTERM)

    def test_hangs_on_everything_and_on_the_report(self):
        with Hanging() as pipe:
            server = self.start("--json", stdout=pipe, stderr=pipe)
            self.hold_the_wall(server)
            self.assert_ends(server, signal.SIGHUP)

    def test_is_gone(self):
        with Hanging(is_gone=True) as pipe:
            server = self.start("--json", stdout=pipe, stderr=pipe)
            self.hold_the_wall(server)
            self.assert_ends(server, signal.SIGTERM)

    def test_hangs_while_the_server_is_loading(self):
        with Hanging() as pipe:
            cube = self.write("cube.obj", "".join(f"v {i & 1} {i >> 1 & 1} {i >> 2}\n" for i in range(8)) +
                              "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n")
            body = {"name": "m", "shapes": [{"mesh": {"file": cube, "largest_size_m": 0.05}}]}
            scene = self.write("s.json", json.dumps({"name": "s", "bodies": [body], "tools": [{"name": "a"}]}))
            server = self.start("--scene", scene, "--cache", "", stderr=pipe)
            self.assert_ends(server, signal.SIGINT)

    def test_hangs_on_what_is_wrong_with_the_set_up(self):
        with Hanging() as pipe:
            done = subprocess.run([program("tandem-server"), "--bogus"], stderr=pipe, timeout=PATIENCE_S)
            self.assertEqual(done.returncode, 2)


class SignalsToTheServer(ProgramTest):
    def test_each_says_goodbye(self):
        for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
            with self.subTest(signal=number.name), Server("--scene", "wall") as server:
                client = start_client(server.port, "--name", "told", "--duration", "60s")
                server.wait_for_log("told.*joined")
                time.sleep(0.5)
                asked = time.monotonic()
                server.process.send_signal(number)
                self.assertEqual(server.process.wait(PATIENCE_S), 0)
                self.assertLess(time.monotonic() - asked, END_WITHIN_S)
                time.sleep(0.2)
                client.terminate()
                self.assertIn("the server ended the connection", finish(client)[2])

    def test_one_that_is_ignored_from_the_start_stays_so(self):
        server = subprocess.Popen(["nohup", program("tandem-server"), "--insecure", "--port", "0", "--scene", "wall", "--json"],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while "listening on" not in server.stderr.readline():
            pass
        server.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        self.assertIsNone(server.poll())
        server.terminate()
        self.assertEqual(finish(server)[0], 0)


class Flood(ProgramTest):
    def test_of_connections_does_not_fill_the_log(self):
        with Server("--scene", "wall") as server:
            for _ in range(400):
                connect(server.port).close()
            server.wait_for_log("more than 60 lines a minute of the kind \"closed\"")
            time.sleep(0.5)  # the server limits the rate of new connections
            server.process.terminate()
            server.process.wait(PATIENCE_S)
        text = "\n".join(line for _, line in server.log)
        self.assertEqual(len(re.findall("connection [0-9]+ closed", text)), 60)
        left_out = re.search("left out: ([0-9]+) lines of the kind \"closed\"", text)
        self.assertGreater(int(left_out.group(1)), 250, "and it says how many there were")


class ClientsReader(ProgramTest):
    def run_client(self, *arguments, **streams):
        """Lets a hand press on the wall. States and force must continue. On request, the client must reduce the force
        to zero and end."""
        trace = self.path("trace.csv")
        with Server("--scene", "wall") as server:
            client = start_client(server.port, "--hand", self.write("press.json", PRESSES), "--trace", trace,
                                  "--duration", "600s", *arguments, **streams)
            time.sleep(4)
            self.assertIsNone(client.poll(), "it plays")
            asked = time.monotonic()
            client.send_signal(signal.SIGHUP)
            self.assertEqual(client.wait(PATIENCE_S), 0)
            self.assertLess(time.monotonic() - asked, END_WITHIN_S)
            if client.stderr:
                client.stderr.close()
        rows = read_trace(trace)
        held = [row for row in rows if 1.5 < row["t_s"] < rows[-1]["t_s"] - 0.5]
        self.assertGreater(len(held), 1000)
        self.assertLess(max(row["state_age_s"] for row in held), SILENCE_S)
        self.assertGreater(max(map(force_n, held)), 3)
        self.assertEqual(force_n(rows[-1]), 0.0)

    def test_hangs_on_the_status_lines(self):
        with Hanging() as pipe:
            self.run_client(stdout=pipe)

    def test_hangs_on_the_report(self):
        with Hanging() as pipe:
            self.run_client("--json", stdout=pipe)

    def test_hangs_on_everything(self):
        with Hanging() as pipe:
            self.run_client("--verbose", stdout=pipe, stderr=pipe)

    def test_is_gone(self):
        with Hanging(is_gone=True) as pipe:
            self.run_client("--verbose", stdout=pipe, stderr=pipe)


if __name__ == "__main__":
    unittest.main()
