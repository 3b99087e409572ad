"""Tests the output of the programs. Machine-readable output is one JSON object, and an error is one clear line."""

import json
import os
import pathlib
import re
import subprocess
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, program, run, start_client

import needs  # from tests/support; support.py adds this folder to the path

LATENESS_KEYS = ["max", "p50", "p99", "p999"]


class Json(ProgramTest):
    def test_the_servers_output_is_one_object_and_the_ready_line_is_not_in_it(self):
        code, out, err = run("tandem-server", "--json", "--port", "0", "--scene", "two_boxes", "--duration", "1s")
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["program"], "tandem-server")
        self.assertTrue(summary["version"])
        room = summary["rooms"][0]
        self.assertEqual(room["steps"], 0, "nobody came")
        self.assertIn("missed", room)
        self.assertEqual(sorted(room["lateness_us"]), LATENESS_KEYS)
        self.assertIn("listening on", err)

    def test_the_clients_output_is_one_object_that_says_what_was_run(self):
        with Server("--scene", "two_boxes", "--room", "attic") as server:
            code, out, err = finish(start_client(server.port, "--json", "--duration", "1s", "--transport", "tcp",
                                                 "--delay", "5ms", "--seed", "9", "--hand-mass", "0.4"))
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["program"], "tandem-client")
        self.assertTrue(summary["version"])
        self.assertEqual(summary["room"], "attic", "the only room was meant")
        self.assertEqual((summary["role"], summary["transport"], summary["seed"]), ("manipulator", "tcp", 9))
        self.assertEqual((summary["hand"], summary["hand_parameters"]["mass_kg"]), ("rest", 0.4))
        self.assertEqual(summary["link_parameters"]["down"]["delay_ms"], 5)
        self.assertEqual(sorted(summary["lateness_us"]), LATENESS_KEYS)
        self.assertIn("missed", summary)
        self.assertEqual(summary["links"]["up"]["sent"], 0)
        self.assertGreater(summary["links"]["control_up"]["delivered"], 100, "state over TCP")

    def test_a_device_without_torque_says_so_in_a_line(self):
        with Server("--scene", "two_boxes") as server:
            code, _, err = finish(start_client(server.port, "--json", "--duration", "1s", "--profile", "touch"))
        self.assertEqual(code, 0, err)
        self.assertEqual(err.count("device touch shows no torque"), 1, err)

    def test_an_observer_is_not_silent(self):
        with Server("--scene", "two_boxes") as server:
            code, out, err = finish(start_client(server.port, "--json", "--duration", "2s", "--role", "observer"))
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertEqual(summary["role"], "observer")
        self.assertGreater(summary["datagrams"]["received"], 100)
        self.assertEqual(summary["not_displaying_ticks"], summary["ticks_run"])
        self.assertLess(summary["silent_ticks"], summary["ticks_run"] / 2)


PDB_LINE = "{record:<6}{serial:5d}  {name:<3} {residue:<4}{chain}{number:4d}    {x:8.3f}{y:8.3f}{z:8.3f}  1.00  0.00\n"


