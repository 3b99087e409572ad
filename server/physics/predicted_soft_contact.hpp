// Predicts the contact of an object that is about to touch a soft body. A client that receives it late can then render
// the touch when it occurs. Private to the soft world.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Presses a copy of the body to measure its stiffness near approaching objects, and predicts their contacts.
///
/// Model   surface    plane through the samples of the body nearest to the object, each weighted by
///                    exp(−(distance − least distance) / 1 mm)
///         stiffness  k = n·f / d of a copy of the body, after the object was held d = 3 mm inside it for kSteps
///                    soft steps. One press at a time, so a soft step costs at most twice as much. Each press begins
///                    with the present state of the body; an object is not pressed twice at one position
///         contact    object without contact: spring k along n, linearised at the depth d. The force is zero at the
///                    surface and beyond, see soft_wrench(). Object with a force below k d: the wrench of the step,
///                    with a stiffness between the two, because a first touch of a few samples gives no reliable one
/// Limits  the surface is a plane; no friction before the touch; a body that gives way as a whole feels too stiff;
///         an object that approaches in less than kSteps soft steps (0.25 s), or while others are pressed, is not
///         predicted
class PredictedSoftContact {
 public:
  /// Distance below which an object is observed.
  static constexpr double kReach_m = 0.06;
  static constexpr double kDepth_m = 3e-3;
  static constexpr int kSteps = 15;

  /// In      things  number of objects that may touch: the first ones of each step's list
  PredictedSoftContact(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps, std::size_t things);
  ~PredictedSoftContact();

  /// Updates the nearby objects after a step of the body, and continues the press.
  void advance(const SoftStep& real, double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things);
  /// Distance from the object to the surface if a contact can be predicted; else infinite.
  double gap_m(std::size_t thing) const;
  /// Predicted contact. `now` is the object's contact with all bodies in this step; it is returned unchanged if there
  /// is nothing to predict.
  SoftContact predict(std::size_t thing, const Pose& X_WT, const SoftContact& now) const;

 private:
  struct Surface;
  struct Near;
  struct Watched;

  std::optional<Surface> surface_near(const SoftBody& body, const SoftThing& thing);
  void choose_thing(const SoftBody& body, std::span<const SoftThing> things);
  void press(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things);

  SoftStep pressed_;
  std::vector<Watched> watched_;
  std::vector<SoftThing> things_;
  std::vector<SoftReaction> reactions_;
  std::vector<Vec3> p_W_;   ///< scratch: all samples
  std::vector<Near> near_;  ///< scratch: samples near an object
  std::size_t pressing_ = 0;
  int steps_ = kSteps;  ///< steps of the present press
  Pose X_WT_pressing_;
  Vec3 normal_W_pressing_ = Vec3::UnitZ();
  Vec3 p_WT_pressing_ = Vec3::Zero();
};

}  // namespace tandem::server
