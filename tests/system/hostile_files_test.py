"""Tests that files designed to harm their reader (hostile_files.py) are refused with one clear line, in bounded memory
and time."""

import os
import subprocess
import unittest

import hostile_files
from support import PATIENCE_S, ProgramTest, program

MAX_MEMORY_KIB = 1 << 20
MAX_CPU_S = 5  # limit of the processor time, which is independent of the load of the machine


class HostileFiles(ProgramTest):
    def load(self, case, *arguments):
        """Runs a server with the case. Returns (exit code, stderr, processor time in s, peak memory in KiB), including
        its child processes."""
        seen = hostile_files.load(self.folder, case, program("tandem-server"), *arguments)
        return seen["code"], seen["err"], seen["cpu_s"], seen["memory_kib"]

    def assert_refused(self, case, *arguments, cpu_s=MAX_CPU_S):
        code, err, took_s, memory_kib = self.load(case, *arguments)
        lines = [line for line in err.splitlines() if not line.startswith("building contact")]
        self.assertEqual(code, 2, err)
        self.assertEqual(len(lines), 1, err)
        self.assertIn(os.path.join(self.folder, hostile_files.FILES[case][0]), lines[0].replace("file is a.", "file is " + self.path("a.")), "names the file")
        self.assertRegex(lines[0], "[;:] .*(give|export|at most|allow more|keep|unpack|correct|not a scene|no geometry|simplify|join|stray|fetch)",
                         "and what would be right")
        self.assertLess(took_s, cpu_s)
        self.assertLess(memory_kib, MAX_MEMORY_KIB)

    def test_a_mesh_is_refused(self):
        for case in hostile_files.MESHES:
            with self.subTest(case=case):
                self.assert_refused(case)

    def test_a_structure_is_refused(self):
        for case in hostile_files.STRUCTURES:
            with self.subTest(case=case):
                self.assert_refused(case)

    def test_a_scene_is_refused(self):
        for case in hostile_files.SCENES:
            with self.subTest(case=case):
                self.assert_refused(case)

    def test_a_shape_that_takes_long_is_refused_within_the_limit_that_was_given(self):
        for case in hostile_files.SHAPES:
            with self.subTest(case=case):
                self.assert_refused(case, "--build-limit", "2s", cpu_s=MAX_CPU_S + 2 * (os.cpu_count() or 1))

    def test_the_reader_is_needed_and_named(self):
        for case in ("obj of one face of 200,000 corners", "ply of two billion vertices"):
            scene = hostile_files.scene_file(self.folder, case)
            done = subprocess.run([program("tandem-server"), "--port", "0", "--scene", scene], capture_output=True,
                                  text=True, timeout=PATIENCE_S,
                                  env=dict(os.environ, TANDEM_MESH_READER="/nowhere/reader"))
            self.assert_setup_error((done.returncode, done.stdout, done.stderr), "/nowhere/reader", "TANDEM_MESH_READER")

    def test_a_large_polygon_that_is_none_is_read_or_refused(self):
        code, err, took_s, memory_kib = self.load("obj of one face of 200,000 corners", "--duration", "100ms")
        self.assertIn(code, (0, 2), err)
        self.assertLess(took_s, 2 * MAX_CPU_S)
        self.assertLess(memory_kib, MAX_MEMORY_KIB)


if __name__ == "__main__":
    unittest.main()