class Structure(ProgramTest):
    """Tests the reports about a molecule that was changed when its file was read. The operator, the report and every
    user must receive them."""

    def scene_of(self, structure):
        body = {"name": "m", "shapes": [{"molecule": {"file": structure}}], "mass_kg": 0.1}
        tool = {"name": "a", "mass_kg": 0.1, "holds": "m"}
        return self.write("s.json", json.dumps({"name": "s", "bodies": [dict(body, graspable=True)], "tools": [tool],
                                                "molecular_field": {"metres_per_angstrom": 0.01}}))

    def served(self, scene):
        """Runs a server and a client. Returns log and notes of the server, and stderr and notes of the client."""
        server = subprocess.Popen([program("tandem-server"), "--insecure", "--json", "--port", "0", "--scene", scene],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        log = ""
        for line in server.stderr:
            log += line
            ready = re.search(r"listening on 127\.0\.0\.1:(\d+)", line)
            if ready:
                break
        code, out, err = finish(start_client(int(ready.group(1)), "--json", "--duration", "1s"))
        self.assertEqual(code, 0, err)
        server.terminate()
        report, more = server.communicate(timeout=PATIENCE_S)
        return log + more, json.loads(report)["rooms"][0]["notes"], err, json.loads(out)["notes"]

    def assert_told(self, structure, words):
        log, report, user, user_report = self.served(self.scene_of(structure))
        self.assertIn(words, log)
        self.assertIn(words, "\n".join(report))
        self.assertIn(words, user)
        self.assertIn(words, "\n".join(user_report))

    def test_an_unknown_ligand(self):
        needs.files(needs.OPLS)
        text = "".join(PDB_LINE.format(record="ATOM", serial=i + 1, name=name, residue="ALA", chain="A", number=1,
                                       x=1.5 * i, y=0, z=0) for i, name in enumerate(["N", "CA", "C", "O"]))
        text += "".join(PDB_LINE.format(record="HETATM", serial=9, name=f"C{i}", residue="LIG", chain="A", number=2,
                                        x=5, y=5, z=1.5 * i) for i in range(3))
        self.assert_told(self.write("tiny.pdb", text), "tiny.pdb: left out, no amino acids of oplsaa: 1 residue LIG (3 atoms)")

    def test_the_ligand_of_1hpv(self):
        structure = "/usr/share/pymol/data/tut/1hpv.pdb"
        needs.files(structure, needs.OPLS)
        self.assert_told(structure, "1 residue 478 (35 atoms)")


HELICES = "/usr/share/pymol/test/dat/3al1.pdb"


class Docking(ProgramTest):
    """Tests a room that is created from two structure files, without a scene file."""

    def test_two_hands_hold_two_files(self):
        needs.files(HELICES, needs.OPLS)
        cache = self.path("cache")
        # The hand moves the ligand into the attractive field and back.
        path = self.write("bring.json", json.dumps({"points": [
            {"t_s": 0, "position_m": [0, 0, 0]}, {"t_s": 2, "position_m": [0, -0.075, 0]}, {"t_s": 3.5},
            {"t_s": 5, "position_m": [0, 0, 0]}]}))
        with Server("--receptor", HELICES + ":A", "--ligand", HELICES + ":B", "--cache", cache,
                    "--record", self.path("recording")) as server:
            holds = start_client(server.port, "--json", "--duration", "7s")
            server.wait_for_log("user 1 .* joined")
            brings = start_client(server.port, "--json", "--duration", "6s", "--hand", path)
            for code, out, err in (finish(holds), finish(brings)):
                self.assertEqual(code, 0, err)
                report = json.loads(out)
                self.assertTrue(report["all_forces_finite"])
                self.assertEqual(report["stage"], "local-model")
                self.assertGreater(report["force_n"]["max"], 0.2, "they are felt")
                self.assertIn("1 N in the hand is", "\n".join(report["notes"]))
        self.check_complex(*pathlib.Path(self.path("recording")).glob("*.mcap"))
        (scene,) = pathlib.Path(cache).glob("docking-*.json")
        with Server("--scene", str(scene)) as server:
            self.assertTrue(server.port, "what was made can be given again")

    def check_complex(self, recording):
        """Checks that the lowest energy on the path is found, and that the saved structure has this energy."""
        file = self.path("best.cif")
        code, out, err = run("tandem-replay", "complex", str(recording), "--save", file, "--json")
        self.assertEqual(code, 0, err)
        best = json.loads(out)
        code, out, err = run("tandem-replay", "complex", str(recording), "--save", self.path("first.pdb"), "--at", "500ms",
                             "--json")
        self.assertEqual(code, 0, err)
        first = json.loads(out)
        self.assertLess(best["total_kj_mol"], first["total_kj_mol"] - 20, "they attract each other")
        self.assertLess(best["rmsd_angstrom"], first["rmsd_angstrom"], "and come to where the file has them")
        self.assertGreater(first["rmsd_angstrom"], 6, "drawn apart")
        code, out, err = run("tandem-lab", "energy", "--receptor", file + ":A", "--ligand", file + ":B", "--dielectric", "4r",
                             "--json")
        self.assertEqual(code, 0, err)
        self.assertAlmostEqual(json.loads(out)["total_kj_mol"], best["total_kj_mol"], delta=1e-2)
        self.assert_setup_error(run("tandem-replay", "complex", str(recording), "--save", self.path("best.xyz")), "best.xyz")
        self.assert_setup_error(run("tandem-replay", "complex", str(recording), "--save", self.path("no.pdb"), "--at", "0s"), "later")
        self.assert_setup_error(run("tandem-replay", "complex", str(recording), "--save", file), "is there already")

    def test_what_is_wrong_is_said(self):
        self.assert_setup_error(run("tandem-server", "--receptor", "", "--ligand", ":A"), "--receptor")
        self.assert_setup_error(run("tandem-server", "--receptor", ":A", "--ligand", ":B"), "names no file")
        self.assert_setup_error(run("tandem-server", "--scene", "two_boxes", "--dielectric", "4r"), "--receptor")
        config = self.write("dock.conf", 'hydrogens = "untied"\nreceptor = "a.pdb"\nligand = "b.pdb"\n')
        self.assert_setup_error(run("tandem-server", "--config", config), "hydrogens")
        self.assert_setup_error(run("tandem-server", "--receptor", "a.pdb"), "--receptor and --ligand go together")
        self.assert_setup_error(run("tandem-server", "--receptor", "a.pdb", "--ligand", "b.pdb"), "a.pdb: no such file")
        self.assert_setup_error(run("tandem-server", "--receptor", "a.pdb", "--ligand", "b.pdb", "--cache", ""), "--cache")
        self.assert_setup_error(run("tandem-server", "--receptor", "a.pdb", "--ligand", "b.pdb", "--force-field", "none"), "none.ff")


class Energy(ProgramTest):
    STRUCTURE = "/usr/share/pymol/test/dat/3al1.pdb"
    files = (STRUCTURE, needs.OPLS)

    def energy(self, receptor, ligand, *options):
        return run("tandem-lab", "energy", "--receptor", receptor, "--ligand", ligand, "--json", *options)

    def test_of_a_saved_complex_is_that_of_the_pose(self):
        file = self.path("complex.cif")
        code, out, err = self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":A", "--move", "0,25,0", "--save", file)
        self.assertEqual(code, 0, err)
        saved = json.loads(out)
        self.assertEqual(saved["saved"], file)
        code, out, err = self.energy(file + ":A", file + ":B")
        self.assertEqual(code, 0, err)
        self.assertAlmostEqual(json.loads(out)["total_kj_mol"], saved["total_kj_mol"], delta=1e-4)

    def test_without_parameter_files(self):
        code, out, err = self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":B", "--force-field", "built-in")
        self.assertEqual(code, 0, err)
        self.assertIn("built-in parameters by element, no charges", out)
        self.assertEqual(json.loads(out)["coulomb_kj_mol"], 0)
        self.assertLess(json.loads(out)["lj_kj_mol"], -10)
        self.assert_setup_error(self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":B", "--force-field", "/nowhere"),
                                "/nowhere", "gromacs-data")

    def test_with_another_force_field(self):
        code, out, err = self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":B", "--force-field", "amber99sb", "--hydrogens", "build")
        self.assertEqual(code, 0, err)
        self.assertEqual([json.loads(out)[key] for key in ("force_field", "mixing", "unassigned")], ["amber99sb", "arithmetic", 0])
        self.assert_setup_error(self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":B", "--force-field", "gromos54a7"),
                                "gromos54a7.ff/forcefield.itp:", "comb-rule 2 or 3")

    def test_beyond_the_cut_off_from_a_grid(self):
        pair = ["bench", "docking", "--receptor", self.STRUCTURE + ":A", "--ligand", self.STRUCTURE + ":B", "--hydrogens", "build",
                "--far-grid", "--seconds", "0.02", "--json"]
        code, out, err = run("tandem-lab", *pair, "--cutoff", "8")
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertEqual(report["method"], "clusters and grid")
        part = report["far_part"]
        self.assertLess(part["energy_error_kj_mol"], 0.05 * part["energy_kj_mol"])
        self.assertLess(part["force_error_kj_mol_angstrom"], 0.1 * part["force_kj_mol_angstrom"])
        self.assert_setup_error(run("tandem-lab", *pair, "--cutoff", "none"), "give a cut-off")

    def test_of_residues_sums_to_the_whole(self):
        code, out, err = self.energy(self.STRUCTURE + ":A", self.STRUCTURE + ":B", "--per-residue")
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        for which in ("receptor_residues", "ligand_residues"):
            residues = report[which]
            self.assertEqual([row["total_kj_mol"] for row in residues],
                             sorted((row["total_kj_mol"] for row in residues), key=abs, reverse=True))
            for key in ("lj_kj_mol", "coulomb_kj_mol"):
                self.assertAlmostEqual(sum(row[key] for row in residues), report[key], delta=1e-6)

    def test_is_not_saved_over_what_is_read_or_in_an_unknown_format(self):
        with open(self.STRUCTURE, encoding="utf-8") as original:
            file = self.write("own.pdb", original.read())
        self.assert_setup_error(self.energy(file + ":A", file + ":B", "--save", file), "tandem-lab: ", "--save", "give another name")
        self.assert_setup_error(self.energy(file + ":A", file + ":B", "--save", self.path("x.mol2")), "tandem-lab: ", "in .pdb or .cif")


