"""Tests recordings of sessions at both ends. The programs are killed; an independent reader reads the recordings, which
are also replayed and used as a device."""

import glob
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import time
import unittest

import mcap_reader
from support import PATIENCE_S, SOURCE, ProgramTest, Server, finish, free_port, program, read_trace, replay_killed, run, start_client

import needs  # from tests/support; support.py adds this folder to the path

STEP_NUMBER = 1  # field number in RecordedStep
KILLS = int(os.environ.get("TANDEM_KILLS", "6"))


def two_clients(port, folder, seconds):
    return [start_client(port, "--name", name, "--hand", hand, "--duration", f"{seconds}s", "--json",
                         "--record", os.path.join(folder, name + ".mcap"))
            for name, hand in (("anna", "peg-left"), ("ben", "peg-right"))]


MCAP_CORE = os.path.join(SOURCE, "build", "mcap_core")


def other_reader(path):
    """Reads this file as a Recording and compares its channels with those that @mcap/core reads. If @mcap/core is not
    installed, the comparison is omitted and counted as left out."""
    recording = mcap_reader.Recording(path)
    if not needs.has_of_machine(os.path.isdir(os.path.join(MCAP_CORE, "node_modules")),
                                "@mcap/core, the reference reader of recordings (npm and network in deploy/install-deps)"):
        return recording
    script = shutil.copy(os.path.join(SOURCE, "tests", "system", "mcap_core", "read.mjs"), MCAP_CORE)
    done = subprocess.run(["node", script, path], capture_output=True, text=True, check=True)
    read = json.loads(done.stdout)
    topics = {topic for topic, _, _ in recording.messages}
    ours = {topic: {"messages": len(recording.of(topic)), "last_ns": str(max(at for at, _ in recording.of(topic)))} for topic in topics}
    if read != {"is_whole": recording.is_whole, "topics": ours}:
        raise AssertionError(f"@mcap/core reads {read}, mcap_reader {ours}, whole: {recording.is_whole}")
    return recording


