"""Tests poses of two molecules that users save, restore and search for. They are sent, displayed, recorded and
replayed."""

import csv
import json
import math
import os
import pathlib
import shutil
import struct
import threading
import time
import unittest

from support import ProgramTest, Server, finish, read_trace, run, start_client

import needs  # from tests/support; support.py adds this folder to the path
import wire  # from tests/attack; support.py adds this folder to the path

HELICES = "/usr/share/pymol/test/dat/3al1.pdb"
KEEP, GO_TO, UNDO, REDO, MINIMISE, DELETE, RENAME, CANCEL = range(8)


class Holder:
    """A client that holds the receptor still and sends pose requests."""

    def __init__(self, port, cache):
        (scene,) = pathlib.Path(cache).glob("docking-*.json")
        self.place = json.loads(scene.read_text())["tools"][0]["placement"]["position_m"]
        self.client = wire.RawClient(port)
        self.client.join("ada", wire.MANIPULATOR)
        self.is_done = False
        self.thread = threading.Thread(target=self.hold)
        self.thread.start()
        self.request = 100

    def hold(self):
        while not self.is_done:
            try:
                self.client.send_state(self.place)
            except OSError:
                return  # the server has ended
            time.sleep(0.01)

    def close(self):
        self.is_done = True
        self.thread.join()
        self.client.close()

    def next(self, *kinds):
        while True:
            for number, value in wire.fields(self.client.receive()):
                if number in kinds:
                    return number, dict(wire.fields(value))

    def kept(self, count):
        return [self.pose_of(self.next(wire.KEPT_POSE)[1]) for _ in range(count)]

    @staticmethod
    def pose_of(found):
        """Returns the fields of a KeptPose: number, name, energy [kJ/mol], RMSD [angstrom], contacts."""
        number_at = lambda field: struct.unpack("<d", found.get(field, 0).to_bytes(8, "little"))[0]
        return {"number": found.get(1, 0), "name": found[2].decode(), "energy": number_at(5) + number_at(6), "rmsd": number_at(7),
                "contacts": found.get(8, 0)}

    def send(self, kind, number=0, name=""):
        self.request += 1
        body = wire.whole(1, kind) + wire.whole(2, number) + wire.part(3, name.encode())
        self.client.stream.sendall(wire.control(wire.ASK_POSE, body, self.request))
        return self.request

    def ask(self, kind, number=0, name=""):
        """Sends a request. Returns the saved or renamed pose, the number of a deleted pose, or the text of the result
        or the error."""
        self.send(kind, number, name)
        answered, found = self.next(wire.KEPT_POSE, wire.POSE_TAKEN, wire.POSE_DELETED, wire.ERROR)
        if answered == wire.KEPT_POSE:
            return self.pose_of(found)
        if answered == wire.POSE_DELETED:
            return found[1]
        return found[3 if answered == wire.POSE_TAKEN else 2].decode()

    def until_heard(self):
        """Waits until the server has read all requests and is minimising. Returns the answers by request."""
        self.client.stream.sendall(wire.control(wire.PING, wire.whole(1, 59)))
        return self.answers_until({wire.PONG, wire.POSE_PROGRESS})

    def rest(self):
        """Waits for the goodbye message or the end of the connection. Returns the answers by request."""
        return self.answers_until({wire.GOODBYE})

    def answers_until(self, wanted):
        answers, seen = {}, set()
        while not wanted <= seen:
            try:
                fields = dict(wire.fields(self.client.receive()))
            except OSError:
                return answers
            seen |= set(fields)
            if fields.get(1):
                answers[fields[1]] = fields
        return answers


