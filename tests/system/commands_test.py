"""Tests scripts that dock two molecules without a window. tandem-client --commands reads each command as a line and
writes an answer."""

import json
import os
import select
import signal
import subprocess
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, program

import needs  # from tests/support; support.py adds this folder to the path

HELICES = "/usr/share/pymol/test/dat/3al1.pdb"


class Script:
    """A client with --commands. The test writes commands to it and reads its answers one by one."""

    def __init__(self, port, *arguments):
        self.process = subprocess.Popen(
            [program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{port}", "--headless", "--device", "mouse", "--name",
             "ada", "--commands", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1)

    def write(self, *lines):
        self.process.stdin.write("".join(line + "\n" for line in lines))
        self.process.stdin.flush()

    def answer(self):
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE_S)
        if not ready:
            raise AssertionError("no answer came")
        return json.loads(self.process.stdout.readline())

    def ask(self, line):
        self.write(line)
        return self.answer()

    def end(self, *lines):
        """Writes these lines and waits until the client ends. Returns (exit code, remaining answers, stderr)."""
        out, err = self.process.communicate("".join(line + "\n" for line in lines), timeout=PATIENCE_S)
        return self.process.returncode, [json.loads(line) for line in out.splitlines()], err


class Commands(ProgramTest):
    files = (HELICES, needs.OPLS)

    def server(self, *arguments):
        return Server("--receptor", HELICES + ":A", "--ligand", HELICES + ":B", "--cache", self.path("cache"), "--keep", self.path("kept"),
                      *arguments)

    def client_with(self, port, text, *arguments, stdout=subprocess.PIPE):
        return subprocess.run([program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{port}", "--headless", "--device",
                               "mouse", "--name", "ada", "--commands", *arguments],
                              input=text, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)

    def assert_ok(self, answer, command):
        self.assertEqual((answer["command"], answer["ok"]), (command, True), answer)
        return answer

    def test_a_script_docks_in_the_shipped_scene(self):
        trace = self.path("trace.csv")
        with Server("--scene", "docking_helices", "--keep", self.path("kept")) as server:
            script = Script(server.port, "--trace", trace)
            ok = lambda line: self.assert_ok(script.ask(line), line.split()[0])
            self.assertEqual([pose["number"] for pose in ok("poses")["poses"]], [0])
            before = ok("state")
            self.assertEqual((before["holds"], [body["name"] for body in before["bodies"]]), ("helix_a", ["helix_a", "helix_b"]))
            apart = ok("keep apart")
            self.assertEqual((apart["number"], apart["name"], apart["user"]), (1, "apart", "ada"))
            moved = ok("move-by 0 0.03 0")
            self.assertLess(moved["off_m"], 0.01, "the molecules pull a little")
            self.assertFalse(moved["is_held_up"])
            self.assertGreater(ok("state")["tool"]["position_m"][1], before["tool"]["position_m"][1] + 0.02)
            near = ok("keep \"near by\"")
            self.assertLess(near["energy_kj_per_mol"], apart["energy_kj_per_mol"])
            minimised = ok("minimise")
            self.assertLess(minimised["energy_kj_per_mol"], near["energy_kj_per_mol"] - 10)
            self.assertAlmostEqual(ok("energy")["energy_kj_per_mol"], minimised["energy_kj_per_mol"], delta=5)
            found = ok("keep")
            self.assertLess(found["energy_kj_per_mol"], near["energy_kj_per_mol"] - 10)
            self.assertEqual(ok("rename 3 bound")["name"], "bound")
            self.assertEqual(ok("visit apart")["number"], 1)
            self.assertGreater(ok("energy")["energy_kj_per_mol"], minimised["energy_kj_per_mol"] + 10)
            self.assertIn("back", ok("undo")["text"])
            self.assertEqual(ok("delete \"near by\""), {"line": 14, "command": "delete", "ok": True, "number": 2, "name": "near by"})
            self.assertEqual([pose["name"] for pose in ok("poses")["poses"]], ["as in the files", "apart", "bound"])
            self.assertEqual(ok("release")["released"], "helix_a")
            self.assertIsNone(ok("state")["holds"])
            self.assertEqual(ok("grab")["holds"], "helix_a")
            code, rest, err = script.end("quit")
            self.assertEqual((code, [answer["command"] for answer in rest]), (0, ["quit"]), err)
        with open(trace) as file:
            self.assertGreater(len(file.readlines()), 1000)

    def test_each_wrong_command_has_an_answer_and_the_others_go_on(self):
        lines = ["keep near", "rename near both", "keep both", "visit both", "visit #1", "visit far", "delete 0", "fly", "", "move 1 2",
                 "wait soon", "x" * 5000, "move 90 0 0", "keep a\x07b", "minimise 0", "turn 0 0 1 30"]
        with self.server() as server:
            done = self.client_with(server.port, "\n".join(lines))
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual([answer["line"] for answer in answers], list(range(1, len(lines) + 1)))
        self.assertEqual([answer["line"] for answer in answers if answer["ok"]], [1, 2, 3, 5, 16])
        for line, words in {4: ["#1 \"both\", #2 \"both\""], 6: ["'far' is not kept"], 7: ["the files themselves"], 8: ["'fly'", "minimise"],
                            9: ["is empty"], 10: ["Z is missing"], 11: ["SECONDS: 'soon'", "[s]"], 12: ["longer than 1024 bytes"],
                            13: ["out of reach"], 14: ["printable"], 15: ["0.1 to 3600"]}.items():
            for word in words:
                self.assertIn(word, answers[line - 1]["error"])
        self.assertEqual(done.returncode, 1)
        self.assertIn("11 of 16 commands failed", done.stderr)

    def test_the_end_of_the_input_ends_the_program(self):
        with self.server() as server:
            done = self.client_with(server.port, "")
            self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
            done = self.client_with(server.port, "wait 0.5\nenergy")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual([json.loads(line)["command"] for line in done.stdout.splitlines()], ["wait", "energy"])

    def test_many_requests_are_no_faster_than_the_server_takes_them(self):
        with self.server() as server:
            done = self.client_with(server.port, "keep\n" * 14)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_a_server_that_is_killed_leaves_no_command_without_an_answer(self):
        with self.server() as server:
            script = Script(server.port)
            self.assert_ok(script.ask("keep near"), "keep")
            # A stopped server cannot answer, so the next request remains pending.
            os.kill(server.process.pid, signal.SIGSTOP)
            script.write("minimise", "visit near", "move-by 0 0.01 0", "poses", "state", "wait 0.1", "help")
            time.sleep(0.3)
            server.kill()
            code, answers, err = script.end()
        self.assertEqual([answer["command"] for answer in answers], ["minimise", "visit", "move-by", "poses", "state", "wait", "help"])
        for answer in answers[:-1]:
            self.assertIn("not in a room", answer["error"])
        self.assertTrue(answers[-1]["ok"])
        self.assertEqual(code, 1, err)
        self.assertIn("the session was lost", err)

    def test_a_minimisation_is_cancelled_after_its_time(self):
        with self.server() as server:
            script = Script(server.port)
            self.assert_ok(script.ask("energy"), "energy")
            # While the server is stopped, request and cancellation accumulate, and then arrive together.
            os.kill(server.process.pid, signal.SIGSTOP)
            script.write("minimise 0.1")
            time.sleep(0.5)
            os.kill(server.process.pid, signal.SIGCONT)
            self.assertIn("the minimisation was cancelled", script.answer()["error"])
            self.assertLess(self.assert_ok(script.ask("minimise 60"), "minimise")["energy_kj_per_mol"], -20)
            self.assertEqual(script.end()[0], 1, "a command failed")

    def test_a_signal_answers_the_command_that_is_not_done(self):
        with self.server() as server:
            script = Script(server.port)
            self.assert_ok(script.ask("energy"), "energy")
            script.write("wait 60", "energy")
            time.sleep(0.3)
            script.process.send_signal(signal.SIGTERM)
            code, answers, err = script.end()
        self.assertEqual([answer["error"] for answer in answers], ["the program ends before this is done"], err)
        self.assertEqual(code, 1, err)

    def test_a_reader_who_goes_away_ends_the_program(self):
        with self.server() as server:
            script = Script(server.port)
            self.assert_ok(script.ask("energy"), "energy")
            script.process.stdout.close()
            script.write("energy")
            self.assertEqual(script.process.wait(PATIENCE_S), 1)
            self.assertIn("an answer could not be written: Broken pipe", script.process.stderr.read())
            script.process.stdin.close()
            script.process.stderr.close()

    def test_a_hand_that_is_no_mouse_is_not_moved(self):
        with self.server() as server:
            done = subprocess.run([program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{server.port}", "--headless", "--device",
                                   "sim", "--commands"], input="move-by 0 0 0\nkeep\n", capture_output=True, text=True, timeout=PATIENCE_S)
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertIn("--device mouse", answers[0]["error"])
        self.assertTrue(answers[1]["ok"])

    def test_other_rooms_keep_no_poses(self):
        with Server("--scene", "two_boxes") as server:
            done = self.client_with(server.port, "poses\nkeep\nenergy\nstate\nmove-by 0 0 0.01\n")
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual([answer["ok"] for answer in answers], [False, False, False, True, True])
        self.assertIn("exactly two molecules", answers[0]["error"])
        self.assertIn("there are none here", answers[1]["error"])


if __name__ == "__main__":
    unittest.main()
