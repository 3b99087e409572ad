// Predicted soft contact: what the contact of a thing will be that is about to touch a soft body, so that a client that
// hears of it late can feel the touch when it comes. Private to the soft world.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Presses a copy of the body to learn how stiff it is where things come near, and predicts their contacts.
///
/// Model   surface    the plane through the samples of the body that are nearest to the thing, each weighed by
///                    exp(−(its distance − the least) / 1 mm)
///         stiffness  k = n·f / d of a copy of the body, after the thing has been held d = 3 mm in it for kSteps soft
///                    steps. One press at a time, so a soft step costs at most twice as much; each begins with the
///                    body as it is then, and none is made where a thing has been pressed before
///         contact    of a thing that does not touch: spring k along n, linearised at the depth d; it is zero at the
///                    surface and beyond, see soft_wrench(). Of one that touches with less than k d: the step's own
///                    wrench, with a stiffness between the two, for a first touch of a few samples is no measure of it
/// Limits  a plane; no friction before the touch; a body that gives way as a whole feels stiffer than it is; one who
///         comes near within less than kSteps soft steps (0.25 s), or while others are pressed, is not predicted
class PredictedSoftContact {
 public:
  /// Nearer than this a thing is looked at.
  static constexpr double kReach_m = 0.06;
  static constexpr double kDepth_m = 3e-3;
  static constexpr int kSteps = 15;

  /// In      things  how many may touch, the first ones of every step's
  PredictedSoftContact(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps, std::size_t things);
  ~PredictedSoftContact();

  /// After a step of the body: looks which things are near, and presses on.
  void advance(const SoftStep& real, double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things);
  /// From the thing to the surface, where a contact can be predicted; else infinite.
  double gap_m(std::size_t thing) const;
  /// `now` is the thing's contact of the step with all bodies; none to be predicted: as it is.
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
  std::vector<Vec3> p_W_;   ///< of all samples; scratch
  std::vector<Near> near_;  ///< of those near a thing; scratch
  std::size_t pressing_ = 0;
  int steps_ = kSteps;  ///< of the press so far
  Pose X_WT_pressing_;
  Vec3 normal_W_pressing_ = Vec3::UnitZ();
  Vec3 p_WT_pressing_ = Vec3::Zero();
};

}  // namespace tandem::server