class KeptPoses(ProgramTest):
    files = (HELICES, needs.OPLS)

    def server(self, *arguments):
        return Server("--receptor", HELICES + ":A", "--ligand", HELICES + ":B", "--cache", self.path("cache"), "--keep", self.path("kept"),
                      *arguments)

    def test_poses_are_kept_gone_to_and_found_again(self):
        # The hand moves the ligand into the attractive field and leaves it there.
        path = self.write("bring.json", json.dumps({"points": [
            {"t_s": 0, "position_m": [0, 0, 0]}, {"t_s": 4}, {"t_s": 5.5, "position_m": [0, -0.075, 0]}]}))
        trace = self.path("trace.csv")
        with self.server("--record", self.path("recording")) as server:
            holder = Holder(server.port, self.path("cache"))
            try:
                (native,) = holder.kept(1)
                brings = start_client(server.port, "--json", "--duration", "12s", "--hand", path, "--trace", trace)
                server.wait_for_log("user 2 .* joined")
                time.sleep(0.3)
                apart, near = self.keep_two(holder)
                self.go_to_and_fro(holder, apart)
                code, out, err = finish(brings)
                self.assertEqual(code, 0, err)
            finally:
                holder.close()
        self.assertEqual((native["number"], native["name"], native["rmsd"]), (0, "as in the files", 0))
        self.assertIn('ada kept "near"', err)
        self.check_forces(json.loads(out), read_trace(trace))
        self.check_files([apart, near])
        self.check_playback(*pathlib.Path(self.path("recording")).glob("*.mcap"))
        with self.server() as again:
            holder = Holder(again.port, self.path("cache"))
            try:
                self.assertEqual([pose["name"] for pose in holder.kept(3)], ["as in the files", "pose 1", "near"])
            finally:
                holder.close()

    def keep_two(self, holder):
        apart = holder.ask(KEEP)
        time.sleep(6)
        near = holder.ask(KEEP, name="near")
        self.assertEqual((apart["number"], apart["name"], apart["contacts"]), (1, "pose 1", 0))
        self.assertEqual((near["number"], near["name"]), (2, "near"))
        self.assertGreater(near["contacts"], 10)
        self.assertLess(near["energy"], apart["energy"] - 20)
        self.assertLess(near["rmsd"], apart["rmsd"] - 5)
        return apart, near

    def energy_now(self, holder):
        """Saves a pose and returns its energy."""
        time.sleep(0.3)
        return holder.ask(KEEP, name="now")["energy"]

    def go_to_and_fro(self, holder, apart):
        self.assertEqual(holder.ask(GO_TO, 1), 'ada: to "pose 1"')
        time.sleep(0.1)
        self.assertEqual(holder.ask(UNDO), "ada: back")
        before = self.energy_now(holder)
        self.assertLess(before, apart["energy"] - 20)
        found = holder.ask(MINIMISE)
        self.assertRegex(found, r"^ada: to the minimum nearby, -\d+\.\d\d kJ/mol$")
        self.assertLess(float(found.split()[-2]), before + 1)
        self.assertEqual(holder.ask(GO_TO, 1), 'ada: to "pose 1"')
        self.assertGreater(self.energy_now(holder), apart["energy"] - 15, "they are apart again")
        self.assertIn("no pose has that number", holder.ask(GO_TO, 99))
        self.assertIn("1 to 64 bytes", holder.ask(KEEP, name="a\nb"))

    def check_forces(self, report, rows):
        self.assertTrue(report["all_forces_finite"])
        forces = [[row[f"displayed_force_{axis}_n"] for axis in "xyz"] for row in rows]
        steps = [math.dist(*pair) for pair in zip(forces, forces[1:])]
        self.assertLess(max(steps), 0.2, "though the molecules are somewhere else from one step to the next")
        self.assertGreater(max(math.hypot(*force) for force in forces), 0.2, "they are felt")

    def check_files(self, kept):
        (folder,) = pathlib.Path(self.path("kept")).iterdir()
        with open(folder / "poses.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["name"] for row in rows][:2], ["pose 1", "near"])
        for row, pose in zip(rows, kept):
            self.assertAlmostEqual(float(row["total_kj_mol"]), pose["energy"], delta=1e-6)
            self.assertEqual(row["user"], "ada")
            for ending, allowed in (("cif", 1e-2), ("pdb", 1)):
                file = folder / f"{row['number']}.{ending}"
                code, out, err = run("tandem-lab", "energy", "--receptor", f"{file}:A", "--ligand", f"{file}:B", "--json")
                self.assertEqual(code, 0, err)
                self.assertAlmostEqual(json.loads(out)["total_kj_mol"], pose["energy"], delta=allowed)

    def check_playback(self, recording):
        code, out, err = run("tandem-replay", "play", str(recording), "--json")
        self.assertEqual(code, 0, out + err)

    def test_poses_are_renamed_and_deleted_for_all_and_after_a_restart(self):
        with self.server() as server:
            holder = Holder(server.port, self.path("cache"))
            try:
                holder.kept(1)
                time.sleep(0.3)
                for number in (1, 2, 3):
                    self.assertEqual(holder.ask(KEEP)["number"], number)
                watcher = wire.RawClient(server.port)
                watcher.join("otto", wire.OBSERVER)
                self.assertEqual(holder.ask(RENAME, 2, "bound")["name"], "bound")
                self.assertEqual(holder.ask(DELETE, 3), 3)
                self.assertEqual(holder.ask(DELETE, 1), 1)
                self.assertIn("no pose has that number", holder.ask(DELETE, 1))
                self.assertIn("1 to 64 bytes", holder.ask(RENAME, 2, ""))
                self.check_seen(watcher)
                watcher.close()
            finally:
                holder.close()
        (folder,) = pathlib.Path(self.path("kept")).iterdir()
        self.assertEqual(sorted(file.name for file in folder.iterdir() if file.suffix in (".cif", ".pdb")), ["2.cif", "2.pdb"])
        with open(folder / "poses.csv") as file:
            self.assertEqual([(row["number"], row["name"]) for row in csv.DictReader(file)], [("2", "bound")])
        with self.server() as again:
            holder = Holder(again.port, self.path("cache"))
            try:
                self.assertEqual([(pose["number"], pose["name"]) for pose in holder.kept(2)], [(0, "as in the files"), (2, "bound")])
                time.sleep(0.3)
                self.assertEqual(holder.ask(KEEP)["number"], 4, "3 was used")
            finally:
                holder.close()

    def check_seen(self, watcher):
        """Checks the messages to another user of the room: all poses, the new name, and the deleted poses."""
        poses, names = [], {}
        while poses[-1:] != [("deleted", 1)]:
            for number, value in wire.fields(watcher.receive()):
                found = dict(wire.fields(value)) if number in (wire.KEPT_POSE, wire.POSE_DELETED) else {}
                if number == wire.KEPT_POSE:
                    names[found.get(1, 0)] = found[2].decode()
                elif number == wire.POSE_DELETED:
                    poses.append(("deleted", found[1]))
        self.assertEqual(names, {0: "as in the files", 1: "pose 1", 2: "bound", 3: "pose 3"})
        self.assertEqual(poses, [("deleted", 3), ("deleted", 1)])

    def test_a_minimisation_tells_how_far_it_is_and_is_cancelled(self):
        with self.server() as server:
            holder = Holder(server.port, self.path("cache"))
            try:
                holder.kept(1)
                time.sleep(0.3)
                before = self.energy_now(holder)
                minimises = holder.send(MINIMISE)
                _, progress = holder.next(wire.POSE_PROGRESS)
                self.assertEqual((progress.get(1), progress[3], progress.get(5, 0)), (1, 201, 0), "user, most steps, over")
                cancels = holder.send(CANCEL)
                answers = {}
                while not {minimises, cancels} <= set(answers):
                    fields = dict(wire.fields(holder.client.receive()))
                    answers[fields.get(1, 0)] = fields
                self.assertIn(b"cancelled", dict(wire.fields(answers[minimises][wire.ERROR]))[2])
                self.assertEqual(dict(wire.fields(answers[cancels][wire.POSE_PROGRESS]))[5], 1)
                self.assertIn("no minimisation of yours", holder.ask(CANCEL))
                self.assertAlmostEqual(self.energy_now(holder), before, delta=1, msg="they have not been moved")
            finally:
                holder.close()

    def test_a_server_that_stops_answers_requests_that_wait(self):
        for _ in range(3):
            with self.server() as server:
                holder = Holder(server.port, self.path("cache"))
                try:
                    holder.kept(1)
                    time.sleep(0.3)
                    self.assertEqual(holder.ask(KEEP)["number"], 1)
                    requests = [holder.send(kind) for kind in (MINIMISE, KEEP, KEEP, KEEP)]
                    answers = holder.until_heard()
                    server.process.terminate()
                    answers.update(holder.rest())
                    self.assertEqual([request for request in requests if request not in answers], [], "without an answer")
                    self.assertRegex(dict(wire.fields(answers[requests[0]][wire.ERROR]))[2], b"the server (is stopping|stops)")
                finally:
                    holder.close()
                self.assertEqual(server.process.wait(20), 0)
            for folder in pathlib.Path(self.path("kept")).iterdir():
                listed = [pose["number"] for pose in json.loads((folder / "poses.json").read_text()).get("poses", [])]
                written = {int(file.stem) for file in folder.glob("*.cif")}
                self.assertEqual(written, set(listed))
            shutil.rmtree(self.path("kept"))

    def test_observers_keep_none_and_other_rooms_have_none(self):
        with self.server() as server:
            watcher = wire.RawClient(server.port)
            watcher.join("otto", wire.OBSERVER)
            watcher.receive_kind(wire.KEPT_POSE)
            watcher.stream.sendall(wire.control(wire.ASK_POSE, b"", 7))
            self.assertIn(b"observers keep no poses", dict(wire.fields(watcher.receive_kind(wire.ERROR)))[2])
            watcher.close()
        with Server("--scene", "two_boxes") as server:
            client = wire.RawClient(server.port)
            client.join("ada", wire.MANIPULATOR)
            client.stream.sendall(wire.control(wire.ASK_POSE, b"", 7))
            self.assertIn(b"there are none here", dict(wire.fields(client.receive_kind(wire.ERROR)))[2])
            client.close()

    def test_a_folder_that_takes_nothing_is_said_and_the_pose_is_not_kept(self):
        taken = self.write("taken", "a file where the folder should be")
        with Server("--receptor", HELICES + ":A", "--ligand", HELICES + ":B", "--cache", self.path("cache"), "--keep", taken) as server:
            holder = Holder(server.port, self.path("cache"))
            try:
                holder.kept(1)
                time.sleep(0.3)
                self.assertIn("cannot write into its folder (--keep)", holder.ask(KEEP))
                self.assertIn("no pose has that number", holder.ask(GO_TO, 1))
            finally:
                holder.close()


if __name__ == "__main__":
    unittest.main()
