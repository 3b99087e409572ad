// A scene of two structure files, for who has no scene file of his own.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Receptor and ligand in a hand each, as their files have them to each other, but drawn 8 Å apart along the line of their
/// centres. What is left open is chosen: hydrogens as given, or built where a file has none; charges with ε = 4r; all pairs
/// up to a million, and above that what choose_field() chooses, whichever is the receptor; a zero area of 1 kT up to a million;
/// forces so large that the strongest pull is 1 N; 10 mm for 1 Å, less where that makes the larger one's radius of gyration
/// more than 80 mm.
///
/// In      receptor, ligand  absolute file, chains, hydrogens
/// Out     a scene to be written to a file (complete_and_check() has not been called)
/// Fails   docking::MoleculeError, see load_molecule(); std::invalid_argument: dielectric or cut-off, see
///         docking::validate()
wire::Scene docking_scene(wire::MoleculeSource receptor, wire::MoleculeSource ligand,
                          const wire::MolecularField& field);

/// Of "FILE:A,B/478" (structure_choice()), the file's path absolute. `hydrogens` empty: docking_scene() chooses.
wire::MoleculeSource molecule_source(const std::string& text, const std::string& hydrogens);

/// As scene files are written: JSON, with the fields that are set.
std::string scene_text(const wire::Scene& scene);

}  // namespace tandem::server
