"""Tests scenes with meshes and soft bodies in live sessions: prepared shapes are stored, and meshes and soft bodies are
displayed."""

import json
import os
import tempfile
import unittest

from support import ProgramTest, Server, finish, run, start_client

# A closed tetrahedron with edges of 4 cm.
TETRAHEDRON = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n"
# Three triangles that share an edge. They enclose no volume.
FIN = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"


def mesh_scene(folder, mesh_text):
    with open(os.path.join(folder, "part.obj"), "w", encoding="ascii") as file:
        file.write(mesh_text)
    scene = os.path.join(folder, "scene.json")
    body = {"name": "part", "shapes": [{"mesh": {"file": "part.obj", "scale": 0.01}}]}
    tool = {"name": "t", "placement": {"position_m": [0.01, 0.01, 0.1]}}
    with open(scene, "w", encoding="ascii") as file:
        json.dump({"name": "part", "bodies": [body], "tools": [tool]}, file)
    return scene


class Meshes(ProgramTest):
    def test_contact_is_built_once_and_then_comes_from_the_cache(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, cache = mesh_scene(folder, TETRAHEDRON), os.path.join(folder, "cache")
            arguments = ("tandem-server", "--scene", scene, "--port", "0", "--duration", "100ms", "--cache", cache)
            code, _, first = run(*arguments)
            self.assertEqual(code, 0, first)
            self.assertIn("building contact of part.obj: 100 %", first)
            self.assertIn("part.obj: contact built in", first)
            self.assertEqual([name.endswith(".contact") for name in os.listdir(cache)], [True])
            code, _, second = run(*arguments)
            self.assertEqual(code, 0, second)
            self.assertIn("part.obj: contact from cache in", second)
            self.assertNotIn("building", second)

    def test_sheets_that_meet_at_an_edge_are_touched_and_said_to_be_sheets(self):
        with tempfile.TemporaryDirectory() as folder:
            code, _, said = run("tandem-server", "--scene", mesh_scene(folder, FIN), "--port", "0", "--duration", "100ms")
            self.assertEqual(code, 0, said)
            self.assertIn("part.obj: a sheet of 3 triangles: ", said)

    def test_a_file_without_triangles_is_refused_with_the_reason(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assert_setup_error(run("tandem-server", "--scene", mesh_scene(folder, "v 0 0 0\nv 1 0 0\n"), "--port", "0"),
                                    "tandem-server: ", "part.obj", "which has no triangle")


class Soft(ProgramTest):
    def test_a_soft_pad_pushes_a_live_hand_back(self):
        with Server("--scene", "soft_pad") as server:
            code, out, err = finish(start_client(server.port, "--json", "--hand", "press-down", "--duration", "6s"))
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertGreater(summary["force_n"]["max"], 0.3)
        self.assertTrue(summary["all_forces_finite"])


class Room(ProgramTest):
    def test_the_room_benchmark_measures_steps_and_lateness_apart(self):
        code, out, err = run("tandem-lab", "bench", "room", "--scene", "two_boxes", "--seconds", "4",
                             "--json")
        # The measured speed depends on the machine. Therefore exit codes 0 and 1 are accepted, but an error is not.
        self.assertIn(code, (0, 1), err)
        result = json.loads(out)
        self.assertEqual(sorted(result["step_us"]), ["max", "p50", "p99", "p999"])
        self.assertEqual(sorted(result["wake_up_lateness_us"]), ["max", "p50", "p99", "p999"])
        self.assertEqual(result["users"], 2)
        self.assertGreater(result["steps"], 1000)
        self.assertGreater(result["contacts_max"], 0)

    def test_more_users_than_tools_is_a_mistake(self):
        self.assert_setup_error(run("tandem-lab", "bench", "room", "--scene", "two_boxes", "--users", "9"),
                                "tandem-lab: ", "--users 9", "2 tools")


if __name__ == "__main__":
    unittest.main()