class Redock(ProgramTest):
    STRUCTURE = "/usr/share/pymol/test/dat/3al1.pdb"
    files = (STRUCTURE, needs.OPLS)

    def redock(self, ligand, *options):
        return run("tandem-lab", "redock", "--receptor", self.STRUCTURE + ":A", "--ligand", self.STRUCTURE + ":" + ligand,
                   "--seeds", "1", *options)

    def test_prints_what_it_writes(self):
        folder = self.path("redocked")
        code, out, err = self.redock("B", "--json", "--out", folder)
        self.assertEqual(code, 0, err)
        redocked = json.loads(out)
        with open(os.path.join(folder, "redock.json"), encoding="utf-8") as kept:
            self.assertEqual(json.load(kept), redocked)
        (seed,) = redocked["seeds"]
        self.assertTrue(seed["docked"])
        self.assertEqual(redocked["round_trip_ms"], 100)

    def test_of_a_guiding_hand_prints_the_offset(self):
        code, out, err = self.redock("B", "--guided")
        self.assertEqual(code, 0, err)
        self.assertIn("Å off the minimum", out)

    def test_prints_how_far_the_ligand_is_from_the_native_pose(self):
        code, out, err = self.redock("B")
        self.assertEqual(code, 0, err)
        for words in ("native Å", "interface Å", "f_nat", "docked", "ligand RMSD of the minimum to the native pose"):
            self.assertIn(words, out)

    def shifted(self, way_angstrom):
        """Writes chain B of the helices, shifted by this distance along x, to a file. Returns its path."""
        with open(self.STRUCTURE, encoding="utf-8") as original:
            lines = [line for line in original if line.startswith(("ATOM", "HETATM")) and line[21] == "B"]
        return self.write("shifted.pdb", "".join("%s%8.3f%s" % (line[:30], float(line[30:38]) + way_angstrom, line[38:])
                                                 for line in lines))

    def redock_shifted(self, way_angstrom):
        return run("tandem-lab", "redock", "--receptor", self.STRUCTURE + ":A", "--ligand", self.shifted(way_angstrom),
                   "--seeds", "1")

    def test_fails_where_the_minimum_is_far_from_the_native_pose(self):
        code, out, err = self.redock_shifted(4)
        self.assertEqual(code, 1, out + err)
        self.assertIn("no minimum within 2 Å of the native pose", out)
        self.assertRegex(out, "FAILED  ligand RMSD of the minimum to the native pose")

    def test_of_parts_that_are_no_complex_is_refused(self):
        self.assert_setup_error(self.redock("A"), "tandem-lab: ", "no complex", "overlap", "name two parts of one complex")
        self.assert_setup_error(self.redock_shifted(60), "tandem-lab: ", "no residues are within 5 Å", " Å apart",
                                "in the same frame")


