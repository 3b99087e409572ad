#!/usr/bin/env python3
"""Audits how structure files are read: no atom is lost without a message, and types and charges are those of GROMACS.

The PDB, mmCIF, PQR and PDBQT files given, or found in the given folders, must satisfy these conditions:
  * The number of atoms loaded plus the number reported as left out equals the number of atoms in the file's first
    model, or the file is refused with a message that names it.
  * With hydrogens built, the net charge of each chain is an integer, or the report names residues.
  * For PDB files that GROMACS's pdb2gmx accepts, type and charge of each atom of each residue equal those of pdb2gmx,
    with the histidine states that pdb2gmx chose. Proteins use OPLS-AA, files with nucleic acids use amber99sb.
Exit code 0: all conditions hold; 1: one does not, or no file was compared with pdb2gmx. The output has one line for
each file; --failures prints only files with a difference.
"""

import argparse
import collections
import concurrent.futures
import gzip
import json
import os
import re
import subprocess
import sys
import tempfile

from compare_with_lammps import needs
from compare_energies import has_rdtscp

SUFFIXES = (".pdb", ".ent", ".cif", ".pqr", ".pdbqt", ".pdb1")
PARAMETERS = "/usr/share/gromacs/top"
PROTEIN, NUCLEIC = "oplsaa", "amber99sb"
NUCLEOTIDES = set("A C G T U DA DC DG DT DU".split())
AMINO_ACIDS = set("ALA ARG ASN ASP CYS GLN GLU GLY HIS ILE LEU LYS MET PHE PRO SER THR TRP TYR VAL".split())
PROBE = "HETATM    1 AR    AR Z   1     900.000 900.000 900.000  1.00  0.00          AR\nEND\n"
CHARGE_BOUND = 1e-9


def text_of(path):
    with open(path, "rb") as file:
        data = file.read()
    if data[:2] == b"\x1f\x8b":
        data = gzip.decompress(data)
    return data.decode("latin-1")


def kind_of(path, text):
    name = path[:-3] if path.endswith(".gz") else path
    if name.endswith((".pqr", ".pdbqt")):
        return "pqr"
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return "cif" if first.lower().startswith("data_") else "pdb"


def pdb_atoms(text):
    """Returns the atom records of the first model."""
    atoms = []
    for line in text.splitlines():
        if line.startswith("ENDMDL") and atoms:
            break
        if line.startswith(("ATOM", "HETATM")):
            atoms.append(line)
    return atoms


def cif_count(text):
    """Returns the rows of _atom_site that belong to the first model. The file must have one line per row."""
    names, rows, inside = [], [], False
    for line in text.splitlines():
        key = line.strip().lower()
        if key.startswith("_atom_site."):
            names.append(key.split(".")[1].split()[0])
            inside = True
        elif inside and (key.startswith(("_", "#", "loop_", "data_")) or not key):
            break
        elif inside:
            rows.append(line.split())
    if "pdbx_pdb_model_num" not in names or not rows:
        return len(rows)
    model = names.index("pdbx_pdb_model_num")
    return sum(row[model] == rows[0][model] for row in rows)


def energy(lab, path, selection, hydrogens, probe, force_field=PROTEIN):
    command = [lab, "energy", "--receptor", path + selection, "--ligand", probe + ":/*", "--hydrogens", hydrogens,
               "--cutoff", "8", "--atoms", "--report", "--json", "--force-field", f"{PARAMETERS}/{force_field}.ff"]
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    if run.returncode != 0:
        return None, run.stderr.strip().splitlines()[-1]
    return json.loads(run.stdout), ""


def count_line(lab, path, text, probe):
    """Returns a description of the fate of a file's atoms, and whether it is correct."""
    read, refusal = energy(lab, path, ":/*", "given", probe)
    if read is None:
        return ("refused: " + refusal[:110], os.path.basename(path) in refusal, None)
    kind = kind_of(path, text)
    expected = cif_count(text) if kind == "cif" else len(pdb_atoms(text))
    dropped = len(read["receptor_report"]["dropped"])
    loaded = read["atoms_receptor"]
    rebuilt = any("missing ones built" in note for note in read["receptor_notes"])
    is_right = loaded + dropped == expected or (rebuilt and loaded + dropped > expected)
    return f"{loaded} loaded + {dropped} left out of {expected}", is_right, read