class Session(ProgramTest):
    def record(self):
        folder = self.path("server")
        with Server("--scene", "peg_in_hole", "--record", folder) as server:
            first = start_client(server.port, "--name", "anna", "--hand", "peg-left", "--duration", "5s", "--json",
                                 "--record", self.path("anna.mcap"), "--trace", self.path("anna.csv"))
            server.wait_for_log("anna.*joined")
            second = start_client(server.port, "--name", "ben", "--hand", "peg-right", "--duration", "4s", "--json")
            for client in (first, second):
                code, _, err = finish(client)
                self.assertEqual(code, 0, err)
        return glob.glob(os.path.join(folder, "*.mcap"))

    def test_plays_back_to_the_same_states_and_another_reader_agrees(self):
        files = self.record()
        self.assertEqual(len(files), 1)
        self.check_room(files[0])
        self.check_export(files[0])
        self.check_client(self.path("anna.mcap"))
        self.check_hand_in_another_scene(self.path("anna.mcap"))

    def check_room(self, file):
        code, out, err = run("tandem-replay", "play", file, "--json")
        self.assertEqual(code, 0, out + err)
        played = json.loads(out)
        self.assertTrue(played["is_equal"], played)
        self.assertGreater(played["steps"], 4000)
        self.assertGreater(played["inputs"], 5000)
        facts = json.loads(run("tandem-replay", "info", file, "--json")[1])
        self.assertEqual([user["name"] for user in facts["users"]], ["anna", "ben"])
        self.assertTrue(all(user["left_s"] > user["joined_s"] for user in facts["users"]))
        self.assertEqual(facts["steps"]["missing"], 0)
        recording = other_reader(file)
        self.assertTrue(recording.is_whole)
        steps = [mcap_reader.fields(data)[STEP_NUMBER][0] for _, data in recording.of("/step")]
        self.assertEqual(steps, list(range(1, played["steps"] + 1)))
        self.assertEqual({name: len(recording.of(name)) for name in facts["messages"]}, facts["messages"])

    def check_export(self, file):
        code, out, err = run("tandem-replay", "export", file, "--out", self.path("tables"))
        self.assertEqual(code, 0, out + err)
        bodies = read_trace(self.path("tables/bodies.csv"))
        self.assertGreater(len(bodies), 200)
        self.assertGreater(max(abs(row["peg_p_x_m"] - bodies[0]["peg_p_x_m"]) for row in bodies), 1e-4, "the peg moved")
        self.assertGreater(len(read_trace(self.path("tables/inputs.csv"))), 5000)
        with open(self.path("tables/recording.h5"), "rb") as h5:
            self.assertEqual(h5.read(8), b"\x89HDF\r\n\x1a\n")

    def check_client(self, file):
        recording = other_reader(file)
        self.assertTrue(recording.is_whole)
        self.assertEqual(len(recording.of("/session")), 1)
        self.assertGreaterEqual(len(recording.of("/link")), 4)
        trace = read_trace(self.path("anna.csv"))
        self.assertEqual(len(recording.of("/tick")), len(trace))
        self.assertEqual(run("tandem-replay", "export", file, "--out", self.path("ticks"))[0], 0)
        exported = read_trace(self.path("ticks/ticks.csv"))
        self.assertEqual(len(exported), len(trace))
        for column in ("device_p_x_m", "displayed_force_z_n", "tick", "safety_faults", "state_age_s"):
            self.assertEqual([row[column] for row in exported if row[column] == row[column]],
                             [row[column] for row in trace if row[column] == row[column]], column)

    def check_hand_in_another_scene(self, file):
        with Server("--scene", "two_boxes") as server:
            code, _, err = run("tandem-client", "--insecure", "--headless", "--server", f"127.0.0.1:{server.port}",
                               "--device", f"replay:{file}", "--duration", "3s", "--trace", self.path("again.csv"))
            self.assertEqual(code, 0, err)
        then, now = read_trace(self.path("anna.csv")), read_trace(self.path("again.csv"))
        self.assertGreater(len(now), 2000)
        # The hand is interpolated between two of its samples. The error within 1 ms is about 1 µm.
        for row in now[::50]:
            due = then[0]["t_s"] + row["t_s"]
            near = min(then, key=lambda other: abs(other["t_s"] - due))
            for axis in "xyz":
                self.assertAlmostEqual(row[f"device_p_{axis}_m"], near[f"device_p_{axis}_m"], delta=2e-4)

    def test_a_file_that_is_none_is_refused_in_one_line(self):
        empty = self.write("empty.mcap", "")
        other = self.write("other.mcap", "not a recording at all")
        for command in ("info", "play"):
            self.assert_setup_error(run("tandem-replay", command, empty), "empty.mcap")
            self.assert_setup_error(run("tandem-replay", command, other), "other.mcap", "no MCAP file")
        self.assert_setup_error(run("tandem-replay", "info", self.path("absent.mcap")), "absent.mcap")
        self.assert_setup_error(run("tandem-client", "--insecure", "--headless", "--device", "replay:" + other), "other.mcap")
        self.assert_setup_error(run("tandem-client", "--insecure", "--headless", "--device", "replay"), "replay:FILE")


class Killed(ProgramTest):
    """The server is killed by kill -9. An independent reader must read all flushed data, and the recording must be
    replayable."""

    def test_at_random_moments(self):
        seed = int(os.environ.get("TANDEM_TEST_SEED", "1"))
        print(f"TANDEM_TEST_SEED={seed}")
        moments = random.Random(seed)
        for number in range(KILLS):
            folder = self.path(f"r{number}")
            server = Server("--scene", "peg_in_hole", "--record", folder)
            client = start_client(server.port, "--name", "anna", "--hand", "peg-left", "--duration", "60s",
                                  "--record", self.path(f"c{number}.mcap"))
            server.wait_for_log("anna.*joined")
            time.sleep(moments.uniform(0.3, 2.0))
            killed = time.time()
            server.kill()
            client.kill()
            client.communicate()
            file, = glob.glob(os.path.join(folder, "*.mcap"))
            recording = other_reader(file)
            self.assertFalse(recording.is_whole)
            steps = recording.of("/step")
            self.assertTrue(steps)
            self.assertLess(killed - steps[-1][0] * 1e-9, 1.0, "at most one second is lost")
            is_played, out, err = replay_killed("play", file, "--json")
            self.assertTrue(is_played, out + err)
            self.assertEqual(json.loads(out)["steps"], len(steps))
            self.assertTrue(other_reader(self.path(f"c{number}.mcap")).of("/tick"))