class Check(ProgramTest):
    def test_a_coupling_that_is_unstable_is_refused_with_a_value_that_is_not(self):
        arguments = ["check", "--law", "spring-damper", "--device", "omega.6", "--tool-mass", "0.05", "--json"]
        code, out, err = run("tandem-lab", *arguments, "--stiffness", "50000")
        self.assertEqual(code, 1, err)
        finding = json.loads(out)["findings"][0]
        self.assertTrue(finding["is_unstable"])
        self.assertEqual(finding["parameter"], "coupling.stiffness_n_per_m")
        code, out, err = run("tandem-lab", *arguments, "--stiffness", str(finding["remedy"]))
        self.assertEqual(code, 0, err)
        self.assertFalse(json.loads(out)["is_refused"])


class Mistakes(ProgramTest):
    def test_of_the_server(self):
        for arguments, words in [([], ["--scene"]), (["--bogus"], ["--bogus"]),
                                 (["--scene", "two_boxes", "--port", "70000"], ["--port", "0 to 65535"]),
                                 (["--scene", "two_boxes", "--duration", "3"], ["--duration", "3s"]),
                                 (["--scene", "two_boxes", "--room", ""], ["--room", "1 to 64 bytes"]),
                                 (["--config", "none.conf"], ["--config none.conf cannot be read"])]:
            with self.subTest(arguments=arguments):
                self.assert_setup_error(run("tandem-server", *arguments), "tandem-server: ", *words)

    def test_of_the_lab(self):
        experiment = self.write("e.json", json.dumps({"name": "e", "scene": "two_boxes", "users": [{"name": "a"}]}))
        crowd = self.write("crowd.json", json.dumps({"name": "crowd", "scene": "two_boxes",
                                                     "users": [{"name": name} for name in "abc"]}))
        subcommands = ("run or random or live or link or bench or calibrate or check or mesh or reproduce or energy or redock or "
                       "fit-order or report or therapy")
        for arguments, words in [([], [subcommands]), (["run"], ["--out", "tandem-lab run --help"]),
                                 (["bench"], ["field", "tandem-lab bench --help"]),
                                 (["bench", "contact"], ["--a", "tandem-lab bench contact --help"]),
                                 (["bench", "contact", "--a", "no.obj", "--b", "cube"],
                                  ["--a is no.obj", "which does not exist; give an existing file; or", "cube"]),
                                 (["bench", "contact", "--a", "cube", "--b", self.write("empty.obj", "")],
                                  ["--b is ", "empty.obj, which is empty"]),
                                 (["mesh"], ["needs a mesh file, or --all with a folder"]),
                                 (["mesh", "a.obj", "b.obj", "--picture", self.path("p.png")], ["--picture is of one mesh file", "2"]),
                                 (["mesh", "--all", "nowhere"], ["--all nowhere is not a folder"]),
                                 (["mesh", self.folder], [self.folder + ", which is a folder"]),
                                 (["bench", "room", "--users", "1", "--hands", "rest", "rest"],
                                  ["--hands names 2 paths for 1 user"]),
                                 (["bench", "goals", "--scene", "free"], ["--scene free: the scene has no game"]),
                                 (["therapy"], ["new or list or add or report or delete", "tandem-lab therapy --help"]),
                                 (["therapy", "new", "anna", "--data", self.folder], ["'anna'", "A-Z, 0-9"]),
                                 (["therapy", "delete", "PERSON-1", "--data", self.folder], ["no person PERSON-1", "therapy list"]),
                                 (["bench", "join", "--loss", "2"], ["--loss", "0 to 0.95"]),
                                 (["bench", "docking", "--receptor", "a.pdb", "--ligand", "b.pdb", "--sweep"],
                                  ["--sweep requires --interface-atoms"]),
                                 (["bench", "join", "--experiment", "no.json"], ["no.json"]),
                                 (["run", experiment, "--out", self.folder, "--stage", "telepathy"],
                                  ["--stage telepathy", "late-pose, hold"]),
                                 (["run", experiment, "--out", self.folder, "--threads", "-1"], ["--threads", "1 to 256"]),
                                 (["run", experiment, "--out", self.folder, "--seeds", "-1"], ["--seeds", "1 to 1000"]),
                                 (["run", experiment, "--out", self.folder, "--set", "link.rtt_ms=-1"],
                                  ["with ", "link.rtt_ms=-1", "link.rtt_ms is -1"]),
                                 (["run", crowd, "--out", self.folder, "--single", "--dry"],
                                  ["users has 3 manipulators, but the scene has 2 tools"])]:
            with self.subTest(arguments=arguments):
                self.assert_setup_error(run("tandem-lab", *arguments), "tandem-lab: ", *words)

    def test_of_the_smallest_client(self):
        for port in ("0", "65536", "-1", "47800x", ""):
            with self.subTest(port=port):
                self.assert_setup_error(run("01_smallest_client", port), "01_smallest_client: ", f"'{port}'", "65535")


