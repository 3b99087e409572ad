#!/usr/bin/env python3
"""Compares our Lennard-Jones kernels with LAMMPS for the same positions and parameters.

molecule_dump loads the pair and prints positions, parameters and our results. This script writes them as input for
LAMMPS, runs `lmp`, and compares the energy and the force on every atom. Exit code 0: all results are within the bounds;
1: one is not, or LAMMPS or the structure is not installed. With --golden it writes LAMMPS's results for
tests/common/docking/molecule_lammps_test.cpp.
"""

import argparse
import math
import os
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import needs  # noqa: E402  (found by the path above)

KJ_PER_KCAL = 4.184

# Pose of chain B in the frame of chain A: x y z [Å], qw qx qy qz. The quaternion is normalised when it is read.
POSES = {
    "native": (0, 0, 0, 1, 0, 0, 0),
    "apart": (0.54, 1.92, 0.08, 1, 0, 0, 0),
    "turned, near contact": (-1.1, 4.7, 3.0, 0.9, 0.3, -0.2, 0.25),
    "turned, overlapping": (-1.4, 3.8, 3.0, 0.9, 0.3, -0.2, 0.25),
}

# Poses in the golden file. Two suffice for a test and keep the file small.
GOLDEN_POSES = ("native", "turned, near contact")

# Bounds for the double-precision kernel: relative errors of the energy and of the force on each atom, compared with
# LAMMPS. The reference is at least 1e-6 of the largest force, because the pair forces on an atom may cancel.
EXACT_BOUND = 1e-8
CANCELLATION_FLOOR = 1e-6
# Bound for the single-precision kernels: relative error of the energy, error of a force relative to the largest force
# on an atom, and error of the torque relative to that force times the distance of the farthest atom.
FLOAT_BOUND = 1e-5

IN_FILE = """\
units real
atom_style atomic
boundary f f f
read_data pair.data
pair_style lj/cut 200.0
pair_modify mix geometric shift no
{coefficients}
group A id <= {count_a}
group B id > {count_a}
neighbor 2.0 bin
neigh_modify exclude group A A exclude group B B one 20000 page 400000
comm_modify cutoff 210.0
compute between B group/group A
thermo_style custom step c_between
thermo_modify format float %.17g
dump forces all custom 1 forces.txt id fx fy fz
dump_modify forces sort id format float %.17g
run 0
"""


class Atom:
    def __init__(self, words):
        values = [float(word) for word in words]
        self.position = values[0:3]
        self.sigma, self.epsilon = values[3:5]
        self.force = values[5:8]


def dump_pair(arguments, pose):
    command = [arguments.dump, arguments.structure, "A", "B", arguments.force_field]
    output = subprocess.run(command + [repr(value) for value in pose], check=True, capture_output=True, text=True)
    atoms = {"A": [], "B": []}
    results = {}
    for line in output.stdout.splitlines():
        words = line.split()
        if words[0] == "atom":
            atoms[words[1]].append(Atom(words[2:]))
        else:
            results[words[1]] = [float(word) for word in words[2:]]
    return atoms, results


def lammps_files(atoms):
    every = atoms["A"] + atoms["B"]
    types = sorted({(atom.sigma, atom.epsilon) for atom in every})
    limits = [(min(a.position[k] for a in every) - 10, max(a.position[k] for a in every) + 10) for k in range(3)]
    data = ["two molecules\n", f"{len(every)} atoms", f"{len(types)} atom types\n"]
    data += [f"{low!r} {high!r} {axis}lo {axis}hi" for (low, high), axis in zip(limits, "xyz")]
    data += ["\nMasses\n"] + [f"{t + 1} 12.0" for t in range(len(types))] + ["\nAtoms # atomic\n"]
    for i, atom in enumerate(every):
        data.append(f"{i + 1} {types.index((atom.sigma, atom.epsilon)) + 1} " + " ".join(map(repr, atom.position)))
    coefficients = [f"pair_coeff {t + 1} {t + 1} {epsilon / KJ_PER_KCAL!r} {sigma!r}"
                    for t, (sigma, epsilon) in enumerate(types)]
    in_file = IN_FILE.format(coefficients="\n".join(coefficients), count_a=len(atoms["A"]))
    return "\n".join(data) + "\n", in_file


def energy_in_log(log):
    lines = log.splitlines()
    header = next(i for i, line in enumerate(lines) if line.split() == ["Step", "c_between"])
    return float(lines[header + 1].split()[1]) * KJ_PER_KCAL