def damaged(kind, data, random_):
    """Truncates, zeroes or changes the second half of a file. Returns (bytes, index of the first changed byte)."""
    at = random_.randrange(len(data) // 2, len(data) * 9 // 10)
    if kind == "cut":
        return data[:at], at
    if kind == "zeroed":
        at = at // 512 * 512
        return data[:at] + bytes(512) + data[at + 512:], at
    return data[:at] + bytes([data[at] ^ 1 << random_.randrange(8)]) + data[at + 1:], at


class Damaged(ProgramTest):
    """No message of a damaged file may be lost silently. The error must name the damage, its position, the readable
    part, and the remedy."""

    def record(self):
        folder = self.path("server")
        with Server("--scene", "peg_in_hole", "--record", folder) as server:
            code, _, err = finish(start_client(server.port, "--name", "anna", "--hand", "peg-left", "--duration", "3s",
                                               "--record", self.path("anna.mcap")))
            self.assertEqual(code, 0, err)
        file, = glob.glob(os.path.join(folder, "*.mcap"))
        return {"room": file, "client": self.path("anna.mcap")}

    def damage(self, file, kind, random_):
        with open(file, "rb") as whole:
            data, _ = damaged(kind, whole.read(), random_)
        other = self.path(f"{kind}.mcap")
        with open(other, "wb") as file:
            file.write(data)
        return other

    def assert_said(self, err, file, before="tandem-replay: "):
        (line,) = [line for line in err.splitlines() if file in line]
        self.assertIn(before, line)
        self.assertRegex(line, r"at byte \d+ of \d+; read until there: \d+ messages, the last \d+\.\d{3} s after the first")
        self.assertIn("copy the file again", line)

    def test_no_message_is_missing_in_silence(self):
        seed = int(os.environ.get("TANDEM_TEST_SEED", "1"))
        print(f"TANDEM_TEST_SEED={seed}")
        random_ = random.Random(seed)
        files = self.record()
        whole = {kind: json.loads(run("tandem-replay", "info", file, "--json")[1]) for kind, file in files.items()}
        for of, file in files.items():
            for kind in ("cut", "zeroed", "bit"):
                other = self.damage(file, kind, random_)
                with self.subTest(of=of, kind=kind):
                    code, out, err = run("tandem-replay", "info", other, "--json")
                    facts = json.loads(out)
                    if facts["messages"] == whole[of]["messages"]:
                        self.assertEqual(code, 0 if facts["is_whole"] else 3, err)
                        continue
                    self.assertEqual(code, 3, err)
                    self.assertTrue(facts["is_damaged"])
                    self.assertFalse(facts["is_whole"])
                    self.assert_said(err, other)
                    code, _, err = run("tandem-replay", "export", other, "--out", self.path(f"{of}-{kind}"))
                    self.assertEqual(code, 3, err)
                    self.assert_said(err, other)
        room = self.damage(files["room"], "cut", random_)
        code, out, err = run("tandem-replay", "play", room, "--json")
        self.assertEqual(code, 3, err)
        self.assertTrue(json.loads(out)["is_equal"])
        self.assert_said(err, room)

    def test_a_hand_whose_recording_is_damaged_is_warned_of(self):
        file = self.damage(self.record()["client"], "cut", random.Random(2))
        with Server("--scene", "two_boxes") as server:
            code, out, err = run("tandem-client", "--insecure", "--headless", "--server", f"127.0.0.1:{server.port}", "--json",
                                 "--device", f"replay:{file}", "--duration", "5s")
        self.assertEqual(code, 0, err)
        self.assert_said(err, file, "tandem-client: warning: ")
        self.assertIn("the recording is damaged or cut here", out + err)


class FullDisk(ProgramTest):
    def test_is_told_once_and_the_session_goes_on(self):
        def small_disk():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

        port = free_port()
        server = subprocess.Popen([program("tandem-server"), "--insecure", "--port", str(port), "--scene", "free",
                                   "--cache", "", "--json", "--record", self.path("small")],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=small_disk)
        while "listening" not in server.stderr.readline():
            pass
        code, out, err = finish(start_client(port, "--hand", "circle", "--duration", "4s", "--json"))
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads(out)["reconnects"], 0)
        server.terminate()
        out, log = server.communicate(timeout=PATIENCE_S)
        self.assertEqual(len([line for line in log.splitlines() if "cannot be written" in line]), 1, log)
        self.assertEqual(server.returncode, 1, "what was to be recorded is not complete")
        self.assertIn("--record: the recording is incomplete", log)
        report = json.loads(out)["rooms"][0]["recording"]
        self.assertGreater(report["messages_lost"], 1000)
        recording = other_reader(report["file"])
        self.assertGreater(len(recording.of("/step")), 100, "what got to the disk is whole")


if __name__ == "__main__":
    unittest.main()
