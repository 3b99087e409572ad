"""Tests the installed library: it is installed under a prefix, and other projects build programs with it by pkg-config
and by CMake. The programs join a running server and hold a body."""

import ast
import glob
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import unittest

import embedded
from embedded import CONSUMER, SAMPLES, install
from support import PATIENCE_S, SOURCE, Server, run


def files_below(folder):
    """Returns the relative paths of all files, with the version of the library replaced by V."""
    names = []
    for place, _, files in os.walk(folder):
        names += [os.path.relpath(os.path.join(place, file), folder) for file in files]
    version = run("tandem-client", "--version")[1].split()[-1]
    return sorted(name.replace(version, "V") for name in names)


class Embedded(embedded.EmbeddedTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.built = os.path.join(cls.place.name, "built")
        subprocess.run(["cmake", "-S", CONSUMER, "-B", cls.built, f"-DCMAKE_PREFIX_PATH={cls.prefix}",
                        f"-DSAMPLES={SAMPLES}"], check=True, capture_output=True)
        subprocess.run(["cmake", "--build", cls.built], check=True, capture_output=True)

    def compile(self, compiler, *options):
        """Builds a sample with pkg-config. Fails on warnings."""
        source, program = os.path.join(SAMPLES, options[-1]), self.path("program")
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "tandem"], env=self.environment, check=True,
                               capture_output=True, text=True).stdout.split()
        done = subprocess.run([compiler, *options[:-1], "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", program, source,
                               *flags], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return program

    def start(self, program, port):
        done = subprocess.run([program, f"127.0.0.1:{port}"], env=self.environment, capture_output=True, text=True,
                              timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_components_contain_what_packages_need(self):
        lib = os.path.relpath(self.libraries, self.prefix)
        expected = {
            "runtime-library": [f"{lib}/libtandem.so.0", f"{lib}/libtandem.so.V"],
            "development": ["include/tandem/tandem.h", "include/tandem/tandem.hpp",
                            *(f"{lib}/cmake/tandem/{name}" for name in (
                                "tandem-config-release.cmake", "tandem-config-version.cmake", "tandem-config.cmake")),
                            f"{lib}/libtandem.so", f"{lib}/pkgconfig/tandem.pc", "share/tandem/csharp/Tandem.cs",
                            "share/tandem/csharp/TandemHand.cs"]}
        for component, files in expected.items():
            folder = self.path(component)
            install(folder, component)
            self.assertEqual(files_below(folder), files)

    def test_library_exports_only_versioned_functions_of_its_header(self):
        library = os.path.join(self.libraries, "libtandem.so")
        lines = subprocess.run(["nm", "-D", "--defined-only", library], check=True, capture_output=True,
                               text=True).stdout.splitlines()
        names = {line.split()[-1] for line in lines} - {"TANDEM_0"}
        with open(os.path.join(self.prefix, "include/tandem/tandem.h"), encoding="utf-8") as file:
            text = file.read()
        for name in names:
            self.assertRegex(name, r"^tandem_\w+@@TANDEM_0$")
            self.assertIn(name.split("@")[0] + "(", text)
        self.assertEqual(len(names), len(re.findall(r"^TANDEM_API ", text, re.M)))

    def test_c_sample_holds_a_body_and_the_server_records_it(self):
        program = self.compile("cc", "-std=c11", "01_touch_a_room.c")
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            out = self.start(program, server.port)
        self.assertIn("grabbed body 2", out)
        self.assertEqual(self.held_bodies(self.path("recording")), {2})

    def test_sample_with_a_device_of_its_own_lifts_a_body(self):
        program = self.compile("cc", "-std=gnu11", "02_own_device.c")
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            out = self.start(program, server.port)
        self.assertIn("body 2 held", out)
        self.assertEqual(self.held_bodies(self.path("recording")), {2})

    def test_cpp_sample_holds_a_body_and_receives_every_tick(self):
        program = self.compile("c++", "-std=c++17", "03_touch_a_room.cpp")
        with Server("--scene", "crate") as server:
            out = self.start(program, server.port)
        self.assertIn("grabbed body 2", out)
        self.assertIn("crate is", out)

    def start_python(self, script, port):
        (package,) = glob.glob(os.path.join(self.prefix, "lib", "python3", "dist-packages"))
        # The module must find the moved library relative to its own file.
        done = subprocess.run([sys.executable, script, f"127.0.0.1:{port}"], capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": package}, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_python_sample_holds_a_body(self):
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            out = self.start_python(os.path.join(SAMPLES, "04_touch_a_room.py"), server.port)
        self.assertIn("grabbed body 2", out)
        self.assertEqual(self.held_bodies(self.path("recording")), {2})

    def test_python_package_works_while_python_is_busy(self):
        with Server("--scene", "crate") as server:
            result = json.loads(self.start_python(os.path.join(CONSUMER, "check.py"), server.port))
        self.assertEqual(result["held"], 2)
        self.assertEqual(result["lost"], 0)
        self.assertGreater(result["ticks"], 500)
        self.assertGreater(result["ticks_while_busy"], 50)
        self.assertTrue(result["are_consecutive"])
        self.assertEqual(result["shape"], [result["ticks"], 3])
        self.assertGreater(result["largest_n"], 0.5)
        self.assertEqual(result["after_close"], "the client was closed")
        self.assertIn("body", result["refused"])

    def interrupt(self, script, port):
        """Runs a script, and presses Ctrl-C after its first line. Returns its further output."""
        (package,) = glob.glob(os.path.join(self.prefix, "lib", "python3", "dist-packages"))
        process = subprocess.Popen([sys.executable, script, f"127.0.0.1:{port}"], stdout=subprocess.PIPE, text=True,
                                   env={**os.environ, "PYTHONPATH": package})
        self.addCleanup(process.kill)
        self.assertEqual(process.stdout.readline(), "waits\n")
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE_S / 2)  # shorter than the time-outs in the scripts
        self.assertEqual(process.returncode, 0, out)
        return out

    def test_control_c_ends_a_wait_of_python_and_the_client_leaves(self):
        script = """
import sys, tandem
client = tandem.Client(server=sys.argv[1], is_insecure=True)
try:
    with client:
        for event in client.events(timeout_s=1): pass
        print("waits", flush=True)
        WAIT
except KeyboardInterrupt:
    print("interrupted")
"""
        for wait in ("list(client.events(timeout_s=600))", "client.wait_event(600)"):
            with self.subTest(wait=wait), Server("--scene", "crate") as server:
                waits = self.write("waits.py", script.replace("WAIT", wait))
                self.assertEqual(self.interrupt(waits, server.port), "interrupted\n")
                server.wait_for_log("user 1 .* left on request")

    def test_control_c_ends_a_join_of_python_and_closes_the_client(self):
        script = self.write("joins.py", """
import sys, tandem, time
client = tandem.Client(server=sys.argv[1], is_insecure=True)
print("waits", flush=True)
begun = time.monotonic()
try:
    with client: pass
except KeyboardInterrupt:
    print("early" if time.monotonic() - begun < 10 else "late")
try:
    client.session()
except tandem.Error as error:
    print("closed" if error.status == tandem.BAD_HANDLE else error)
""")
        with socket.socket() as silent:  # accepts connections, but never answers
            silent.bind(("127.0.0.1", 0))
            silent.listen()
            self.assertEqual(self.interrupt(script, silent.getsockname()[1]), "early\nclosed\n")

    def test_with_closes_a_client_of_python_that_cannot_join(self):
        script = self.write("refused.py", """
import sys, tandem
device = tandem.OwnDevice()
for _ in range(2):  # a client that stays open would keep the device
    client = tandem.Client(server=sys.argv[1], room="no_such_room", is_insecure=True, own_device=device)
    try:
        with client: print("joined")
    except tandem.Error as error:
        print(error)
    for call in (client.session, lambda: client.wait_event(1), lambda: client.wait_joined(float("nan"))):
        try:
            call()
        except tandem.Error as error:
            print(error.status == tandem.BAD_HANDLE)
""")
        with Server("--scene", "crate") as server:
            out = self.start_python(script, server.port).splitlines()
        self.assertEqual(out[1:4] + out[5:], ["True"] * 6, out)
        for line in (out[0], out[4]):
            self.assertIn("no_such_room", line)

    def test_python_continues_while_it_collects_a_client(self):
        """Closing a client waits for its threads. A client that Python collects must not hold the interpreter meanwhile."""
        script = self.write("collects.py", """
import sys, tandem, threading, time
client = tandem.Client(server=sys.argv[1], is_insecure=True)
client.join()
client.wait_joined()
client.start()
for event in client.events(timeout_s=0.5): pass
counts, should_end = [0], threading.Event()
def count():
    while not should_end.is_set():
        counts[0] += 1
        time.sleep(0.0002)
counter = threading.Thread(target=count)
counter.start()
time.sleep(0.05)
sys.setswitchinterval(100)  # only a release of the lock lets the other thread run
before = counts[0]
del client, event
after = counts[0]
should_end.set()
counter.join()
print(after - before)
""")
        with Server("--scene", "crate") as server:
            counted = int(self.start_python(script, server.port))
            server.wait_for_log("user 1 .* left on request")
        self.assertGreater(counted, 0)

    def test_python_stub_names_what_the_module_has(self):
        with open(os.path.join(SOURCE, "client/embed/python/tandem/__init__.pyi"), encoding="utf-8") as file:
            stub = {}
            for node in ast.parse(file.read()).body:
                if isinstance(node, ast.AnnAssign):
                    stub[node.target.id] = None
                elif isinstance(node, ast.ClassDef):
                    stub[node.name] = sorted({getattr(each, "name", None) or each.target.id for each in node.body
                                              if isinstance(each, (ast.AnnAssign, ast.FunctionDef))} - {"status"})
        script = self.write("names.py", """
import json, tandem
def names(of):
    kept = ("__init__", "__len__", "__enter__", "__exit__")
    return sorted(n for n, v in vars(of).items() if not n.startswith("_") or n in kept and n in of.__dict__)
has = {n: names(v) if isinstance(v, type) else None for n, v in vars(tandem).items() if not n.startswith("_")}
print(json.dumps(has | {"__version__": None}))
""")
        has = json.loads(self.start_python(script, 0))
        for names in (stub, has):  # pybind11 adds __init__ even to values that cannot be constructed
            names.update({name: [each for each in members if each != "__init__"]
                          for name, members in names.items() if members is not None})
        self.assertEqual(stub, has)

    def test_recipes_use_names_of_the_headers(self):
        with open(os.path.join(self.prefix, "include/tandem/tandem.hpp"), encoding="utf-8") as hpp, \
                open(os.path.join(self.prefix, "include/tandem/tandem.h"), encoding="utf-8") as h:
            known = set(re.findall(r"\w+", hpp.read() + h.read()))
        known |= {"TANDEM_DATA", "TANDEM_WATCHDOG"}  # variables of the environment (common/base/folders.hpp, devices/watchdog.hpp)
        for recipe in ("UNREAL.md", "ROS2.md"):
            with open(os.path.join(SOURCE, "client", "embed", recipe), encoding="utf-8") as file:
                text = file.read()
            self.assertIn("Not tested", text)
            used = set(re.findall(r"\b(tandem_\w+|TANDEM_\w+)", text)) | set(re.findall(r"tandem::(\w+)", text))
            used |= set(re.findall(r"\b(?:[cC]lient_?|device_?|Client)(?:\.|->)(\w+)\(", text)) - {"reset"}
            used |= set(re.findall(r"\b(?:[sS]ample|[tT]ick|[sS]ettings|hardware|handle_D|on_hand_D|tool_W|handle_W|Session|about)\.(\w+)", text))
            self.assertGreater(len(used), 15)
            self.assertEqual(used - known - {"tandem"}, set(), recipe)

    def test_programs_that_cmake_has_built_run(self):
        for name in ("01_touch_a_room", "02_own_device", "03_touch_a_room"):
            with self.subTest(name=name), Server("--scene", "crate") as server:
                done = subprocess.run([os.path.join(self.built, name), f"127.0.0.1:{server.port}"],
                                      capture_output=True, text=True, timeout=PATIENCE_S)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_forces_equal_the_ticks_and_poses_equal_the_recording(self):
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            read = json.loads(self.start(os.path.join(self.built, "check"), server.port))
        self.check_against_recording(read, self.path("recording"))

    def test_program_that_ends_without_close_leaves_the_room(self):
        with Server("--scene", "crate") as server:
            for number in range(1, 6):  # some of the exits happen while the local model is being built
                self.start(os.path.join(self.built, "forgets_close"), server.port)
                server.wait_for_log(f"user {number} .* left on request")

    def test_no_server_is_an_error_with_a_reason(self):
        done = subprocess.run([os.path.join(self.built, "01_touch_a_room"), "127.0.0.1:9"], capture_output=True,
                              text=True, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 2)
        self.assertIn("refused", done.stderr)


if __name__ == "__main__":
    unittest.main()
