// A docking scene made from two structure files, for users without a scene file.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Builds a scene in which one tool holds the receptor and one the ligand. Their relative orientation is that of the
/// files. Along the line of centres they are moved apart to a gap of 8 Å. Open settings get these values:
///
///   hydrogens     as given; built where a file has none
///   charges       ε = 4r
///   pairs         all up to a million; above that choose_field() decides, whichever molecule is the receptor
///   zero area     1 kT up to a million pairs
///   force scale   the strongest pull is 1 N
///   length scale  10 mm for 1 Å, less where the larger radius of gyration would exceed 80 mm
///
/// In      receptor, ligand  absolute file, chains, hydrogens
/// Out     a scene to be written to a file; complete_and_check() has not been called
/// Fails   docking::MoleculeError, see load_molecule(); std::invalid_argument: dielectric or cut-off, see
///         docking::validate()
wire::Scene docking_scene(wire::MoleculeSource receptor, wire::MoleculeSource ligand,
                          const wire::MolecularField& field);

/// Parses "FILE:A,B/478" (structure_choice()) and makes the path absolute. With empty `hydrogens` docking_scene()
/// chooses.
wire::MoleculeSource molecule_source(const std::string& text, const std::string& hydrogens);

/// Text of a scene file: JSON with the fields that are set.
std::string scene_text(const wire::Scene& scene);

}  // namespace tandem::server
