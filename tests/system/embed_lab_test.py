"""Tests tandem.lab, which reads results of tandem-lab and recordings as numpy arrays. The values must equal those in the
JSON and CSV files that the programs write beside the HDF5 file."""

import csv
import glob
import importlib.util
import json
import math
import os
import shutil
import sys
import tempfile
import unittest

import support
from support import SOURCE, ProgramTest, Server, finish, run

DEBIAN = "/usr/lib/python3/dist-packages"
PACKAGE = os.path.join(os.environ["TANDEM_BUILD"], "python")


def csv_rows(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Lab(ProgramTest):
    files = (DEBIAN + "/h5py/__init__.py",)

    @classmethod
    def setUpClass(cls):
        sys.path.insert(0, PACKAGE)
        sys.path.append(DEBIAN)  # a Python other than Debian's own finds numpy and h5py in this folder
        import tandem.lab
        cls.lab = tandem.lab
        os.environ["PATH"] = support.BIN + os.pathsep + os.environ["PATH"]

    def assert_same(self, value, expected):
        if expected is None:
            self.assertTrue(math.isnan(value))
        elif isinstance(expected, (bool, int, float)):
            self.assertEqual(value, float(expected))
        elif isinstance(expected, str):
            self.assertEqual(value, expected)

    def test_a_study_has_the_values_of_its_json_and_csv_files(self):
        out = self.path("out")
        code, _, err = run("tandem-lab", "run", "wall", "--stage", "local-model,late-pose", "--set",
                           "link.rtt_ms=0,50", "--set", "duration_s=3", "--truth-alone", "--samples", "--out", out)
        self.assertEqual(code, 0, err)
        with open(os.path.join(out, "results.json"), encoding="utf-8") as file:
            trials = json.load(file)["trials"]
        study = self.lab.read_study(out)
        self.assertGreater(len(study), 1)
        self.assertEqual(len(study), len(trials))
        for trial, expected in zip(study, trials):
            self.assertEqual(trial.overrides, expected["overrides"])
            self.assertEqual(set(trial.users), {user["name"] for user in expected["users"]})
            for user in expected["users"]:
                for name, value in user.items():
                    self.assert_same(trial.users[user["name"]][name], value)
            for name, value in expected.items():
                if name not in ("users", "overrides"):
                    self.assert_same(trial[name], value)
        self.assertEqual(study["rtt_ms"].tolist(), [trial["rtt_ms"] for trial in trials])
        self.assertEqual(study["stage"].tolist(), [trial["stage"] for trial in trials])
        with self.assertRaisesRegex(KeyError, "rtt_ms"):
            study["no_such_column"]
        samples = study[0].samples
        everything = glob.glob(os.path.join(out, "samples", "*"))
        folders = [folder for folder in everything
                   if all(self.is_table_of(samples[name], os.path.join(folder, name + ".csv")) for name in samples)]
        self.assertGreater(len(folders), 0)  # at least one: seeds without tremor give the same series
        self.assertLess(len(folders), len(everything), "the series are those of one trial")
        self.assertGreater(len(samples), 1)
        self.assertGreater(max(len(samples[name]["t_s"]) for name in samples), 100)

    def is_table_of(self, table, path):
        """Returns whether the file has the same columns and values, cell by cell."""
        rows = csv_rows(path)
        return set(table) == set(rows[0]) and all(
            len(column) == len(rows) and all(value == float(row[name]) if row[name] else math.isnan(value)
                                             for value, row in zip(column.tolist(), rows))
            for name, column in table.items())

    def check_table(self, table, path):
        self.assertGreater(len(csv_rows(path)), 10)
        self.assertTrue(self.is_table_of(table, path), path)

    def test_a_recording_has_the_values_of_the_exported_tables(self):
        with Server("--scene", "crate", "--record", self.path("rec")) as server:
            done = finish(support.start_client(server.port, "--duration", "2s", "--record", self.path("anna.mcap")))
            self.assertEqual(done[0], 0, done[2])
        (room,) = glob.glob(self.path("rec/*.mcap"))
        for file, tables in ((room, {"steps", "inputs", "bodies", "tools"}), (self.path("anna.mcap"), {"ticks", "link"})):
            recording = self.lab.read_recording(file)
            self.assertLessEqual(tables, set(recording))
            self.assertFalse(recording.is_damaged)
            self.assertEqual(recording.facts, json.loads(run("tandem-replay", "info", file, "--json")[1]))
            exported = self.path("exported-" + os.path.basename(file))
            self.assertEqual(run("tandem-replay", "export", file, "--out", exported)[0], 0)
            for name in tables - {"link"}:
                self.check_table(recording[name], os.path.join(exported, name + ".csv"))
            again = self.lab.read_recording(exported)
            self.assertEqual(set(again), set(recording))
        temporary = recording._file
        self.assertTrue(temporary.exists())
        del recording
        self.assertFalse(temporary.exists())
        # The copy lacks the end of the file, like the recording of a killed program.
        with open(room, "rb") as whole, open(self.path("cut.mcap"), "wb") as cut:
            data = whole.read()
            cut.write(data[:len(data) // 2])
        damaged = self.lab.read_recording(self.path("cut.mcap"))
        self.assertTrue(damaged.is_damaged)
        self.assertGreater(len(damaged["steps"]["step"]), 10)

    def test_errors_name_the_file_and_the_remedy(self):
        with self.assertRaisesRegex(FileNotFoundError, "nowhere.*--out"):
            self.lab.read_study(self.path("nowhere"))
        with self.assertRaisesRegex(FileNotFoundError, "recording.h5.*mcap"):
            self.lab.read_recording(self.folder)
        with self.assertRaisesRegex(ValueError, "mcap"):
            self.lab.read_recording(self.write("bad.mcap", "no recording"))

    def test_trials_are_in_the_order_of_their_numbers(self):
        import h5py
        numbers = [0, 9, 9999, 10000, 10001]
        with h5py.File(self.path("results.h5"), "w") as file:
            for number in numbers:
                file.create_group(f"trials/{number:04}").attrs["number"] = number
        self.assertEqual(self.lab.read_study(self.path("results.h5"))["number"].tolist(), numbers)

    def test_a_module_in_a_shallow_folder_finds_the_program_in_path(self):
        with tempfile.TemporaryDirectory(dir="/tmp") as folder:  # /tmp/FOLDER/lab.py has three folders
            place = shutil.copy(os.path.join(SOURCE, "client/embed/python/tandem/lab.py"), folder)
            spec = importlib.util.spec_from_file_location("lab_shallow", place)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            self.assertEqual(module._replay_program(), shutil.which("tandem-replay"))

    def test_the_module_names_the_missing_package(self):
        spec = importlib.util.spec_from_file_location("lab_alone", os.path.join(SOURCE, "client/embed/python/tandem/lab.py"))
        module = importlib.util.module_from_spec(spec)
        hidden = sys.modules.pop("h5py")
        sys.modules["h5py"] = None  # the import fails
        try:
            with self.assertRaisesRegex(ImportError, "apt install python3-h5py"):
                spec.loader.exec_module(module)
        finally:
            sys.modules["h5py"] = hidden


if __name__ == "__main__":
    unittest.main()