class Join(ProgramTest):
    def test_prints_a_row_for_each_line_and_each_way_to_get_the_assets(self):
        experiment = self.write("e.json", json.dumps({"name": "e", "scene": "free", "duration_s": 0.2,
                                                      "users": [{"name": "a", "hand": "rest"}]}))
        code, out, err = run("tandem-lab", "bench", "join", "--experiment", experiment, "--rate-mbit", "10", "5", "--loss",
                             "0", "--json")
        self.assertEqual(code, 0, err)
        lines = json.loads(out)["lines"]
        self.assertEqual([line["rate_mbit_per_s"] for line in lines], [10, 5])
        for line in lines:
            self.assertEqual([way["assets"] for way in line["ways"]], ["here", "fetched", "fetched-in-turn"])
            for way in line["ways"]:
                self.assertLess(way["local_after_s"], 0.2, "there is nothing to fetch")


class Goals(ProgramTest):
    def test_measures_a_room_with_and_without_its_game(self):
        code, out, err = run("tandem-lab", "bench", "goals", "--seconds", "0.5", "--json")
        self.assertEqual(code, 0, err)
        result = json.loads(out)
        self.assertEqual(result["steps"], 500)
        for room in ("with_game_us", "without_game_us"):
            self.assertGreater(result[room]["p50"], 0)


