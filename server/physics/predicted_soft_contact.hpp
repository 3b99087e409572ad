// Predicts the contact of an object that is about to touch a soft body. A client receives soft contacts with a delay.
// With the prediction it can render the touch at the moment when it occurs. Private to the soft world.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Measures the stiffness of a soft body near approaching objects, and predicts their contacts. To measure, it presses
/// an object into a copy of the body.
///
/// Model   1. Surface: a plane through the samples of the body nearest to the object. The weight of a sample is
///         exp(−(distance − least distance) / 1 mm).
///         2. Stiffness: k = n·f / d.
///            * n is the plane's normal.
///            * d = 3 mm is the depth at which the object is held in a copy of the body.
///            * f is the force on the object after kSteps soft steps of the copy.
///            The copy starts from the current state of the body. Objects are measured one after the other, so a soft
///            step costs at most twice as much. An object is measured once at each position.
///         3. Contact of an object that does not touch yet: a spring k along n, linearised at the depth d. Its force is
///            zero at the surface and outside, see soft_wrench().
///         4. Contact of an object that touches with a force below k d: the wrench that the soft step has computed,
///            with a stiffness between that of the step and k. The contact of the first few samples alone gives no
///            reliable stiffness.
/// Limits  The surface is assumed to be a plane. Friction is predicted only after the touch. The contact of a body that
///         yields as a whole feels too stiff. An object gets no prediction if it arrives within kSteps soft steps (0.25
///         s), or while another object is measured
class PredictedSoftContact {
 public:
  /// Distance to the body below which an object is observed.
  static constexpr double kReach_m = 0.06;
  static constexpr double kDepth_m = 3e-3;
  static constexpr int kSteps = 15;

  /// In      things  number of objects that may touch. They are the first entries of the list `things` in each step
  PredictedSoftContact(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps, std::size_t things);
  ~PredictedSoftContact();

  /// Updates the surface near each object after a step of the real body. Then advances the copy of the body by one soft
  /// step, with one object held in it.
  void advance(const SoftStep& real, double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things);
  /// Returns the distance from the object to the surface; infinity if no contact can be predicted.
  double gap_m(std::size_t thing) const;
  /// Returns the predicted contact, or `now` if none can be predicted. `now` is the object's contact with all soft
  /// bodies in this step.
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
  int steps_ = kSteps;  ///< soft steps since the start of the current measurement
  Pose X_WT_pressing_;
  Vec3 normal_W_pressing_ = Vec3::UnitZ();
  Vec3 p_WT_pressing_ = Vec3::Zero();
};

}  // namespace tandem::server
