// Makes a docking scene from two structure files, so that users need no scene file.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Makes a scene with two tools: one holds the receptor, the other the ligand. Their relative orientation is that of
/// the files. They are moved apart along the line of centres to a gap of 8 Å. Settings that are not given in the
/// arguments get these values:
///
///   hydrogens     those of the file; if the file has none, they are built
///   dielectric    ε = 4r, where r is the distance of two atoms in Å
///   atom pairs    all pairs, if there are at most a million; otherwise choose_field() sets a cut-off
///   zero area     no force at energies less than 1 kT above the minimum; only for at most a million atom pairs
///   force scale   the strongest attraction becomes 1 N
///   length scale  10 mm for 1 Å; less if the larger radius of gyration would exceed 80 mm
///
/// In      receptor, ligand  absolute path, chains, hydrogens of each molecule
/// Out     the scene, for writing to a file; complete_and_check() has not been called for it
/// Fails   docking::MoleculeError, see load_molecule(); std::invalid_argument: dielectric or cut-off, see
///         docking::validate()
wire::Scene docking_scene(wire::MoleculeSource receptor, wire::MoleculeSource ligand,
                          const wire::MolecularField& field);

/// Parses "FILE:A,B/478" (structure_choice()) and makes the path absolute. If `hydrogens` is empty, docking_scene()
/// chooses them.
wire::MoleculeSource molecule_source(const std::string& text, const std::string& hydrogens);

/// Returns the text of a scene file: JSON with the fields that are set.
std::string scene_text(const wire::Scene& scene);

}  // namespace tandem::server
