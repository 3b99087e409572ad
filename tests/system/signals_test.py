"""Tests signals: other programs send them to the game of a room, under a separate role. Tests the program that is run
when a game calls a person."""

import json
import os
import re
import stat
import subprocess
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, program, run, start_client

GAME = {
    "signals": [{"name": "valence", "max_age_s": 60, "states": [{"name": "negative", "below": 0}, {"name": "positive", "above": 0}]}],
    "time_limit_s": 3, "call": {"at_time_limit": True, "said": {"text": "somebody comes"}},
    "levels": [{"name": "a", "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}}]}]}]}
SCENE = {
    "name": "play",
    "bodies": [{"name": "ball", "shapes": [{"sphere": {"radius_m": 0.01}}], "mass_kg": 0.05, "graspable": True, "gravity": False,
                "placement": {"position_m": [0.3, 0, 0]}}],
    "tools": [{"name": "a"}], "game": GAME}


def send(text, *arguments):
    done = subprocess.run([program("tandem-signal"), *arguments], input=text, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    return done.returncode, done.stdout, done.stderr


class Signals(ProgramTest):
    def scene(self, **changes):
        return self.write("play.json", json.dumps({**SCENE, "game": {**GAME, **changes}}))

    def test_lines_reach_the_game_which_calls_once(self):
        calls = self.path("calls")
        script = self.write("call me", f"#!/bin/sh\nprintf '%s|%s\\n' \"$1\" \"$2\" >> '{calls}'\n")
        os.chmod(script, stat.S_IRWXU)
        with Server("--scene", self.scene(), "--on-call", script) as server:
            client = start_client(server.port, "--json", "--duration", "5s", "--hand", "rest")
            server.wait_for_log("user 1 .* joined")
            time.sleep(1)
            code, _, err = send("# a comment\nvalence -0.5 0.9\nvalence 0.5 0.9 0.1\n", "--server", f"127.0.0.1:{server.port}",
                                "--insecure")
            self.assertEqual(code, 0, err)
            self.assertIn("the signals of the room: valence", err)
            server.wait_for_log("joined room play as a source of signals")
            server.wait_for_log("call me for room play .*exit code 0")
            time.sleep(1)
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        game = json.loads(out)["game"]
        self.assertEqual([event["kind"] for event in game["events"]].count("CALLED"), 1)
        self.assertEqual(game["phase"], "LOST")
        self.assertIn("somebody comes", err)
        self.assertEqual([signal["name"] for signal in game["signals"]], ["valence"])
        self.assertTrue(game["signals"][0]["fresh"], game["signals"])
        self.assertEqual(game["signals"][0]["value"], 0.5)
        with open(calls, encoding="utf-8") as file:
            self.assertEqual(file.read(), "play|time-limit\n")

    def test_wrong_lines_are_named_and_the_others_sent(self):
        with Server("--scene", self.scene(time_limit_s=0, call={})) as server:
            to = ("--server", f"127.0.0.1:{server.port}", "--insecure")
            code, _, err = send("valence x\narousal 1\nvalence 0.25\n" + "v" * 10000 + "\n", *to)
            self.assertEqual(code, 1)
            self.assertRegex(err, r"line 1: the value 'x' is not a number")
            self.assertRegex(err, r"line 2: the game of the room has no signal 'arousal'; it has valence")
            self.assertRegex(err, r"line 4: it is longer than 256 bytes")
            code, _, err = send("", *to, "--generate", "valence", "--duration", "1s", "--rate", "20")
            self.assertEqual(code, 0, err)
            self.assert_setup_error(run("tandem-signal", *to, "--generate", "arousal", "--duration", "1s"), "tandem-signal: ", "arousal")
            self.assert_setup_error(run("tandem-signal", *to, "--generate", "valence", "--rate", "99"), "tandem-signal: ", "--rate")

    def test_a_call_without_program_is_announced_at_the_start(self):
        with Server("--scene", self.scene()) as server:
            server.wait_for_log("room play: its game calls a person, and --on-call is missing.*give --on-call PROGRAM")

    def test_a_value_that_the_server_refuses_fails(self):
        """The name is known, so only the answer of the server tells that the value is refused."""
        with Server("--scene", self.scene(time_limit_s=0, call={})) as server:
            to = ("--server", f"127.0.0.1:{server.port}", "--insecure")
            others = [subprocess.Popen([program("tandem-signal"), *to, "--generate", "valence", "--rate", "40"],
                                       stderr=subprocess.DEVNULL) for _ in range(7)]
            try:
                # Seven sources send 280 values per second. The room accepts 200 per second, and 400 at once.
                code, deadline = 0, time.monotonic() + PATIENCE_S
                while code == 0 and time.monotonic() < deadline:
                    code, _, err = send("valence 1\n" * 50, *to)
            finally:
                for other in others:
                    other.terminate()
                    other.wait(PATIENCE_S)
            self.assertEqual(code, 1, err)

    def test_a_lost_server_fails_and_ends_the_wait(self):
        with Server("--scene", self.scene(time_limit_s=0, call={})) as server:
            source = subprocess.Popen([program("tandem-signal"), "--server", f"127.0.0.1:{server.port}", "--insecure"],
                                      stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            server.wait_for_log("joined room play as a source of signals")
            server.kill()
            _, err = source.communicate("valence 1\n", PATIENCE_S)
            self.assertEqual(source.returncode, 1, err)
            self.assertIn("the server has not confirmed 1 value; check the connection", err)

    def test_a_generated_signal_ends_at_once(self):
        with Server("--scene", self.scene(time_limit_s=0, call={})) as server:
            source = subprocess.Popen([program("tandem-signal"), "--server", f"127.0.0.1:{server.port}", "--insecure", "--generate",
                                       "valence", "--rate", "0.1"], stderr=subprocess.DEVNULL)
            server.wait_for_log("joined room play as a source of signals")
            time.sleep(0.5)
            begin = time.monotonic()
            source.terminate()
            self.assertEqual(source.wait(PATIENCE_S), 0)
            self.assertLess(time.monotonic() - begin, 5, "the next value would be sent after 10 s")

    def test_a_room_without_signals_refuses_them(self):
        with Server("--scene", "free") as server:
            self.assert_setup_error(send("valence 1\n", "--server", f"127.0.0.1:{server.port}", "--insecure"), "tandem-signal: ",
                                    "no game with signals")

    def test_a_program_that_cannot_be_run_is_a_set_up_error(self):
        self.assert_setup_error(run("tandem-server", "--port", "0", "--insecure", "--scene", "free", "--on-call", self.path("none")),
                                "--on-call", "cannot be executed")

    def test_a_token_of_the_role_admits_a_source_and_nobody_else(self):
        state = self.path("state")
        server = subprocess.Popen([program("tandem-server"), "--port", "0", "--scene", self.scene(), "--state", state, "--invite", "3",
                                   "--invite-role", "signal"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            port = re.search(r"127\.0\.0\.1:(\d+)", server.stdout.readline()).group(1)
            invitations = [server.stdout.readline().split()[-1] for _ in range(3)]
            code, _, err = send("valence 1\n", "--join", invitations[0])
            self.assertEqual(code, 0, err)
            code, _, err = run("tandem-client", "--headless", "--device", "sim", "--duration", "1s", "--role", "manipulator",
                               "--join", invitations[1])
            self.assertEqual(code, 2)
            self.assertIn("for sending signals only", err)
            self.assertTrue(port)
            code, _, err = send(invitations[2] + "\nvalence 1\nvalence x\n", "--join", "-")
            self.assertEqual(code, 1, "the lines after the invitation are read")
            self.assertIn("line 2: the value 'x' is not a number", err)
        finally:
            server.terminate()
            server.wait(PATIENCE_S)
            server.stdout.close()


if __name__ == "__main__":
    unittest.main()
