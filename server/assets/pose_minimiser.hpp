// The pose of least energy of two molecules near a given one, by steps that a caller may spread over time.
#pragma once

#include <optional>

#include "common/docking/exact_field.hpp"

namespace tandem::server {

/// Descends from a pose, downhill all the way.
///
/// Model   Levenberg's steps by the 6×6 gradient of exact_field(), at most 0.5 Å and as much at the farthest atom, until no
///         step gains 1e-6 kcal/mol
class PoseMinimiser {
 public:
  static constexpr int kMaxSteps = 200;

  /// In      a, b, model  outlive this
  PoseMinimiser(const docking::Molecule& a, const docking::Molecule& b, const docking::FieldModel& model,
                const Pose& X_AB_angstrom);

  /// The first call evaluates the field at the start, each later one at the next pose.
  /// Out     false: the minimum is reached, or kMaxSteps are done; another call does nothing
  /// Cost    one exact_field() with its gradient
  bool step();
  /// The best pose so far.
  const Pose& pose() const { return X_; }
  /// Its energy; 0 before the first step().
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
