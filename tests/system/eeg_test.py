"""Tests tandem-eeg: it trains a model with generated sessions, validates it, and writes a signal. Invalid arguments are
refused, and the help has the required notice."""

import csv
import io
import json
import os
import unittest

from support import ProgramTest, Server, finish, run, start_client


class Eeg(ProgramTest):
    def generate(self, name, session, *arguments):
        code, _, err = run("tandem-eeg", "generate", "--out", self.path(name), "--session", str(session), "--channels",
                           "F3,F4,O1,O2", *arguments)
        self.assertEqual(code, 0, err)
        return self.path(name)

    def trained(self):
        """Returns a model and a session that it was not trained with."""
        files = [self.generate("1.edf", 1), self.generate("2.bdf", 2)]
        code, _, err = run("tandem-eeg", "train", *files, "--model", self.path("person.json"))
        self.assertEqual(code, 0, err)
        self.assertRegex(err, r"trained with \d+ windows of \d+ blocks")
        return self.path("person.json"), files

    def test_a_trained_model_is_validated_with_another_session(self):
        model, files = self.trained()
        self.assertEqual(os.stat(model).st_mode & 0o077, 0, "only its owner can read it")
        code, out, err = run("tandem-eeg", "validate", "--json", "--model", model, self.generate("3.edf", 3))
        self.assertEqual(code, 0, err)
        result = json.loads(out)
        self.assertTrue(result["is_above_chance"])
        self.assertGreater(result["accuracy"], result["chance_high"])
        self.assertIn("windows, ", err, "artefacts are counted")
        self.refused(["validate", "--model", model, files[0]], "1.edf", "was trained with this recording", "another session")

    def test_eeg_without_effect_is_not_above_chance(self):
        files = [self.generate(f"{i}.edf", i, "--bayes-accuracy", "0.5") for i in (1, 2)]
        code, out, err = run("tandem-eeg", "validate", *files)
        self.assertEqual(code, 1, err)
        self.assertIn("not above chance", out)

    def refused(self, arguments, *words):
        """Checks that the arguments are refused with these words. The last line on standard error is the error; counts of
        artefacts may precede it."""
        code, _, err = run("tandem-eeg", *arguments)
        self.assertEqual(code, 2, err)
        for word in words:
            self.assertIn(word, err.splitlines()[-1])

    def test_a_split_that_shares_blocks_is_refused(self):
        files = [self.generate(f"{i}.edf", i) for i in (1, 2)]
        self.refused(["validate", *files, "--split", "windows"], "in the training and in the test", "split by sessions or by blocks")
        self.refused(["validate", files[0]], "by sessions needs at least 2")
        code, _, err = run("tandem-eeg", "validate", files[0], "--split", "blocks")
        self.assertEqual(code, 0, err)

    def test_a_signal_is_sent_to_the_game_of_a_room(self):
        model, _ = self.trained()
        condition = {"signal": {"name": "valence", "above": 0, "required": True}}
        scene = {"name": "play", "bodies": [{"name": "ball", "shapes": [{"sphere": {"radius_m": 0.01}}]}], "tools": [{"name": "a"}],
                 "game": {"signals": [{"name": "valence", "max_age_s": 60}],
                          "levels": [{"name": "a", "goals": [{"name": "g", "hold_s": 600, "conditions": [condition]}]}]}}
        with Server("--scene", self.write("play.json", json.dumps(scene))) as server:
            client = start_client(server.port, "--json", "--duration", "9s", "--hand", "rest")
            server.wait_for_log("user 1 .* joined")
            code, out, err = run("tandem-eeg", "stream", "--source", "generator", "--model", model, "--duration", "7s", "--server",
                                 f"127.0.0.1:{server.port}", "--insecure")
            self.assertEqual(code, 0, err)
            server.wait_for_log("joined room play as a source of signals")
            code, summary, err = finish(client)
            self.assertEqual(code, 0, err)
        values = [line["value"] for line in map(json.loads, out.splitlines()) if line["value"] is not None]
        signal = json.loads(summary)["game"]["signals"][0]
        self.assertEqual(signal["name"], "valence")
        self.assertTrue(signal["fresh"], signal)
        self.assertIn(round(signal["value"], 6), [round(value, 6) for value in values])
        with Server("--scene", "ring") as server:
            self.refused(["stream", "--source", "generator", "--model", model, "--server", f"127.0.0.1:{server.port}", "--insecure"],
                         "no game with signals")
        self.refused(["stream", "--source", "generator", "--model", model, "--insecure", "--immediate"], "--immediate", "real time")

    def test_a_signal_has_a_line_for_each_report(self):
        model, files = self.trained()
        for source in (["generator"], ["file", "--file", files[0]]):
            code, out, err = run("tandem-eeg", "stream", "--model", model, "--immediate", "--duration", "10s", "--rate", "4",
                                 "--source", *source)
            self.assertEqual(code, 0, err)
            lines = [json.loads(line) for line in out.splitlines()]
            self.assertEqual(len(lines), 40)
            self.assertIsNone(lines[0]["value"], "the first window takes 4 s")
            for line in lines[16:]:
                self.assertEqual(line["signal"], "valence")
                self.assertTrue(-1 <= line["value"] <= 1 and 0.5 <= line["confidence"] <= 1, line)
                self.assertGreaterEqual(line["age_s"], 0)

    def test_features_are_a_table_with_the_artefacts_of_each_window(self):
        file = self.generate("1.edf", 1, "--blinks", "20")
        code, out, err = run("tandem-eeg", "features", file)
        self.assertEqual(code, 0, err)
        header, *rows = [line.split(",") for line in out.splitlines()]
        self.assertEqual(len(header), 3 + 4 * 7)
        self.assertEqual(header[3], "F3.mean")
        self.assertEqual(len(rows), 100, "those with artefacts, too")
        self.assertTrue(any("F3:amplitude" in row[2] for row in rows))
        self.assertIn("F3: amplitude", err)

    def test_names_in_features_are_quoted_and_other_channels_refused(self):
        file, other = self.generate("a, b.edf", 1), self.path("other.edf")
        code, _, err = run("tandem-eeg", "generate", "--out", other, "--channels", "F3,F4,O1,Cz")
        self.assertEqual(code, 0, err)
        code, out, err = run("tandem-eeg", "features", file)
        self.assertEqual(code, 0, err)
        rows = list(csv.reader(io.StringIO(out)))
        self.assertEqual(set(len(row) for row in rows), {3 + 4 * 7})
        self.assertEqual(rows[1][0], file)
        self.refused(["features", file, other], "other.edf: channels differ", "a, b.edf", "--channels")

    def test_a_recording_of_the_training_is_refused_with_other_blocks(self):
        file = self.generate("1.edf", 1)
        self.write("1.edf.csv", "".join(f"{20 * i},20,{['positive', 'negative'][i % 2]}\n" for i in range(20)))
        model = self.path("m.json")
        code, _, err = run("tandem-eeg", "train", file, "--label-files", "--model", model)
        self.assertEqual(code, 0, err)
        self.refused(["validate", "--model", model, file], "1.edf", "was trained with this recording")

    def test_labels_of_a_file_beside_the_recording(self):
        file = self.generate("1.edf", 1)
        self.write("1.edf.csv", "onset_s,duration_s,label\n" + "".join(f"{20 * i},20,{'ab'[i % 2]}\n" for i in range(20)))
        code, _, err = run("tandem-eeg", "train", file, "--label-files", "--labels", "a,b", "--model", self.path("m.json"))
        self.assertEqual(code, 0, err)
        self.write("1.edf.csv", "now,20,a\n")
        self.refused(["train", file, "--label-files", "--model", self.path("m.json")], "1.edf.csv:1", "onset_s,duration_s,label")

    def test_mistakes_are_one_line(self):
        file = self.generate("1.edf", 1)
        model = self.write("model.json", "{}")
        for arguments, words in [([], ["subcommand"]), (["features", self.path("no.edf")], ["no.edf", "is no file"]),
                                 (["features", model], ["model.json", "header"]),
                                 (["features", file, "--channels", "Cz"], ["no channel 'Cz'", "F3 [uV]"]),
                                 (["features", file, "--high", "70"], ["70 Hz"]),
                                 (["features", file, "--window", "10"], ["window of 10 samples"]),
                                 (["generate", "--out", file], ["1.edf: exists already"]),
                                 (["generate", "--out", self.path("x.csv")], [".edf"]),
                                 (["generate", "--out", self.path("x.edf"), "--bayes-accuracy", "2"], ["--bayes-accuracy"]),
                                 (["train", file, "--labels", "x,y", "--model", model], ["'x' or 'y'", "--labels"]),
                                 (["stream", "--source", "file", "--model", model], ["model.json: format"])]:
            with self.subTest(arguments):
                self.assert_setup_error(run("tandem-eeg", *arguments), "tandem-eeg: ", *words)

    def test_a_source_that_is_not_there_names_the_remedy(self):
        model, _ = self.trained()
        credentials = self.write("c.json", json.dumps({"client_id": "a", "client_secret": "b"}))
        self.refused(["stream", "--model", model, "--source", "cortex"], "--credentials")
        self.refused(["stream", "--model", model, "--source", "cortex", "--credentials", credentials, "--cortex", "ws://127.0.0.1:1"],
                     "does not answer", "EMOTIV Launcher")
        self.refused(["stream", "--model", model, "--source", "lsl", "--library", "/nowhere/liblsl.so"], "--library")
        self.refused(["stream", "--model", model, "--source", "file"], "--file")

    def test_help_says_that_it_is_no_medical_device(self):
        code, out, _ = run("tandem-eeg", "--help")
        self.assertEqual(code, 0)
        self.assertIn("Not a medical device", out)
        self.assertIn("Usage: tandem-eeg ", out)
        self.assertIn("Exit code: 0 done", out)
        for command, words in (("features", ["[Hz]", "[samples]", "[uV]"]), ("generate", ["[Hz]", "[per minute]"]),
                               ("train", ["--model"]), ("validate", ["Exit code"]), ("stream", ["age_s", "[per second]"])):
            self.assertIn(command, out)
            code, text, _ = run("tandem-eeg", command, "--help")
            self.assertEqual(code, 0)
            for word in words:
                self.assertIn(word, text)


if __name__ == "__main__":
    unittest.main()
