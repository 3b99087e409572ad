// One step of one soft body among rigid objects. From the poses of the objects it computes the motion of the body and
// its reactions on the objects. Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/physics/soft_contact.hpp"
#include "common/physics/touch_model.hpp"
#include "server/physics/soft_body.hpp"

namespace tandem::server {

/// A rigid object T during a soft step.
struct SoftThing {
  const physics::TouchModel* model = nullptr;
  double friction = 0.5;
  bool is_present = true;
  Pose X_WT_before;
  Pose X_WT;
};

/// One correction by a contact. All corrections of a step are stored, so that SoftTangent can differentiate the step.
struct SoftPush {
  enum class Kind { kPress, kStick, kSlide };

  Kind kind = Kind::kPress;
  int sweep = 0;
  int candidate = 0;  ///< index of the candidate (sample and part), constant during a step
  int sample = 0;
  int thing = 0;
  double mass_kg = 0;            ///< effective mass of the sample
  double way_share = 0;          ///< fraction of the object's motion in this step that is done up to this sweep
  Vec3 normal_W = Vec3::Zero();  ///< unit normal, outward from the object
  Vec3 lever_W = Vec3::Zero();   ///< contact point relative to the object's origin
  double size = 0;               ///< kPress: λ [kg·m]
  Eigen::Matrix3d bend_W = Eigen::Matrix3d::Zero();  ///< kPress: ∂normal/∂p [1/m]
  double friction = 0;                               ///< kStick, kSlide: coefficient μ
  Vec3 slide_W = Vec3::Zero();                       ///< kSlide: unit direction of the friction on the sample
  double slide_share = 0;  ///< kSlide: limit μ Σλ divided by the friction that sticking would need
};

/// Effect of a soft step on one object.
struct SoftReaction {
  Wrench impulse_W;        ///< about the object's origin [N·s, N·m·s]
  double lever_sum_m = 0;  ///< Σ |lever| · |impulse| over the contacts, for the mean lever
  double impulse_sum = 0;  ///< Σ |impulse| along normals
};

/// Solves links, volume and contacts by iterative sweeps.
///
/// Model   A surface sample p at depth d inside an object is moved onto the object's surface: Δxᵢ = bᵢ λ n / mᵢ.
///         * n: outward unit normal of the object
///         * bᵢ, mᵢ: weights and masses [kg] of the sample's nodes
///         * w = Σ bᵢ² / mᵢ: inverse effective mass of the sample [1/kg]
///         * λ = d / w: size of the correction [kg·m]
///         * h: length of the step [s]
///
/// The object gets the impulse −λ n / h at p, so each correction conserves momentum.
/// * Friction moves p along the surface towards the position that p would have if it had stuck to the object since the
///   start of the step. The sum of these corrections is at most μ Σ λ, with the friction coefficient μ.
/// * In the first half of the sweeps, the object moves from its old to its new pose. A thin or fast object thus does
///   not pass through the surface.
/// * The second half of the sweeps approaches equilibrium at the new pose.
/// Limit   soft bodies do not collide with each other or with themselves
class SoftStep {
 public:
  /// In      sweeps  number of sweeps of a step; even
  SoftStep(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps);
  ~SoftStep();

  /// Computes one step of the soft body among the objects. Returns true if a node was clamped to the speed limit.
  /// In      things     objects; their number is the same in every call
  /// Out     reactions  one entry per object; the reactions of the step are added to the entries
  bool step(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things,
            std::span<SoftReaction> reactions);

  SoftBody& body() { return body_; }
  const SoftBody& body() const { return body_; }
  /// Returns the corrections of the last step, in the order in which they were applied.
  std::span<const SoftPush> pushes() const { return pushes_; }
  std::size_t candidate_count() const;
  /// Positions of the nodes at the start of a sweep in the last step.
  std::span<const Vec3> nodes_at(int sweep) const;
  int sweeps() const { return sweeps_; }
  /// Returns whether the object may be within `margin_m` of the body. The state of the body is that at the start of the
  /// last step.
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
  std::vector<Vec3> trail_;  ///< node positions for nodes_at(), for all sweeps
};

}  // namespace tandem::server
