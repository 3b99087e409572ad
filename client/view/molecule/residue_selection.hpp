// Residues and atoms of molecules that the user has selected. They are seen by this user only. No display is needed.
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

/// Thread  the window's
class ResidueSelection {
 public:
  static constexpr std::size_t kMaxResidues = 10'000;

  /// Clears the selection if it belongs to another scene.
  /// In      scene  identifies the scene; it is compared only
  void belong_to(const void* scene);
  void clear();
  /// Selects the residue of an atom, and picks the atom for a distance. A second click on the atom takes both back.
  void click(const DrawnScene& scene, const AtomPlace& place);
  /// Selects the residues of a text such as "A:10-25" instead of the selected ones. Returns why not, with the remedy; ""
  /// if it has.
  std::string select(const DrawnScene& scene, std::string_view text);

  /// First atom of each selected residue, at most kMaxResidues.
  const std::set<AtomPlace>& residues() const { return residues_; }
  /// The last two picked atoms, or fewer.
  const std::vector<AtomPlace>& picked() const { return picked_; }
  bool is_empty() const { return residues_.empty() && picked_.empty(); }
  /// Distance between the two picked atoms; empty if there are not two.
  /// In      X_WB  one for each body
  std::optional<AtomDistance> distance(const DrawnScene& scene, std::span<const Pose> X_WB,
                                       double metres_per_angstrom) const;

 private:
  const void* scene_ = nullptr;
  std::set<AtomPlace> residues_;
  std::vector<AtomPlace> picked_;
};

/// Returns the first atom of the residue of an atom; the atom itself if the molecule has no residues.
std::size_t residue_start(const docking::Molecule& molecule, std::size_t atom);
/// Returns the atom behind the last one of the residue that begins with `start`.
std::size_t residue_end(const docking::Molecule& molecule, std::size_t start);

}  // namespace tandem::client
