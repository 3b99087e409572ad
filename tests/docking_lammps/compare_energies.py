#!/usr/bin/env python3
"""Compares `tandem-lab energy` with LAMMPS and GROMACS for three real pairs, including charges and built hydrogens.

LAMMPS receives our positions and parameters. GROMACS reads the structures with its own pdb2gmx, so that hydrogens,
types and charges are also compared. Exit code 0: all results are within the bounds; 1: one is not, or an engine or a
structure is not installed. With --golden it writes the results of the engines for
tests/server/assets/structures/energy_test.cpp.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile

from compare_with_lammps import KJ_PER_KCAL, Check, needs, norm, subtract

PAIRS = {
    "3al1": ("/usr/share/pymol/test/dat/3al1.pdb", "A", "B"),
    "1hpv": ("/usr/share/pymol/data/tut/1hpv.pdb", "A", "B"),
    "1tii": ("/usr/share/pymol/data/demo/1tii.pdb", "D", "E"),
}
LJ_BOUND = 1e-8
COULOMB_BOUND = 1e-7
FORCE_BOUND = 1e-6  # relative to the largest force

PARAMETERS = "/usr/share/gromacs/top"
OPLS = "oplsaa"
MIXING = {OPLS: "geometric", "amber99sb": "arithmetic", "charmm27": "arithmetic"}

STYLES = {
    "1": ("lj/cut/coul/cut 300.0 300.0", "", 1),
    "4r": ("lj/charmm/coul/charmm/implicit 298.0 299.0", " {epsilon!r} {sigma!r}", 4),
}

IN_FILE = """\
units real
atom_style full
boundary f f f
dielectric {permittivity}
read_data pair.data
pair_style {style}
pair_modify mix {mixing}
{coefficients}
group A molecule 1
group B molecule 2
neighbor 2.0 bin
neigh_modify exclude group A A exclude group B B one 20000 page 400000
comm_modify cutoff 310.0
compute lj all pair {name} evdwl
compute coulomb all pair {name} ecoul
thermo_style custom step c_lj c_coulomb
thermo_modify norm no format float %.17g
dump forces all custom 1 forces.txt id fx fy fz
dump_modify forces sort id format float %.17g
run 0
"""

MDP = """\
integrator = md
nsteps = 0
cutoff-scheme = Verlet
verlet-buffer-tolerance = -1
rlist = 12.0
rcoulomb = 12.0
rvdw = 12.0
coulombtype = Cut-off
coulomb-modifier = None
vdwtype = Cut-off
vdw-modifier = None
epsilon-r = 1
epsilon-rf = 1
DispCorr = no
nstenergy = 1
energygrps = chA chB
"""


def tandem(lab, receptor, ligand, hydrogens, dielectric, force_field=OPLS):
    command = [lab, "energy", "--receptor", receptor, "--ligand", ligand, "--hydrogens", hydrogens, "--dielectric",
               dielectric, "--force-field", f"{PARAMETERS}/{force_field}.ff", "--atoms", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def run_lammps(lammps, ours, dielectric, mixing="geometric"):
    """Returns the Lennard-Jones and Coulomb energy [kJ/mol] and the force on each atom [kJ/mol/Å]. The atoms of the
    receptor come first."""
    style, more, permittivity = STYLES[dielectric]
    atoms = [(1, atom) for atom in ours["receptor_atoms"]] + [(2, atom) for atom in ours["ligand_atoms"]]
    types = sorted({(atom["sigma_angstrom"], atom["epsilon_kj_mol"]) for _, atom in atoms})
    low, high = -500, 500
    data = ["two molecules\n", f"{len(atoms)} atoms", f"{len(types)} atom types\n"]
    data += [f"{low} {high} {axis}lo {axis}hi" for axis in "xyz"]
    data += ["\nMasses\n"] + [f"{t + 1} 12.0" for t in range(len(types))] + ["\nAtoms # full\n"]
    for i, (molecule, atom) in enumerate(atoms):
        kind = types.index((atom["sigma_angstrom"], atom["epsilon_kj_mol"])) + 1
        data.append(f"{i + 1} {molecule} {kind} {atom['charge_e']!r} " + " ".join(map(repr, atom["position_angstrom"])))
    coefficients = []
    for t, (sigma, epsilon_kj) in enumerate(types):
        epsilon = epsilon_kj / KJ_PER_KCAL
        coefficients.append(f"pair_coeff {t + 1} {t + 1} {epsilon!r} {sigma!r}" +
                            more.format(epsilon=epsilon, sigma=sigma))
    in_file = IN_FILE.format(style=style, name=style.split()[0], permittivity=permittivity,
                             mixing=mixing, coefficients="\n".join(coefficients))
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("pair.data", "\n".join(data) + "\n"), ("pair.in", in_file)):
            with open(os.path.join(folder, name), "w", encoding="ascii") as file:
                file.write(text)
        run = subprocess.run([lammps, "-in", "pair.in", "-log", "none"], cwd=folder, capture_output=True, text=True,
                             env=dict(os.environ, OMP_NUM_THREADS="1"), check=False)
        if run.returncode != 0:
            sys.exit(f"{lammps} failed:\n{run.stdout}{run.stderr}")
        with open(os.path.join(folder, "forces.txt"), encoding="ascii") as file:
            rows = file.read().split("ITEM: ATOMS id fx fy fz\n")[1].splitlines()
    lines = run.stdout.splitlines()
    header = next(i for i, line in enumerate(lines) if line.split() == ["Step", "c_lj", "c_coulomb"])
    lj, coulomb = (float(word) * KJ_PER_KCAL for word in lines[header + 1].split()[1:])
    return lj, coulomb, [[float(word) * KJ_PER_KCAL for word in row.split()[1:]] for row in rows]


def run_tool(folder, *command):
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False,
                         env=dict(os.environ, OMP_NUM_THREADS="1"))
    if run.returncode != 0:
        sys.exit(f"{' '.join(command)} failed:\n{run.stdout}{run.stderr}")


def run_gromacs(folder, structure, chains, force_field):
    """Returns the Lennard-Jones and Coulomb energy [kJ/mol] of two chains with GROMACS's own hydrogens, types and
    charges, and the structure file that GROMACS created."""
    with open(structure, encoding="ascii") as file:
        kept = [line for line in file if line.startswith("ATOM") and line[21] in chains or line.startswith("TER")]
    with open(os.path.join(folder, "pair.pdb"), "w", encoding="ascii") as file:
        file.writelines(kept)
    run_tool(folder, "gmx_d", "pdb2gmx", "-f", "pair.pdb", "-ff", force_field, "-water", "none", "-ignh", "-o", "built.pdb",
             "-p", "pair.top")
    with open(os.path.join(folder, "built.pdb"), encoding="ascii") as file:
        atoms = [line for line in file if line.startswith("ATOM")]
    with open(os.path.join(folder, "boxed.pdb"), "w", encoding="ascii") as file:
        file.write("CRYST1  400.000  400.000  400.000  90.00  90.00  90.00 P 1           1\n")
        file.writelines(atoms + ["END\n"])
    with open(os.path.join(folder, "pair.ndx"), "w", encoding="ascii") as file:
        file.write("[ System ]\n" + "\n".join(str(i + 1) for i in range(len(atoms))) + "\n")
        for group, chain in zip(("chA", "chB"), chains):
            file.write(f"[ {group} ]\n" + "\n".join(str(i + 1) for i, a in enumerate(atoms) if a[21] == chain) + "\n")
    with open(os.path.join(folder, "sp.mdp"), "w", encoding="ascii") as file:
        file.write(MDP)
    run_tool(folder, "gmx_d", "grompp", "-f", "sp.mdp", "-c", "boxed.pdb", "-p", "pair.top", "-n", "pair.ndx", "-o",
             "pair.tpr", "-maxwarn", "5")
    run_tool(folder, "gmx_d", "mdrun", "-s", "pair.tpr", "-deffnm", "run", "-ntmpi", "1", "-ntomp", "1", "-rerun",
             "boxed.pdb")
    terms = subprocess.run(["gmx_d", "energy", "-f", "run.edr", "-o", "terms.xvg", "-dp", "-xvg", "none"], cwd=folder,
                           input="LJ-SR:chA-chB\nCoul-SR:chA-chB\n\n", capture_output=True, text=True, check=True)
    assert "LJ-SR:chA-chB" in terms.stdout
    with open(os.path.join(folder, "terms.xvg"), encoding="ascii") as file:
        values = [float(word) for word in file.read().split()]
    coulomb, lj = values[1:3]  # the file lists Coulomb before Lennard-Jones
    if "Coul-SR:chA-chB" in terms.stdout and terms.stdout.index("LJ-SR:chA-chB") < terms.stdout.index("Coul-SR:chA-chB"):
        lj, coulomb = values[1:3]
    return lj, coulomb, os.path.join(folder, "boxed.pdb")


def relative(ours, theirs):
    return abs(ours - theirs) / abs(theirs)


def compare_forces(check, ours, forces):
    mine = [atom["force_kj_mol_angstrom"] for atom in ours["receptor_atoms"] + ours["ligand_atoms"]]
    largest = max(norm(force) for force in forces)
    check.within("force on each atom, of the largest", max(norm(subtract(a, b)) for a, b in zip(mine, forces)) / largest,
                 FORCE_BOUND)


def compare_with_lammps(check, arguments, name, force_field, golden):
    structure, *chains = PAIRS[name]
    for dielectric in STYLES:
        print(f"{name} {'-'.join(chains)}, {force_field}, built hydrogens, dielectric {dielectric}, LAMMPS")
        ours = tandem(arguments.lab, *(f"{structure}:{chain}" for chain in chains), "build", dielectric, force_field)
        assert ours["mixing"] == MIXING[force_field]
        lj, coulomb, forces = run_lammps(arguments.lammps, ours, dielectric, MIXING[force_field])
        check.within("Lennard-Jones", relative(ours["lj_kj_mol"], lj), LJ_BOUND)
        check.within("Coulomb", relative(ours["coulomb_kj_mol"], coulomb), COULOMB_BOUND)
        compare_forces(check, ours, forces)
        total = [math.fsum(f[k] for f in forces[len(ours["receptor_atoms"]):]) for k in range(3)]
        golden.append(f"{name} {structure} {' '.join(chains)} {force_field} {dielectric} {lj!r} {coulomb!r} " +
                      " ".join(map(repr, total)))


def compare_with_gromacs(check, arguments, name, force_field):
    structure, *chains = PAIRS[name]
    with tempfile.TemporaryDirectory() as folder:
        print(f"{name} {'-'.join(chains)}, {force_field}, GROMACS's hydrogens, types and charges")
        lj, coulomb, built = run_gromacs(folder, structure, chains, force_field)
        ours = tandem(arguments.lab, *(f"{built}:{chain}" for chain in chains), "given", "1", force_field)
        check.within("Lennard-Jones", relative(ours["lj_kj_mol"], lj), LJ_BOUND)
        check.within("Coulomb", relative(ours["coulomb_kj_mol"], coulomb), COULOMB_BOUND)


def has_rdtscp():
    """Returns whether the processor has the instruction rdtscp. Without it, GROMACS's mdrun ends at once."""
    with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
        return any(line.startswith("flags") and "rdtscp" in line.split() for line in file)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lab", required=True, help="the program tandem-lab")
    parser.add_argument("--lammps", default="lmp", help="LAMMPS's program")
    parser.add_argument("--golden", help="write LAMMPS's results to this file")
    arguments = parser.parse_args()
    needs.programs(arguments.lammps, "gmx_d")
    needs.files(PARAMETERS, *(path for path, *_ in PAIRS.values()))
    check = Check()
    golden = ["# Pair, file, chains, force field, dielectric; Lennard-Jones and Coulomb energy [kJ/mol]; force on the second chain",
              "# [kJ/mol/Å]: LAMMPS's, hydrogens built. Written by tests/docking_lammps/compare_energies.py."]
    for name in PAIRS:
        compare_with_lammps(check, arguments, name, OPLS, golden)
    compare_with_lammps(check, arguments, "3al1", "amber99sb", golden)
    if needs.has_of_machine(has_rdtscp(), "the instruction rdtscp, without which Debian's gmx_d does not run"):
        for force_field in MIXING:
            for name in PAIRS:
                compare_with_gromacs(check, arguments, name, force_field)
    if arguments.golden and not check.failed:
        with open(arguments.golden, "w", encoding="utf-8") as file:
            file.write("\n".join(golden) + "\n")
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
