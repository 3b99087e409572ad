"""Tests the installed library: it is installed under a prefix, and other projects build programs with it by pkg-config
and by CMake. The programs join a running server and hold a body."""

import ast
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import support
from support import PATIENCE_S, SOURCE, ProgramTest, Server, read_trace, run

BUILD = os.environ["TANDEM_BUILD"]
SAMPLES = os.path.join(SOURCE, "client", "embed", "samples")
CONSUMER = os.path.join(SOURCE, "tests", "system", "embed_consumer")
# Positions on the network are single-precision (proto/tandem/state.proto). Their rounding error below 1 m is 6e-8 m.
WIRE_ERROR_M = 1e-7


def install(prefix, *components):
    for component in components:
        subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix, "--component", component], check=True,
                       capture_output=True)


def files_below(folder):
    """Returns the relative paths of all files, with the version of the library replaced by V."""
    names = []
    for place, _, files in os.walk(folder):
        names += [os.path.relpath(os.path.join(place, file), folder) for file in files]
    version = run("tandem-client", "--version")[1].split()[-1]
    return sorted(name.replace(version, "V") for name in names)


class Embedded(ProgramTest):
    """All files are installed and then moved, because programs of other projects must not depend on the build folder.
    """

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        first, cls.prefix = os.path.join(cls.place.name, "first"), os.path.join(cls.place.name, "prefix")
        subprocess.run(["cmake", "--install", BUILD, "--prefix", first], check=True, capture_output=True)
        shutil.move(first, cls.prefix)
        (pkgconfig,) = glob.glob(os.path.join(cls.prefix, "lib", "**", "pkgconfig"), recursive=True)
        cls.libraries = os.path.dirname(pkgconfig)
        cls.environment = {**os.environ, "PKG_CONFIG_PATH": pkgconfig, "LD_LIBRARY_PATH": cls.libraries}
        cls.built = os.path.join(cls.place.name, "built")
        subprocess.run(["cmake", "-S", CONSUMER, "-B", cls.built, f"-DCMAKE_PREFIX_PATH={cls.prefix}",
                        f"-DSAMPLES={SAMPLES}"], check=True, capture_output=True)
        subprocess.run(["cmake", "--build", cls.built], check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

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

    def held_bodies(self, recording):
        """Returns the bodies that the server recorded as held."""
        (file,) = glob.glob(os.path.join(recording, "*.mcap"))
        tables = self.path("tables")
        self.assertEqual(run("tandem-replay", "export", file, "--out", tables)[0], 0)
        return {row["held_body"] for row in read_trace(os.path.join(tables, "tools.csv"))} - {0}

    def test_components_contain_what_packages_need(self):
        lib = os.path.relpath(self.libraries, self.prefix)
        expected = {
            "runtime-library": [f"{lib}/libtandem.so.0", f"{lib}/libtandem.so.V"],
            "development": ["include/tandem/tandem.h", "include/tandem/tandem.hpp",
                            *(f"{lib}/cmake/tandem/{name}" for name in (
                                "tandem-config-release.cmake", "tandem-config-version.cmake", "tandem-config.cmake")),
                            f"{lib}/libtandem.so", f"{lib}/pkgconfig/tandem.pc"]}
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

    def test_programs_that_cmake_has_built_run(self):
        for name in ("01_touch_a_room", "02_own_device", "03_touch_a_room"):
            with self.subTest(name=name), Server("--scene", "crate") as server:
                done = subprocess.run([os.path.join(self.built, name), f"127.0.0.1:{server.port}"],
                                      capture_output=True, text=True, timeout=PATIENCE_S)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_forces_equal_the_ticks_and_poses_equal_the_recording(self):
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            read = json.loads(self.start(os.path.join(self.built, "check"), server.port))
        self.assertEqual(read["held"], 2)
        self.assertGreater(read["compared"], 300)
        self.assertEqual(read["different"], 0)
        self.assertGreater(read["largest_n"], 1, "the crate of 0.9 kg pulls down")
        self.assertEqual(self.held_bodies(self.path("recording")), {2})
        compared = 0
        for row in read_trace(self.path("tables/tools.csv")):
            pose = read["tools"].get(str(int(row["step"])))
            if row["user"] != read["user"] or pose is None:
                continue
            compared += 1
            for axis, value in zip("xyz", pose):
                self.assertAlmostEqual(row[f"tool_p_{axis}_m"], value, delta=WIRE_ERROR_M)
        self.assertGreater(compared, 20)

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
