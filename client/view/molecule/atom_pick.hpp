// The atom under the mouse, and its name for the user. No display is needed.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "client/view/drawn_scene.hpp"

namespace tandem::client {

/// An atom of a scene: indices of the body, and of the atom in its molecule.
struct AtomPlace {
  std::size_t body = 0, atom = 0;

  auto operator<=>(const AtomPlace&) const = default;
};

/// Returns the molecule of an atom; null if the scene has no such atom.
const docking::Molecule* molecule_at(const DrawnScene& scene, const AtomPlace& place);

/// Returns the first atom on a ray, by the van der Waals balls of the atoms, whatever the style in which they are drawn.
/// In      X_WB   one for each body
///         cut_W  cutting plane, as in DrawnFrame: the ray begins at it, so that atoms cut away are not found
/// Cost    O(atoms)
std::optional<AtomPlace> first_atom(const DrawnScene& scene, std::span<const Pose> X_WB, double metres_per_angstrom,
                                    const Vec3& from_W, const Vec3& along_W,
                                    const std::optional<Eigen::Hyperplane<double, 3>>& cut_W = std::nullopt);

/// Returns the residue of an atom for the user, such as "GLU 12A of chain B"; "atom 17" if the file gives no names.
std::string residue_text(const docking::Molecule& molecule, std::size_t atom);
/// The same with the name of the atom: "GLU 12A of chain B, atom CA".
std::string atom_text(const docking::Molecule& molecule, std::size_t atom);
/// The same in short: "B:GLU 12A CA".
std::string short_atom_text(const docking::Molecule& molecule, std::size_t atom);

}  // namespace tandem::client