class Study(ProgramTest):
    def run_study(self, *settings):
        experiment = self.write("e.json", json.dumps({"name": "e", "scene": "free", "duration_s": 0.2,
                                                      "users": [{"name": "a", "hand": "rest"}]}))
        return run("tandem-lab", "run", experiment, "--single", "--out", self.folder, *settings)

    def test_says_which_trials_of_the_folder_its_results_are_without(self):
        code, _, err = self.run_study()
        self.assertEqual(code, 0, err)
        self.assertNotIn("earlier runs", err)
        code, _, err = self.run_study("--set", "link.rtt_ms=10")
        self.assertEqual(code, 0, err)
        self.assertIn("keeps 1 trial of earlier runs", err)

    def test_says_why_a_user_did_not_join(self):
        code, out, err = self.run_study("--stage", "god-object", "--set", "law=direct")
        self.assertEqual(code, 1, err)
        self.assertIn("not-joined", out)
        self.assertIn("not joined: ", err)
        self.assertIn("direct", err)


class Meshes(ProgramTest):
    # A plate of 100 × 80 × 5 (no unit) with 12 triangles.
    PLATE = "".join(f"v {x} {y} {z}\n" for z in (0, 5) for y in (0, 80) for x in (0, 100)) + "".join(
        f"f {a} {b} {d}\nf {a} {d} {c}\n" for a, b, c, d in ((1, 3, 2, 4), (5, 6, 7, 8), (1, 2, 5, 6), (3, 7, 4, 8), (1, 5, 3, 7), (2, 4, 6, 8)))

    def test_a_file_is_described_with_its_own_size_and_the_one_that_it_is_scaled_to(self):
        file = self.write("plate.obj", self.PLATE)
        code, out, err = run("tandem-lab", "mesh", file, "--largest-size", "0.05", "--picture", self.path("p.png"))
        self.assertEqual(code, 0, err)
        for words in ("plate.obj: 100 x 80 x 5 units in the file, here 50 x 40 x 2.5 mm (a unit is 0.0005 m: --scale or --largest-size)",
                      "a solid of 12 triangles: closed, 5 cm³", "volume 5 cm³, watertight", "thinnest wall 2.5 mm"):
            self.assertIn(words, out)
        self.assertEqual(err, "")
        code, out, err = run("tandem-lab", "mesh", file, "--json")
        self.assertEqual(code, 0, err)
        (facts,) = json.loads(out)
        self.assertEqual([facts["scale_m"], facts["size_units"], facts["size_m"]], [1, [100, 80, 5], [100, 80, 5]])
        self.assertAlmostEqual(facts["thinnest_wall_m"], 5)

    def test_a_files_own_size_is_the_default_and_a_doubtful_one_is_reported_with_its_option(self):
        metres = "".join("v " + " ".join(str(float(x) / 1000) for x in line.split()[1:]) + "\n" if line[0] == "v" else line + "\n"
                         for line in self.PLATE.splitlines())
        code, out, err = run("tandem-lab", "mesh", self.write("metres.obj", metres))
        self.assertEqual([code, err], [0, ""])
        self.assertIn("0.1 x 0.08 x 0.005 units in the file, here 100 x 80 x 5 mm (a unit is 1 m", out)
        file = self.write("plate.obj", self.PLATE)
        code, out, err = run("tandem-lab", "mesh", file, "--json")
        self.assertEqual(code, 0, err)
        doubt = "100 m large, if a unit of the file is 1 m: is that right? Else give --scale (0.001 if the file is in millimetres) or --largest-size"
        self.assertEqual(err, f"{file}: warning: {doubt}\n")
        self.assertEqual(json.loads(out)[0]["doubt"], doubt)
        code, out, err = run("tandem-lab", "mesh", file, "--scale", "0.001", "--json")
        self.assertEqual([code, err], [0, ""])
        (facts,) = json.loads(out)
        self.assertEqual([facts["scale_m"], facts["doubt"]], [0.001, ""])
        for size, expected in zip(facts["size_m"], (0.1, 0.08, 0.005)):
            self.assertAlmostEqual(size, expected)

    def test_parts_that_overlap_are_said_to_count_twice(self):
        half = self.PLATE.replace("v 0 ", "v 50 ").replace("v 100 ", "v 120 ")
        beside = self.PLATE.replace("v 100 ", "v 250 ").replace("v 0 ", "v 150 ")
        for other, is_told in ((half, True), (beside, False)):
            second = "".join("f " + " ".join(str(int(i) + 8) for i in line.split()[1:]) + "\n" if line[0] == "f" else line + "\n"
                             for line in other.splitlines())
            code, out, err = run("tandem-lab", "mesh", self.write("two.obj", self.PLATE + second))
            self.assertEqual(code, 0, err)
            self.assertEqual("(overlaps count twice)" in out, is_told, out)

    def test_a_folders_json_is_json_alone(self):
        self.write("plate.obj", self.PLATE)
        self.write("none.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")
        code, out, err = run("tandem-lab", "mesh", "--all", self.folder, "--json")
        self.assertEqual(code, 0, err)
        found = json.loads(out)
        self.assertIn({"format": "obj", "loaded": 1, "refused": 1}, found["formats"])
        self.assertRegex(found["refusals"][0], "none.obj, which has no triangle")


class Help(ProgramTest):
    def test_names_the_program_without_its_path_and_its_exit_codes(self):
        for name in ("tandem-server", "tandem-client", "tandem-lab"):
            with self.subTest(program=name):
                code, out, _ = run(name, "--help")
                self.assertEqual(code, 0)
                self.assertIn(f"Usage: {name} ", out)
                self.assertIn("Exit code: 0 done", out)


if __name__ == "__main__":
    unittest.main()
