// Finds the pose of lowest energy of two molecules near a given pose. The caller may spread its steps over time.
#pragma once

#include <optional>

#include "common/docking/exact_field.hpp"

namespace tandem::server {

/// Descends in energy from a given pose of two molecules. Every accepted step lowers the energy.
///
/// Model   Levenberg-Marquardt steps with the 6×6 gradient of exact_field(). A step translates by at most 0.5 Å, and
///         rotates such that the farthest atom moves by at most 0.5 Å. The descent ends when a step gains less than
///         1e-6 kcal/mol
class PoseMinimiser {
 public:
  static constexpr int kMaxSteps = 200;

  /// In      a, b, model  must outlive this object
  PoseMinimiser(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                const Pose& X_AB_angstrom);

  /// Evaluates the field at the start pose in the first call, and at the next pose in each later call.
  /// Out     false: the minimum is reached, or kMaxSteps are done; further calls have no effect
  /// Cost    one evaluation of exact_field() with its gradient
  bool step();
  /// Returns the pose of lowest energy so far.
  const Pose& pose() const { return X_; }
  /// Returns the energy of pose(); 0 before the first step().
  double energy_kj_per_mol() const { return here_.energy_kj_per_mol(); }

 private:
  std::optional<Pose> next();

  const docking::Molecule* a_;
  const docking::Molecule* b_;
  const docking::FieldModel* model_;
  double radius_;
  Pose X_;
  docking::FieldResult here_;
  docking::Matrix6 gradient_;
  double damping_ = 1, way_ = 0;
  int steps_ = 0;
  bool is_begun_ = false, is_over_ = false;
};

}  // namespace tandem::server