def charge_line(lab, path, probe):
    read, refusal = energy(lab, path, "", "build", probe)
    if read is None:
        return "no chains: " + refusal[:80], True
    charge = read["receptor_charge"]
    is_told = charge["is_whole"] or charge["not_whole"] or any("charge" in n for n in read["receptor_notes"])
    return f"{charge['net_e']:+.3g} e{'' if charge['is_whole'] else ' (named)'}", bool(is_told)


def polymer_lines(text):
    """Returns the amino acids and nucleotides of the first model, chain by chain. The first of alternate locations is
    used. The first nucleotide of a chain is returned without phosphate, because pdb2gmx has no block for it."""
    seen, lines, chain, first = set(), [], None, None
    for line in pdb_atoms(text):
        name, residue = line[12:16].strip(), line[17:20].strip()
        if residue not in AMINO_ACIDS | NUCLEOTIDES or line[20:21] not in (" ", ""):
            continue
        key = (line[21], line[22:27], name)
        if key in seen:
            continue
        seen.add(key)
        if chain != (line[21], residue in NUCLEOTIDES):
            if chain is not None:
                lines.append("TER")
            chain, first = (line[21], residue in NUCLEOTIDES), line[17:27]
        if residue in NUCLEOTIDES and line[17:27] == first and name in ("P", "O1P", "O2P", "OP1", "OP2", "O3P", "OP3"):
            continue
        lines.append(line[:16] + " " + line[17:])
    return lines


def lines_of_today(lines):
    """Converts names of nucleotides to those of pdb2gmx: DA for an A without O2', O5' for O5*."""
    names = collections.defaultdict(set)
    for line in lines:
        names[line[17:27]].add(line[12:16].strip().replace("*", "'"))
    changed = []
    for line in lines:
        residue = line[17:20].strip()
        if line != "TER" and residue in NUCLEOTIDES:
            if len(residue) == 1 and "C2'" in names[line[17:27]] and "O2'" not in names[line[17:27]]:
                residue = "D" + residue
            name = line[12:16].replace("*", "'").replace("C5M", "C7 ")
            line = line[:12] + name + line[16:17] + residue.rjust(3) + line[20:]
        changed.append(line)
    return changed


def topology_residues(path):
    """Returns (name of the block, sorted types and charges) in order. pdb2gmx has merged all chains into one molecule.
    """
    found, section = [], ""
    with open(path, encoding="ascii") as file:
        for line in file:
            if line.startswith("["):
                section = line.strip("[] \n")
            if section != "atoms":
                continue
            block = re.match(r"; residue\s+\S+\s+\S+\s+rtp\s+(\S+)", line)
            if block:
                found.append((block[1], []))
            elif line.strip() and line[0] not in ";[#":
                words = line.split()
                found[-1][1].append((words[1], float(words[6])))
    return [(block, sorted(atoms)) for block, atoms in found]


def read_residues(read):
    """Returns, in the order of the file, each residue's location with its sorted types and charges."""
    residues = collections.OrderedDict()
    for atom in read["receptor_atoms"]:
        place = atom["atom"].split(" of ", 1)[1]
        residues.setdefault(place, []).append((atom["type"], atom["charge_e"]))
    return [(place, sorted(atoms)) for place, atoms in residues.items()]


HISTIDINES = {"HISD": "HID", "HISE": "HIE", "HISH": "HIP", "HID": "HID", "HIE": "HIE", "HIP": "HIP"}


def is_whole(atoms):
    charge = sum(charge for _, charge in atoms)
    return abs(charge - round(charge)) < 1e-6


