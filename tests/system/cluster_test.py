"""Tests the files of deploy/kubernetes: the server accepts the arguments, paths and probes of the manifests, and the
scripts work."""

import json
import os
import re
import stat
import subprocess
import unittest
import urllib.error
import urllib.request

import yaml

from support import BIN, PATIENCE_S, SOURCE, ProgramTest, run

FOLDER = os.path.join(SOURCE, "deploy", "kubernetes")


def read(name):
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return file.read()


def script(name, *arguments):
    done = subprocess.run([os.path.join(FOLDER, name), *arguments], capture_output=True, text=True, timeout=PATIENCE_S)
    return done.returncode, done.stdout, done.stderr


class Manifests(ProgramTest):
    def setUp(self):
        super().setUp()
        self.fleet = yaml.safe_load(read("fleet.yaml"))
        self.server = self.fleet["spec"]["template"]["spec"]
        self.pod = self.server["template"]["spec"]
        self.container, = self.pod["containers"]

    def test_the_server_takes_the_arguments_and_answers_the_probes(self):
        port = self.server["ports"][0]
        self.assertEqual((port["containerPort"], port["portPolicy"], port["protocol"]), (47800, "Dynamic", "TCPUDP"))
        arguments = self.container["args"]
        code, key, err = run("tandem-token", "--new-key", self.path("service.pem"))
        self.assertEqual(code, 0, err)
        values = {"/etc/tandem/tandem-server.conf": os.path.join(SOURCE, "deploy", "tandem-server.conf"),
                  "$(TANDEM_ISSUER)": key.split()[-1], "0.0.0.0": "127.0.0.1"}
        state = ["--state", self.path("state"), "--cache", self.path("cache"), "--port", "0"]
        metrics_port = arguments[arguments.index("--metrics") + 1]
        process = subprocess.Popen([os.path.join(BIN, "tandem-server"), *[values.get(one, one) for one in arguments], *state],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            self.assertIn("listening", process.stdout.readline())
            for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
                command = self.container[probe]["exec"]["command"]
                self.assertEqual(command[0], "curl")
                self.assertRegex(command[-1], f"^http://127.0.0.1:{metrics_port}/(healthz|readyz)$")
            # Waits until the server is ready. A status of 400 or more counts as a failure, as with curl --fail.
            for _ in range(600):
                try:
                    answers = {self.container[probe]["exec"]["command"][-1] for probe in ("livenessProbe", "readinessProbe")}
                    for url in answers:
                        self.assertEqual(urllib.request.urlopen(url, timeout=PATIENCE_S).status, 200)
                    break
                except urllib.error.HTTPError as error:
                    self.assertEqual(error.code, 503)
            else:
                self.fail("it does not become ready")
        finally:
            process.terminate()
            process.wait(PATIENCE_S)
            process.stdout.close()

    def test_it_runs_without_rights_and_writes_only_where_it_may(self):
        self.assertTrue(self.pod["securityContext"]["runAsNonRoot"])
        self.assertEqual(self.container["securityContext"]["capabilities"]["drop"], ["ALL"])
        self.assertTrue(self.container["securityContext"]["readOnlyRootFilesystem"])
        mounted = {mount["mountPath"] for mount in self.container["volumeMounts"]}
        image = dict(re.findall(r"(TANDEM_\w+)=(\S+)", read("Containerfile")))
        self.assertEqual(set(image.values()), mounted)
        self.assertEqual(set(image), {"TANDEM_STATE", "TANDEM_CACHE"})
        user = self.pod["securityContext"]["runAsUser"]
        self.assertIn(f"USER {user}:{user}", read("Containerfile"))
        self.assertIn(f"chown -R {user}:{user}", read("root-filesystem"))

    def test_the_autoscaler_names_the_fleet(self):
        scaler = yaml.safe_load(read("autoscaler.yaml"))
        self.assertEqual((scaler["kind"], self.fleet["kind"]), ("FleetAutoscaler", "Fleet"))
        self.assertEqual(scaler["spec"]["fleetName"], self.fleet["metadata"]["name"])

    def test_it_has_longer_to_end_than_it_takes(self):
        self.assertGreater(self.pod["terminationGracePeriodSeconds"], 3)


class Scripts(ProgramTest):
    def built(self):
        """Returns a folder with the installed programs in the layout of a build."""
        os.makedirs(self.path("build/bin"))
        for name in ("tandem-server", "tandem-mesh-reader", "tandem-token"):
            os.symlink(os.path.join(BIN, name), self.path(f"build/bin/{name}"))
        return self.path("build")

    def test_the_root_file_system_has_what_the_programs_load(self):
        code, out, err = script("root-filesystem", "--build", self.built(), "--include", "pymol-data", "--dry-run")
        self.assertEqual(code, 0, err)
        packages = out.split()
        for package in ("libc6", "libssl3", "libprotobuf32", "curl", "pymol-data"):
            self.assertIn(package, packages)
        for package in packages:
            status = subprocess.run(["dpkg-query", "-W", package], capture_output=True, check=False).returncode
            self.assertTrue(status == 0 or package in ("curl", "pymol-data"), package)

    def test_wrong_arguments_of_it_are_named(self):
        there = self.write("there.tar", "")
        for arguments, word in (((), "name the file"), (("root.zip",), "root.zip"), (("--mirror",), "--mirror"),
                                (("--frob", "a.tar"), "--frob"), (("a.tar", "b.tar"), "b.tar"),
                                (("--build", "/nowhere", "a.tar"), "/nowhere/bin/tandem-server"), ((there,), "--force")):
            with self.subTest(arguments=arguments):
                self.assert_setup_error(script("root-filesystem", *arguments), word)
        self.assertEqual(os.path.getsize(there), 0, "it was left")

    def test_wrong_arguments_of_the_cost_are_named(self):
        for arguments, word in ((("--rooms", "33"), "--rooms"), (("--fleet", "0"), "--fleet"), (("--lab", "/nowhere/lab"), "/nowhere/lab")):
            with self.subTest(arguments=arguments):
                code, _, err = script("fleet-cost", *arguments)
                self.assertEqual(code, 2)
                self.assertIn(word, err)

    def test_the_cost_grows_with_the_fleet_as_measured(self):
        """Replaces tandem-lab by a script with constant results. Its traffic on the loopback is measured."""
        lab = self.write("lab", """#!/usr/bin/env python3
import json, socket, sys, time
assert sys.argv[1:3] == ["bench", "server"] and sys.argv[sys.argv.index("--clients") + 1] == "6", sys.argv
one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
one.bind(("127.0.0.1", 0))
end = time.monotonic() + 2
while time.monotonic() < end:
    one.sendto(b"x" * 1000, one.getsockname())
    time.sleep(0.01)
print(json.dumps({"cpu_seconds_per_second": 0.5, "each_room": [{"kept_percent": 99.5}, {"kept_percent": 100}]}))
""")
        os.chmod(lab, stat.S_IRWXU)
        code, out, err = script("fleet-cost", "--lab", lab, "--rooms", "2", "--users", "3", "--fleet", "1000", "--runs", "1", "--json")
        self.assertEqual(code, 0, err)
        cost = json.loads(out)
        self.assertEqual((cost["cores_a_room"], cost["fleet_cores"]), (0.25, 250))
        self.assertGreater(cost["mbit_per_s_a_room"], 0)
        self.assertAlmostEqual(cost["fleet_mbit_per_s"], 1000 * cost["mbit_per_s_a_room"])

    def test_shellcheck_finds_nothing(self):
        done = subprocess.run(["shellcheck", os.path.join(FOLDER, "root-filesystem")], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main()
