"""Tests that the corpus of meshes matches its classes, and that the table of lab/studies/contact/README.md summarises
its runs."""

import collections
import contextlib
import io
import json
import pathlib
import stat
import sys
import tempfile
import types
import unittest

LAB = pathlib.Path(__file__).resolve().parents[3] / "lab"
sys.path.insert(0, str(LAB))
import make_contact_table as table  # noqa: E402
import mesh_corpus  # noqa: E402

CLOSED = {"flat faces", "round", "scans", "thin walls"}
OPEN = {"sheets", "large holes"}


def lone_edges(mesh):
    """Returns the directed edges without an opposite edge."""
    edges = collections.Counter((t[i], t[(i + 1) % 3]) for t in mesh.triangles for i in range(3))
    return [edge for edge, count in edges.items() if count != 1 or edges[edge[::-1]] != 1]


def volume(mesh):
    total = 0
    for a, b, c in mesh.triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (mesh.vertices[i] for i in (a, b, c))
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


class Corpus(unittest.TestCase):
    def test_has_a_hundred_meshes_of_every_class(self):
        made = list(mesh_corpus.made())
        self.assertGreaterEqual(len(made), 100)
        self.assertEqual(len({(kind, name) for kind, name, _ in made}), len(made))
        self.assertEqual({kind for kind, _, _ in made}, CLOSED | OPEN | {"no clean solid"})

    def test_closed_classes_are_closed_and_face_outwards(self):
        for kind, name, mesh in mesh_corpus.made():
            with self.subTest(f"{kind}: {name}"):
                if kind in CLOSED:
                    self.assertEqual(lone_edges(mesh), [])
                    self.assertGreater(volume(mesh), 0)
                elif kind in OPEN:
                    self.assertTrue(lone_edges(mesh))

    def test_is_written_in_every_format(self):
        with tempfile.TemporaryDirectory() as folder:
            files = mesh_corpus.write_made(pathlib.Path(folder))
            self.assertEqual({file.suffix[1:] for _, file in files}, set(mesh_corpus.WRITERS))
            self.assertTrue(all(file.stat().st_size > 100 for _, file in files))


def run(p99_us=50, depth_m=1e-4, pops=0, holds=True, hand_n=0.1):
    return {"step_us": {"p99": p99_us}, "max_penetration_m": depth_m, "pop_throughs": pops, "hand_force_step_max_n": hand_n,
            "contact_created_j": 1e-6 * p99_us, "check": {"checks": [{"holds": holds}]}}


def landing(ratio=0.5, separations=0, created_j=1e-5, rest_s=0.1):
    """Returns a result with one landing, and one drop on a face."""
    held = [("landing", ratio <= 1.1 and separations <= 1), ("landing", created_j <= 1e-3), ("drop", rest_s is not None)]
    return {"landing": {"landings": [{"force_ratio": ratio, "torque_ratio": 0.3, "separations": separations, "contact_created_j": created_j}],
            "drops": [{"is_on_face": True, "rest_s": rest_s, "contact_created_j": 1e-5}],
            "checks": [{"scope": scope, "holds": holds} for scope, holds in held]}}


class Table(unittest.TestCase):
    def test_a_row_counts_what_misses_its_bound(self):
        meshes = [(True, [run(50), run(300, 7e-4, 2, hand_n=0.4)]), (True, [run(100, holds=False), {"error": "late"}]), (False, [])]
        self.assertEqual(table.row("round", meshes),
                         ["round", 3, 2, 4, "200, 300", 1, "0.100, 0.700", 1, "0.10, 0.40", "0.300", 1, 1, 1])
        self.assertEqual(table.row("none", [(False, [])])[4], "–")

    def test_a_pair_is_run_once(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            lab = folder / "lab"
            lab.write_text(f"#!/bin/sh\necho run >>{folder}/runs\necho '{json.dumps(run())}'\n", encoding="utf-8")
            lab.chmod(lab.stat().st_mode | stat.S_IXUSR)
            options = types.SimpleNamespace(lab=str(lab), out=folder, check=1, steps=0, landing=False)
            for _ in range(2):
                self.assertEqual(table.run_pair(options, folder / "a.obj", "a", "self", folder / "a.obj"), run())
            self.assertEqual((folder / "runs").read_text(encoding="utf-8"), "run\n")

    def test_landings_are_kept_in_files_of_their_own(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "a-self.json").write_text(json.dumps(run()), encoding="utf-8")
            lab = folder / "lab"
            lab.write_text(f"#!/bin/sh\necho \"$@\" >>{folder}/runs\necho '{json.dumps(landing())}'\nexit 1\n", encoding="utf-8")
            lab.chmod(lab.stat().st_mode | stat.S_IXUSR)
            options = types.SimpleNamespace(lab=str(lab), out=folder, landing=True)
            for _ in range(2):
                self.assertEqual(table.run_pair(options, "a.obj", "a", "self", "a.obj"), landing())
            self.assertEqual((folder / "runs").read_text(encoding="utf-8"), f"bench contact --a a.obj --b a.obj --json --cache {folder / 'cache'} --landing\n")

    def test_landings_are_told_by_their_worst(self):
        runs = [landing(), landing(1.5, 2, 0.003, None), {"error": "late"}]
        self.assertEqual(table.landing_row("round", [(True, runs), (False, [])]),
                         ["round", 2, 3, "1.00, 1.50", "0.30, 0.30", 1, "3.000, 0.010", 2, 1, "2 of 4", 1])
        options = types.SimpleNamespace(partners=["self"], every=1, steps=0, landing=True)
        lines = table.table({"round": [(True, runs)], "none": [(False, [])]}, options).splitlines()
        self.assertEqual({line.count("|") for line in lines[2:]}, {len(table.LANDING_HEAD) + 1})

    def test_a_bench_that_fails_says_why(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            lab = folder / "lab"
            lab.write_text("#!/bin/sh\necho no triangles >&2\nexit 2\n", encoding="utf-8")
            lab.chmod(lab.stat().st_mode | stat.S_IXUSR)
            options = types.SimpleNamespace(lab=str(lab), out=folder, check=1, steps=0, landing=False)
            self.assertEqual(table.run_pair(options, folder / "a.obj", "a", "self", folder / "a.obj"), {"error": "no triangles", "code": 2})

    def test_a_mesh_without_triangles_is_none_and_one_that_is_refused_is_not_loaded(self):
        with tempfile.TemporaryDirectory() as name:
            lab = pathlib.Path(name) / "lab"
            options = types.SimpleNamespace(lab=str(lab))
            for script, is_loaded in (("echo a solid of 2 triangles", True),
                                      ("echo 'x.obj, which has no triangle (No meshes remaining); export it' >&2; exit 2", None),
                                      ("echo 'x.obj, which cannot be touched: no triangle of the mesh has an area' >&2; exit 2", None),
                                      ("echo 'x.obj, which has 2000000 triangles; at most 1000000 are possible' >&2; exit 2", False)):
                lab.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
                lab.chmod(lab.stat().st_mode | stat.S_IXUSR)
                with contextlib.redirect_stderr(io.StringIO()):
                    self.assertIs(table.is_loaded(options, "x.obj"), is_loaded)


if __name__ == "__main__":
    unittest.main()
