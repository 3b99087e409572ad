// One step of one soft body among rigid things: their poses are given, its motion and what each of them feels come out.
// Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/physics/soft_contact.hpp"
#include "common/physics/touch_model.hpp"
#include "server/physics/soft_body.hpp"

namespace tandem::server {

/// A rigid thing T during a soft step.
struct SoftThing {
  const physics::TouchModel* model = nullptr;
  double friction = 0.5;
  bool is_present = true;
  Pose X_WT_before;
  Pose X_WT;
};

/// One push of a contact, kept so that the step can be differentiated.
struct SoftPush {
  enum class Kind { kPress, kStick, kSlide };

  Kind kind = Kind::kPress;
  int sweep = 0;
  int candidate = 0;  ///< the same number in all sweeps of a step, from 0
  int sample = 0;
  int thing = 0;
  double mass_kg = 0;                                ///< that the sample opposes
  double way_share = 0;                              ///< of the thing's way in this step, done by then
  Vec3 normal_W = Vec3::Zero();                      ///< out of the thing
  Vec3 lever_W = Vec3::Zero();                       ///< from the thing's origin
  double size = 0;                                   ///< kPress: λ [kg·m]
  Eigen::Matrix3d bend_W = Eigen::Matrix3d::Zero();  ///< kPress: ∂normal/∂p [1/m]
  double friction = 0;                               ///< kStick, kSlide
  Vec3 slide_W = Vec3::Zero();                       ///< kSlide: direction of the friction on the sample, unit
  double slide_share = 0;                            ///< kSlide: μ Σλ over what it would take to stick
};

/// What a soft step did to a thing.
struct SoftReaction {
  Wrench impulse_W;        ///< about the thing's origin [N·s, N·m·s]
  double lever_sum_m = 0;  ///< Σ |lever| · |impulse|, over
  double impulse_sum = 0;  ///< Σ |impulse| along normals
};

/// Sweeps over links, volume and contacts.
///
/// Model   a sample p of the surface that is d inside a thing is put on its surface: λ = d / w, w = Σ bᵢ² / mᵢ,
///         Δxᵢ = bᵢ λ n / mᵢ; the thing gets the impulse −λ n / h at p, so momentum is kept push by push. Friction
///         pulls p along the surface towards where it would be had it stuck to the thing since the start of the
///         step; its sum is at most μ Σ λ. Things move from pose to pose during the first half of the sweeps, so that
///         what is thin or fast does not jump over the surface; the second half finds the balance.
/// Limit   soft bodies do not meet each other or themselves
class SoftStep {
 public:
  /// In      sweeps  a step; even
  SoftStep(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps);
  ~SoftStep();

  /// In      things  the same number every time
  /// Out     reactions  added to, one a thing; true when a node had to be slowed
  bool step(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things,
            std::span<SoftReaction> reactions);

  SoftBody& body() { return body_; }
  const SoftBody& body() const { return body_; }
  /// Of the last step, in their order.
  std::span<const SoftPush> pushes() const { return pushes_; }
  std::size_t candidate_count() const;
  /// Of the last step: where the nodes were when a sweep began.
  std::span<const Vec3> nodes_at(int sweep) const;
  int sweeps() const { return sweeps_; }
  /// May the thing be this near the body, as it was when the last step began?
  bool is_near(const SoftThing& thing, double margin_m) const;

 private:
  struct Candidate;
  struct Place;

  void find_candidates(std::span<const SoftThing> things);
  void find_candidates(const SoftThing& thing, int index);
  void update_bounds();
  void place_things(std::span<const SoftThing> things, int sweep);
  void remember_nodes(int sweep);
  void solve_contact(const SoftThing& thing, int index, int sweep, std::span<SoftReaction> reactions);
  void apply(const Candidate& candidate, const Vec3& push_W, const Vec3& p_W, std::span<SoftReaction> reactions);
  void rub(const SoftThing& thing, Candidate& candidate, SoftPush push, std::span<SoftReaction> reactions);

  SoftBody body_;
  int sweeps_;
  double step_s_ = 0;
  Vec3 low_W_ = Vec3::Zero();
  Vec3 high_W_ = Vec3::Zero();
  std::vector<Candidate> candidates_;
  std::vector<Place> places_;
  std::vector<SoftPush> pushes_;
  std::vector<Vec3> trail_;  ///< nodes_at() of all sweeps
};

}  // namespace tandem::server
