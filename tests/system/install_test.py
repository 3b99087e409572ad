"""Tests programs that are installed under a prefix which is then moved. They must find their files, and the server must
read its configuration file."""

import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import support
from support import ProgramTest, Server, finish, run, start_client

BUILD = os.environ["TANDEM_BUILD"]
# Options that a configuration file cannot contain: --help and --version of every program, and --config, which names the
# file.
NOT_IN_A_FILE = {"help", "version", "config"}


def options_of_help():
    """Returns the first name of each option. Further names are aliases."""
    _, out, _ = run("tandem-server", "--help")
    return set(re.findall(r"^  (?:-\w,)?--([a-z][a-z-]*)", out, re.M)) - NOT_IN_A_FILE


class Installed(ProgramTest):
    """All tests of this class run the installed programs: support.BIN refers to them."""

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        installed, cls.prefix = os.path.join(cls.place.name, "first"), os.path.join(cls.place.name, "moved")
        subprocess.run(["cmake", "--install", BUILD, "--prefix", installed], check=True, capture_output=True)
        with open(os.path.join(installed, "lib/systemd/system/tandem-server.service"), encoding="utf-8") as file:
            cls.unit = file.read().replace(installed, "PREFIX")
        shutil.move(installed, cls.prefix)
        cls.config = os.path.join(cls.prefix, "etc/tandem/tandem-server.conf")
        cls.built, support.BIN = support.BIN, os.path.join(cls.prefix, "bin")

    @classmethod
    def tearDownClass(cls):
        support.BIN = cls.built
        cls.place.cleanup()

    def test_the_server_serves_what_the_example_file_says(self):
        with Server("--config", self.config) as server:
            code, out, err = finish(start_client(server.port, "--json", "--hand", "peg-left", "--duration", "3s"))
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["room"], "peg_in_hole")
        self.assertGreater(summary["datagrams"]["received"], 100)

    def test_the_lab_finds_experiments_hand_paths_and_device_profiles(self):
        code, _, err = run("tandem-lab", "run", "free", "--single", "--set", "duration_s=0.2", "--out", self.path("out"))
        self.assertEqual(code, 0, err)
        code, out, err = run("tandem-lab", "check", "--law", "spring-damper", "--device", "omega.6", "--json")
        self.assertIn(code, (0, 1), err)
        self.assertTrue(json.loads(out)["findings"])

    def test_the_server_finds_the_program_that_reads_meshes(self):
        self.write("t.obj", "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        body = {"name": "m", "shapes": [{"mesh": {"file": "t.obj", "largest_size_m": 0.02}}]}
        scene = self.write("s.json", json.dumps({"name": "s", "bodies": [body], "tools": [{"name": "a"}]}))
        code, _, err = run("tandem-server", "--port", "0", "--cache", "", "--scene", scene, "--duration", "100ms")
        self.assertEqual(code, 0, err)

    def test_no_program_names_the_source_tree(self):
        for name in ("tandem-server", "tandem-token", "tandem-client", "tandem-doctor", "tandem-lab", "tandem-replay",
                     "tandem-mesh-reader", "tandem-watchdog", "tandem-eeg", "tandem-signal"):
            with open(support.program(name), "rb") as file:
                self.assertNotIn(support.SOURCE.encode(), file.read(), name)

    def test_the_unit_starts_the_installed_server_with_its_file(self):
        self.assertIn("ExecStart=PREFIX/bin/tandem-server --config PREFIX/etc/tandem/tandem-server.conf\n", self.unit)
        for line in ("DynamicUser=yes", "NoNewPrivileges=yes", "LimitRTPRIO=90", "LimitMEMLOCK=infinity"):
            self.assertIn(line + "\n", self.unit)

    def test_a_rule_lets_users_open_their_devices(self):
        with open(os.path.join(self.prefix, "lib/udev/rules.d/70-tandem.rules"), encoding="utf-8") as file:
            rules = file.read()
        for ids in ('"0403", ATTR{idProduct}=="cb48"', '"256f"', '"046d"'):
            self.assertIn(ids, rules)

    def test_a_configuration_that_is_there_stays(self):
        with open(self.config, "a", encoding="utf-8") as file:
            file.write("# mine\n")
        subprocess.run(["cmake", "--install", BUILD, "--prefix", self.prefix], check=True, capture_output=True)
        with open(self.config, encoding="utf-8") as file:
            self.assertTrue(file.read().endswith("# mine\n"))


class Configuration(ProgramTest):
    def example(self):
        with open(os.path.join(support.SOURCE, "deploy/tandem-server.conf"), encoding="utf-8") as file:
            return file.read()

    def test_the_example_names_every_option_once(self):
        named = re.findall(r"^(?:# )?([a-z][a-z-]*) = ", self.example(), re.M)
        self.assertEqual(sorted(named), sorted(options_of_help()))

    def test_every_line_of_the_example_is_accepted(self):
        text = re.sub(r"^# ([a-z][a-z-]* = )", r"\1", self.example(), flags=re.M)
        text = text.replace('duration = "3600s"', 'duration = "200ms"').replace("json = false", "json = true")
        text = text.replace("/var/cache/tandem", self.path("cache")).replace("/var/lib/tandem", self.path("state"))
        # Removes options that name files which do not exist, depend on such an option, or end the program.
        text = re.sub(r"^(cert|key|issuer|dev-certs|receptor|ligand|hydrogens|dielectric|cutoff|far-grid|force-field|on-call) = .*$", "", text, flags=re.M)
        config = self.write("all.conf", text)
        # The command line takes precedence over the file.
        code, out, err = run("tandem-server", "--config", config, "--port", "0")
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads(out)["rooms"][0]["name"], "peg_in_hole")

    def test_a_mistake_names_the_file(self):
        for text, words in [("gravitas = 3\n", ["gravitas", "no option"]), ("port = 70000\n", ["--port", "0 to 65535"]),
                            ('scene = ["a"]\nduration = "3"\n', ["--duration", "3s"])]:
            with self.subTest(text=text):
                config = self.write("bad.conf", text)
                self.assert_setup_error(run("tandem-server", "--config", config), "tandem-server: ", config, *words)
        self.assert_setup_error(run("tandem-server", "--config", "/nowhere/s.conf"), "tandem-server: ", "/nowhere/s.conf")


if __name__ == "__main__":
    unittest.main()
