"""Tests tandem-lab therapy: a session is recorded, measured, reported and deleted. Tests invalid arguments, and a run
that is killed."""

import glob
import json
import os
import random
import shutil
import stat
import subprocess
import time
import unittest

import figures
from support import PATIENCE_S, ProgramTest, Server, finish, program, run, start_client

NOTICE = "Not a medical device"
FIRST_PAGE_END = '<section class="appendix">'


class Therapy(ProgramTest):
    recording = None

    @classmethod
    def setUpClass(cls):
        """One session serves all tests: a hand takes a ball and lifts it twice."""
        cls.rec = os.path.join(os.environ["TANDEM_STATE"], "therapy_rec")
        shutil.rmtree(cls.rec, ignore_errors=True)
        with Server("--scene", "ring", "--record", cls.rec) as server:
            client = start_client(server.port, "--name", "anna", "--hand", "grab-and-lift", "--duration", "8s")
            code, _, err = finish(client)
            if code != 0:
                raise AssertionError(err)
        cls.recording, = glob.glob(os.path.join(cls.rec, "*.mcap"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.rec, ignore_errors=True)

    def therapy(self, *arguments):
        return run("tandem-lab", "therapy", *arguments, "--data", self.path("data"))

    def done(self, *arguments):
        code, out, err = self.therapy(*arguments)
        self.assertEqual(code, 0, err)
        return out

    def new(self):
        return self.done("new").strip()

    def found(self, text):
        """Returns the paths below the data folder that have the text in their name or content."""
        paths = []
        for folder, folders, files in os.walk(self.path("data")):
            paths += [os.path.join(folder, name) for name in folders + files if text in name]
            for name in files:
                with open(os.path.join(folder, name), "rb") as file:
                    if text.encode() in file.read():
                        paths.append(os.path.join(folder, name))
        return paths

    def test_a_session_is_measured_and_reported(self):
        person = self.new()
        self.assertRegex(person, r"^P-[0-9A-Z]{4}-[0-9A-Z]{4}-[0-9A-Z]{4}$")
        added = json.loads(self.done("add", person, self.recording, "--calibration-s", "3", "--json"))
        self.assertEqual(added["session"], 1)
        whole, level = added["measures"]["parts"][:2]
        self.assertEqual((whole["kind"], level["kind"], level["name"]), ("session", "level", "ring"))
        self.assertAlmostEqual(whole["time_s"], 8, delta=0.3)
        self.assertGreaterEqual(whole["movements"], 2)
        self.assertEqual((whole["grasps"], whole["objects"]), (1, 1))
        self.assertGreater(whole["force_peak_n"], whole["force_mean_n"])
        self.assertAlmostEqual(whole["smoothness"], -1.41, delta=0.05)  # the simulated hand moves with minimum jerk
        self.assertNotIn("anna", json.dumps(added))
        self.assertEqual(self.done("list"), f"{person}  1 session\n")

        for folder, folders, files in os.walk(self.path("data")):
            for name in folders + files:
                mode = stat.S_IMODE(os.stat(os.path.join(folder, name)).st_mode)
                self.assertEqual(mode, 0o700 if name in folders else 0o600, name)

        self.done("report", person, "--out", self.path("out"))
        with open(self.path("out/report.html"), encoding="utf-8") as file:
            page = file.read()
        self.assertEqual(list(figures.report_problems(page)), [])
        self.assertIn(NOTICE, page.split(FIRST_PAGE_END)[0])
        self.assertNotIn("anna", page)
        with open(self.path("out/measures.csv"), encoding="utf-8") as file:
            table = file.read()
        self.assertIn(NOTICE, table)
        self.assertIn("reach_plus_z,m,", table)
        self.assertEqual(stat.S_IMODE(os.stat(self.path("out/report.html")).st_mode), 0o600)

    def test_help_says_that_it_is_no_medical_device(self):
        for command in ((), ("new",), ("list",), ("add",), ("report",), ("delete",)):
            code, out, err = run("tandem-lab", "therapy", *command, "--help")
            self.assertEqual(code, 0, err)
            self.assertIn(NOTICE, out)

    def test_no_byte_of_the_pseudonym_is_left_after_deletion(self):
        gone, other = self.new(), self.new()
        for person in (gone, other):
            self.done("add", person, self.recording)
        self.assertTrue(self.found(gone))
        self.done("delete", gone)
        self.assertEqual(self.found(gone), [])
        self.assertEqual(self.done("list"), f"{other}  1 session\n")

        self.write("data/notes.txt", f"{other} was here")
        code, _, err = self.therapy("delete", other)
        self.assertEqual(code, 1, err)
        self.assertIn("still in " + self.path("data/notes.txt"), err)
        self.assertEqual(self.found(other), [self.path("data/notes.txt")])

    def killed(self, after_s, *arguments):
        process = subprocess.Popen([program("tandem-lab"), "therapy", *arguments, "--data", self.path("data")],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(after_s)
        process.kill()
        return process.wait(PATIENCE_S)

    def test_a_run_that_is_killed_leaves_all_or_nothing(self):
        seed = int(os.environ.get("TANDEM_TEST_SEED", "1"))
        print(f"TANDEM_TEST_SEED={seed}")
        chance = random.Random(seed)
        kept = self.new()
        begin = time.monotonic()
        self.done("add", kept, self.recording)
        duration_s = time.monotonic() - begin
        for _ in range(12):
            person = self.new()
            self.killed(chance.uniform(0.7, 1.1) * duration_s, "add", person, self.recording)
            sessions = {one["pseudonym"]: len(one["sessions"]) for one in json.loads(self.done("list", "--json"))}
            self.assertEqual(sessions[kept], 1)
            self.assertIn(sessions[person], (0, 1))
            if sessions[person] == 0:
                self.done("add", person, self.recording)
            self.killed(chance.uniform(0, 0.03), "delete", person)
            if person in self.done("list"):
                self.assertIn(f"{person}  1 session", self.done("list"))
                self.done("delete", person)
            self.assertEqual(self.found(person), [])
        self.new()  # completes the deletions
        self.assertEqual([name for name in os.listdir(self.path("data")) if name.startswith(".removed")], [])
        self.assertIn(f"{kept}  1 session", self.done("list"))

    def test_mistakes_name_file_field_and_remedy(self):
        person = self.new()
        self.done("add", person, self.recording)
        wrong = self.write("wrong.mcap", "no recording")
        data = self.path("data")
        for arguments, words in [
                (["add", person, self.recording], ["session 1", "name the recording of another session"]),
                (["add", person, wrong], ["wrong.mcap", "no message can be read"]),
                (["add", person, self.path("none.mcap")], ["none.mcap cannot be opened", "name a recording"]),
                (["add", person, self.recording, "--user", "ben"], ["--user ben", "has the user anna", "name one"]),
                (["add", person, self.recording, "--calibration-s", "0"], ["--calibration-s", "0 not in range 1"]),
                (["add", "P-0000", self.recording], ["no person P-0000", "therapy list"]),
                (["new", "Anna Smith"], ["'Anna Smith'", "A-Z, 0-9", "random"]),
                (["report", person, "--session", "9", "--out", self.path("o")], ["--session 9", "1 to 1"]),
                (["report", person, "--out", os.path.join(data, "r")], ["--out", "within the data folder", "outside"]),
                (["delete", "../x"], ["'../x'", "6 to 32"])]:
            with self.subTest(arguments=arguments):
                self.assert_setup_error(self.therapy(*arguments), "tandem-lab: ", *words)
        session, = glob.glob(os.path.join(data, person, "*.json"))
        with open(session, "w", encoding="utf-8") as file:
            file.write('{"format": 1, "recording": "1", "begun_utc": "x", "parts": [{"path_m": []}]}')
        self.assert_setup_error(self.therapy("report", person, "--out", self.path("o")), "session-0001.json", "parts[0].path_m is []",
                                "must be a number")


if __name__ == "__main__":
    unittest.main()