def run_lammps(lammps, atoms):
    """Returns the energy [kJ/mol] and the force on each atom [kJ/mol/Å]. The atoms of A come first."""
    data, in_file = lammps_files(atoms)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("pair.data", data), ("pair.in", in_file)):
            with open(os.path.join(folder, name), "w", encoding="ascii") as file:
                file.write(text)
        environment = dict(os.environ, OMP_NUM_THREADS="1")
        run = subprocess.run([lammps, "-in", "pair.in", "-log", "none"], cwd=folder, capture_output=True, text=True,
                             env=environment, check=False)
        if run.returncode != 0:
            sys.exit(f"{lammps} failed:\n{run.stdout}{run.stderr}")
        with open(os.path.join(folder, "forces.txt"), encoding="ascii") as file:
            rows = file.read().split("ITEM: ATOMS id fx fy fz\n")[1].splitlines()
    forces = [[float(word) * KJ_PER_KCAL for word in row.split()[1:]] for row in rows]
    return energy_in_log(run.stdout), forces


def subtract(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(vector):
    return math.sqrt(math.fsum(x * x for x in vector))


def total(vectors):
    return [math.fsum(vector[k] for vector in vectors) for k in range(3)]


class Check:
    """Prints each comparison and records whether one has failed."""

    def __init__(self):
        self.failed = False

    def within(self, what, error, bound):
        verdict = "ok" if error <= bound else "FAILED"
        self.failed = self.failed or error > bound
        print(f"  {what:<42} {error:9.2e}  (bound {bound:.0e})  {verdict}")


def compare(check, pose, atoms, results, energy, forces):
    every = atoms["A"] + atoms["B"]
    largest = max(norm(force) for force in forces)
    print(f"  energy {energy:.12g} kJ/mol, largest atom force {largest:.6g} kJ/mol/Å")
    check.within("double: energy, relative", abs(results["exact"][0] - energy) / abs(energy), EXACT_BOUND)
    errors = [norm(subtract(atom.force, force)) / max(norm(force), CANCELLATION_FLOOR * largest)
              for atom, force in zip(every, forces)]
    check.within("double: worst atom force, relative", max(errors), EXACT_BOUND)
    on_b = forces[len(atoms["A"]):]
    arms = [subtract(atom.position, pose[:3]) for atom in atoms["B"]]
    force, torque = total(on_b), total([cross(arm, f) for arm, f in zip(arms, on_b)])
    reach = max(norm(arm) for arm in arms)
    for kernel, result in results.items():
        if kernel == "exact":
            continue
        check.within(f"{kernel}: energy, relative", abs(result[0] - energy) / abs(energy), FLOAT_BOUND)
        check.within(f"{kernel}: force, of largest atom's", norm(subtract(result[1:4], force)) / largest, FLOAT_BOUND)
        check.within(f"{kernel}: torque, of that and reach", norm(subtract(result[4:7], torque)) / largest / reach,
                     FLOAT_BOUND)


def golden_block(name, pose, energy, forces):
    lines = [f"pose {name}", " ".join(map(repr, pose)), f"{energy:.15g}"]
    lines += [" ".join(f"{x:.12g}" for x in force) for force in forces]
    return "\n".join(lines) + "\n"


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dump", required=True, help="the built molecule_dump")
    parser.add_argument("--lammps", default="lmp", help="LAMMPS program")
    parser.add_argument("--structure", default="/usr/share/pymol/test/dat/3al1.pdb")
    parser.add_argument("--force-field", default="/usr/share/gromacs/top/oplsaa.ff")
    parser.add_argument("--golden", metavar="FILE", help="also write LAMMPS's results here")
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    needs.programs(arguments.lammps)
    needs.files(arguments.structure, arguments.force_field)
    check = Check()
    golden = "# LAMMPS, pair of 3al1.pdb chains A and B: pose of B [Å, qw qx qy qz], energy [kJ/mol], then the force on\n"
    golden += "# each atom of A and of B [kJ/mol/Å]. Written by tests/docking_lammps/compare_with_lammps.py.\n"
    for name, pose in POSES.items():
        print(f"pose '{name}'")
        atoms, results = dump_pair(arguments, pose)
        energy, forces = run_lammps(arguments.lammps, atoms)
        compare(check, pose, atoms, results, energy, forces)
        if name in GOLDEN_POSES:
            golden += golden_block(name, pose, energy, forces)
    if arguments.golden and not check.failed:
        with open(arguments.golden, "w", encoding="utf-8") as file:
            file.write(golden)
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
