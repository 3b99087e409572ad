"""Common parts of the tests of libtandem. The library is installed under a prefix, and programs use it from there."""

import glob
import os
import shutil
import subprocess
import tempfile

from support import PATIENCE_S, SOURCE, ProgramTest, read_trace, run

BUILD = os.environ["TANDEM_BUILD"]
SAMPLES = os.path.join(SOURCE, "client", "embed", "samples")
CONSUMER = os.path.join(SOURCE, "tests", "system", "embed_consumer")
# Positions on the wire are floats (proto/tandem/state.proto): their rounding error below 1 m is 6e-8 m.
WIRE_ERROR_M = 1e-7


def install(prefix, *components):
    for component in components:
        subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix, "--component", component], check=True,
                       capture_output=True)


class EmbeddedTest(ProgramTest):
    """The library is installed and then moved, because programs of other projects must not name the build folder."""

    components = ()  # to install; empty: all

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        first, cls.prefix = os.path.join(cls.place.name, "first"), os.path.join(cls.place.name, "prefix")
        if cls.components:
            install(first, *cls.components)
        else:
            subprocess.run(["cmake", "--install", BUILD, "--prefix", first], check=True, capture_output=True)
        shutil.move(first, cls.prefix)
        (pkgconfig,) = glob.glob(os.path.join(cls.prefix, "lib", "**", "pkgconfig"), recursive=True)
        cls.libraries = os.path.dirname(pkgconfig)
        cls.environment = {**os.environ, "PKG_CONFIG_PATH": pkgconfig, "LD_LIBRARY_PATH": cls.libraries}

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def run_program(self, *command):
        """Runs a program against the installed library. Returns its output."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def held_bodies(self, recording):
        """Returns the bodies that the server recorded as held."""
        (file,) = glob.glob(os.path.join(recording, "*.mcap"))
        tables = self.path("tables")
        self.assertEqual(run("tandem-replay", "export", file, "--out", tables)[0], 0)
        return {row["held_body"] for row in read_trace(os.path.join(tables, "tools.csv"))} - {0}

    def check_against_recording(self, read, recording):
        """Checks what a program has read (embed_consumer/check.cpp) against its ticks and the server's recording."""
        self.assertEqual(read["held"], 2)
        self.assertGreater(read["compared"], 300)
        self.assertEqual(read["different"], 0)
        self.assertGreater(read["largest_n"], 1, "the crate of 0.9 kg pulls down")
        self.assertEqual(self.held_bodies(recording), {2})
        compared = 0
        for row in read_trace(self.path("tables/tools.csv")):
            pose = read["tools"].get(str(int(row["step"])))
            if row["user"] != read["user"] or pose is None:
                continue
            compared += 1
            for axis, value in zip("xyz", pose):
                self.assertAlmostEqual(row[f"tool_p_{axis}_m"], value, delta=WIRE_ERROR_M)
        self.assertGreater(compared, 20)
