"""Tests that the shipped delay paths equal the output of their generator."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

LINKS = pathlib.Path(__file__).resolve().parents[3] / "lab" / "links"


class DelayPaths(unittest.TestCase):
    def test_generator_makes_the_shipped_files_to_the_byte(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, LINKS / "make_delay_paths.py", folder], check=True)
            made = {path.name: path.read_bytes() for path in pathlib.Path(folder).iterdir()}
        shipped = {path.name: path.read_bytes() for path in LINKS.glob("*.json")}
        self.assertEqual(sorted(made), sorted(shipped))
        for name, text in made.items():
            self.assertEqual(text, shipped[name], f"{name}: make it anew with lab/links/make_delay_paths.py")


if __name__ == "__main__":
    unittest.main()
