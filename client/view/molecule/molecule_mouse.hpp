// The mouse over molecules: the atom under it, clicks, and the texts about them.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "client/view/molecule/residue_selection.hpp"

namespace tandem::client {

/// What the panel shows about atoms and residues.
struct MoleculeContent {
  ResidueSelection* selection = nullptr;  ///< null: the scene has no molecules
  const DrawnScene* scene = nullptr;
  std::string* problem = nullptr;  ///< why the last typed range was not selected
  std::string under_mouse{};       ///< "": nothing
  std::string distance{};          ///< distance of the two picked atoms; "": there are not two
};

/// Bodies of a frame, and the ray of the mouse.
struct MoleculeFrame {
  const DrawnScene& scene;
  std::span<const Pose> X_WB;
  double metres_per_angstrom = 1;
  Vec3 from_W = Vec3::Zero(), along_W = Vec3::UnitX();
  bool is_free = false;   ///< the mouse is over the scene and holds nothing
  bool is_click = false;  ///< the left button was pressed and released without motion
};

/// Thread  the window's
class MoleculeMouse {
 public:
  /// Evaluates a frame of a scene with molecules.
  void follow(const MoleculeFrame& frame);
  /// Removes the selection.
  void clear();
  /// Removes the selection if it belongs to another scene.
  void belong_to(const void* scene);

  const ResidueSelection& selection() const { return selection_; }
  const std::optional<AtomDistance>& distance() const { return distance_; }
  /// Content of the panel for this frame.
  MoleculeContent content(const DrawnScene& scene);

 private:
  ResidueSelection selection_;
  std::optional<AtomPlace> under_mouse_;
  std::optional<AtomDistance> distance_;
  std::string problem_;
};

}  // namespace tandem::client
