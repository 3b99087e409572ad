// One step of one soft body among rigid objects. It computes the motion of the body and the reactions on the objects
// from their poses. Private to the soft world.
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

/// One correction by a contact, stored so that the step can be differentiated.
struct SoftPush {
  enum class Kind { kPress, kStick, kSlide };

  Kind kind = Kind::kPress;
  int sweep = 0;
  int candidate = 0;  ///< index, the same in all sweeps of a step
  int sample = 0;
  int thing = 0;
  double mass_kg = 0;                                ///< effective mass of the sample
  double way_share = 0;                              ///< fraction of the object's motion that is done at this sweep
  Vec3 normal_W = Vec3::Zero();                      ///< outward from the object
  Vec3 lever_W = Vec3::Zero();                       ///< contact point relative to the object's origin
  double size = 0;                                   ///< kPress: λ [kg·m]
  Eigen::Matrix3d bend_W = Eigen::Matrix3d::Zero();  ///< kPress: ∂normal/∂p [1/m]
  double friction = 0;                               ///< kStick, kSlide
  Vec3 slide_W = Vec3::Zero();                       ///< kSlide: unit direction of the friction on the sample
  double slide_share = 0;                            ///< kSlide: μ Σλ divided by the friction needed to stick
};

/// Effect of a soft step on an object.
struct SoftReaction {
  Wrench impulse_W;        ///< about the object's origin [N·s, N·m·s]
  double lever_sum_m = 0;  ///< Σ |lever| · |impulse|
  double impulse_sum = 0;  ///< Σ |impulse| along normals
};

/// Solves links, volume and contacts by iterative sweeps.
///
/// Model   A surface sample p at depth d inside an object is moved onto its surface: λ = d / w, w = Σ bᵢ² / mᵢ,
///         Δxᵢ = bᵢ λ n / mᵢ, where bᵢ and mᵢ are weights and masses of the sample's nodes. The object gets the impulse
///         −λ n / h at p, so each correction conserves momentum. Friction pulls p along the surface towards the
///         position at which it would have stuck to the object since the start of the step. The sum of the friction
///         corrections is at most μ Σ λ. Objects move from pose to pose during the first half of the sweeps, so that
///         thin or fast objects do not pass through the surface. The second half finds the equilibrium.
/// Limit   soft bodies do not collide with each other or with themselves
class SoftStep {
 public:
  /// In      sweeps  number of sweeps of a step; even
  SoftStep(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps);
  ~SoftStep();

  /// In      things  their number is the same in every call
  /// Out     reactions  the step's reactions are added, one entry for each object; returns true if a node was slowed
  bool step(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things,
            std::span<SoftReaction> reactions);

  SoftBody& body() { return body_; }
  const SoftBody& body() const { return body_; }
  /// Corrections of the last step, in the order of their application.
  std::span<const SoftPush> pushes() const { return pushes_; }
  std::size_t candidate_count() const;
  /// Positions of the nodes at the start of a sweep in the last step.
  std::span<const Vec3> nodes_at(int sweep) const;
  int sweeps() const { return sweeps_; }
  /// Returns whether the object can be within `margin_m` of the body in the body's state at the start of the last step.
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
