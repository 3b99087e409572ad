// Finds the atom under the mouse, and its name as text for the user. No display is needed.
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

/// Returns the first atom that a ray hits. Each atom is a ball of its van der Waals radius, even if it is drawn in a
/// different style.
/// In      X_WB   one for each body
///         cut_W  cutting plane, as in DrawnFrame. The ray begins at this plane, so that hidden atoms are not found
/// Cost    O(atoms)
std::optional<AtomPlace> first_atom(const DrawnScene& scene, std::span<const Pose> X_WB, double metres_per_angstrom,
                                    const Vec3& from_W, const Vec3& along_W,
                                    const std::optional<Eigen::Hyperplane<double, 3>>& cut_W = std::nullopt);

/// Returns the residue of an atom as text, such as "GLU 12A of chain B". If the file has no names, returns "atom 17".
std::string residue_text(const docking::Molecule& molecule, std::size_t atom);
/// Returns residue and atom as text: "GLU 12A of chain B, atom CA".
std::string atom_text(const docking::Molecule& molecule, std::size_t atom);
/// Returns residue and atom as short text: "B:GLU 12A CA".
std::string short_atom_text(const docking::Molecule& molecule, std::size_t atom);

}  // namespace tandem::client
