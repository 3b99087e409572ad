// Residues and atoms of molecules that this user has selected. Other users do not see the selection. No display is
// needed.
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/view/molecule/atom_pick.hpp"

namespace tandem::client {

/// Distance between two picked atoms.
struct AtomDistance {
  Vec3 from_W = Vec3::Zero(), to_W = Vec3::Zero();
  double angstrom = 0;
};

/// Thread  the one that runs the window
class ResidueSelection {
 public:
  static constexpr std::size_t kMaxResidues = 10'000;

  /// Clears the selection if it was made in different molecules.
  /// In      molecules  text that identifies the molecules of the scene
  void belong_to(const std::string& molecules);
  void clear();
  /// Handles a click on an atom: selects the residue of the atom, and picks the atom for a distance. A second click on
  /// the same atom undoes both.
  void click(const DrawnScene& scene, const AtomPlace& place);
  /// Replaces the selection by the residues of a text such as "A:10-25", and picks no atom. Returns "" if this has
  /// succeeded, otherwise the reason why not, with the remedy.
  std::string select(const DrawnScene& scene, std::string_view text);

  /// Returns the selected residues, each by its first atom; at most kMaxResidues.
  const std::set<AtomPlace>& residues() const { return residues_; }
  /// Returns the picked atoms: the last two on which the user has clicked, or fewer.
  const std::vector<AtomPlace>& picked() const { return picked_; }
  bool is_empty() const { return residues_.empty() && picked_.empty(); }
  /// Returns the distance between the two picked atoms; empty if fewer than two are picked.
  /// In      X_WB  poses of the bodies, in their order in the scene
  std::optional<AtomDistance> distance(const DrawnScene& scene, std::span<const Pose> X_WB,
                                       double metres_per_angstrom) const;

 private:
  std::string molecules_;
  std::set<AtomPlace> residues_;
  std::vector<AtomPlace> picked_;
};

/// Returns the first atom of the residue to which an atom belongs; the atom itself if the molecule has no residues.
std::size_t residue_start(const docking::Molecule& molecule, std::size_t atom);
/// Returns the index after the last atom of the residue that begins with `start`.
std::size_t residue_end(const docking::Molecule& molecule, std::size_t start);

}  // namespace tandem::client
