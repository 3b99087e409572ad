// Handles the mouse over molecules: finds the atom under the mouse, selects by clicks, and provides texts for the
// panel.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "client/view/molecule/residue_selection.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// Content of the panel about atoms and residues.
struct MoleculeContent {
  ResidueSelection* selection = nullptr;  ///< the user's selection; null: the scene has no molecules
  const DrawnScene* scene = nullptr;
  std::string* problem = nullptr;  ///< reason why the range that was typed last was not selected
  std::string under_mouse{};       ///< name of the atom under the mouse; "": no atom
  std::string distance{};          ///< distance of the two picked atoms; "": fewer than two are picked
};

/// Input of one frame: bodies, ray of the mouse and clicks.
struct MoleculeFrame {
  const DrawnScene& scene;
  std::span<const Pose> X_WB;
  double metres_per_angstrom = 1;
  Vec3 from_W = Vec3::Zero(), along_W = Vec3::UnitX();
  bool is_free = false;   ///< true: the mouse is over the scene and drags nothing
  bool is_click = false;  ///< true: the left button was pressed and released without motion
  /// True: second press of a double click, which grabs a body. A double click selects nothing; the selection by its
  /// first click is undone.
  bool is_double_click = false;
  LocalTime now{};
  std::optional<Eigen::Hyperplane<double, 3>> cut_W{};  ///< cutting plane, see first_atom()
};

/// Thread  the one that runs the window
class MoleculeMouse {
 public:
  /// Evaluates a frame of a scene with molecules.
  void follow(const MoleculeFrame& frame);
  /// Removes the selection.
  void clear();
  /// Clears the selection if the joined scene has different molecules.
  /// In      joined  null: not joined; the selection is kept
  void belong_to(const std::shared_ptr<const wire::Joined>& joined);

  const ResidueSelection& selection() const { return selection_; }
  const std::optional<AtomDistance>& distance() const { return distance_; }
  /// Content of the panel for this frame.
  MoleculeContent content(const DrawnScene& scene);

  /// Longest time between the clicks of a double click.
  static constexpr Duration kDoubleClick = std::chrono::milliseconds(500);

 private:
  void click(const MoleculeFrame& frame);

  ResidueSelection selection_;
  ResidueSelection before_click_;          ///< selection before the last click
  std::optional<LocalTime> clicked_at_;    ///< time of the last click
  bool ignores_click_ = false;             ///< true: the next click belongs to a double click and selects nothing
  std::optional<LocalTime> doubled_at_{};  ///< time of the last double click
  std::shared_ptr<const wire::Joined> joined_;
  std::optional<AtomPlace> under_mouse_;
  std::optional<AtomDistance> distance_;
  std::string problem_;
};

}  // namespace tandem::client