def gromacs_line(lab, text, probe):
    lines = polymer_lines(text)
    if not lines:
        return "no chains", True
    force_field = NUCLEIC if any(line[17:20].strip() in NUCLEOTIDES for line in lines) else PROTEIN
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "in.pdb"), "w", encoding="latin-1") as file:
            file.write("\n".join(lines_of_today(lines)) + "\nEND\n")
        run = subprocess.run(["gmx_d", "pdb2gmx", "-f", "in.pdb", "-ff", force_field, "-water", "none", "-ignh", "-o", "o.pdb",
                              "-p", "t.top", "-chainsep", "ter", "-merge", "all"], cwd=folder, capture_output=True, text=True, check=False)
        if run.returncode != 0:
            reason = re.search(r"Fatal error:\s*(.*)", run.stderr)
            return "pdb2gmx refuses: " + (reason[1] if reason else "?")[:80], True
        theirs = topology_residues(os.path.join(folder, "t.top"))
        # The residues are read again, with names for the histidine states that pdb2gmx chose.
        keys, renamed = {}, []
        for line in lines:
            if line == "TER":
                renamed.append(line)
                continue
            block = theirs[keys.setdefault(line[21:27], len(keys))][0]
            is_histidine = line[17:20] == "HIS"
            renamed.append(line[:17] + (HISTIDINES[block[-4:] if force_field == PROTEIN else block[-3:]] if is_histidine
                                        else line[17:20]) + line[20:])
        given = os.path.join(folder, "given.pdb")
        with open(given, "w", encoding="latin-1") as file:
            file.write("\n".join(renamed) + "\nEND\n")
        read, refusal = energy(lab, given, "", "build", probe, force_field)
        if read is None:
            return "refused: " + refusal[:100], False
    ours = read_residues(read)
    if len(ours) != len(theirs):
        return f"{len(ours)} residues in place of {len(theirs)}", False
    different, in_parts = [], 0
    for (place, mine), (block, other) in zip(ours, theirs):
        same = len(mine) == len(other) and all(a[0] == b[0] and abs(a[1] - b[1]) < CHARGE_BOUND for a, b in zip(mine, other))
        if not same and not is_whole(other) and is_whole(mine):
            # In a chain of one residue, pdb2gmx adds both chain ends instead of the entries for a zwitterion.
            in_parts += 1
        elif not same:
            different.append(f"{place} ({block})")
    atoms = sum(len(atoms) for _, atoms in theirs)
    if different:
        return f"{len(different)} of {len(theirs)} residues differ: " + ", ".join(different[:5]), False
    return f"{atoms} atoms as pdb2gmx's of {force_field}" + (f", but {in_parts} residues that it leaves a part of a charge" if in_parts else ""), True


def audit(arguments, path, probe):
    text = text_of(path)
    counted, is_counted, read = count_line(arguments.lab, path, text, probe)
    parts, is_right = [counted], is_counted
    if read is not None:
        charge, is_told = charge_line(arguments.lab, path, probe)
        parts.append(charge)
        is_right &= is_told
        if kind_of(path, text) == "pdb" and not arguments.without_gromacs:
            compared, is_same = gromacs_line(arguments.lab, text, probe)
            parts.append(compared)
            is_right &= is_same
    return is_right, "; ".join(parts)


def structure_files(arguments):
    for path in arguments.paths:
        if os.path.isfile(path):
            yield path
        for folder, _, names in sorted(os.walk(path)):
            for name in sorted(names):
                if (name[:-3] if name.endswith(".gz") else name).lower().endswith(SUFFIXES):
                    yield os.path.join(folder, name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lab", required=True, help="the program tandem-lab")
    parser.add_argument("--without-gromacs", action="store_true", help="do not compare with pdb2gmx")
    parser.add_argument("--failures", action="store_true", help="print only files with a difference")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="files at a time")
    parser.add_argument("paths", nargs="+", help="structure files, or folders of them")
    arguments = parser.parse_args()
    needs.files(PARAMETERS, *arguments.paths)
    if not arguments.without_gromacs:
        needs.programs("gmx_d")
        arguments.without_gromacs = not needs.has_of_machine(
            has_rdtscp(), "the instruction rdtscp, without which Debian's gmx_d does not run")
    failed = done = compared = 0
    with tempfile.TemporaryDirectory() as folder:
        probe = os.path.join(folder, "probe.pdb")
        with open(probe, "w", encoding="ascii") as file:
            file.write(PROBE)
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            paths = list(structure_files(arguments))
            for path, (is_right, text) in zip(paths, pool.map(lambda p: audit(arguments, p, probe), paths)):
                done += 1
                failed += not is_right
                compared += " atoms as pdb2gmx's" in text
                if not is_right or not arguments.failures:
                    print(f"{'ok  ' if is_right else 'FAIL'} {path}: {text}", flush=True)
    print(f"{done} files, {failed} with a difference, {compared} equal to pdb2gmx atom by atom")
    has_compared = compared > 0 or arguments.without_gromacs
    return 0 if done and not failed and has_compared else 1


if __name__ == "__main__":
    sys.exit(main())
