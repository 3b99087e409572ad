// Inputs of the contact solver, and its result for each patch.
#pragma once

#include <cstdint>
#include <span>

#include "common/contact/contact_point.hpp"
#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::contact {

inline constexpr int kStaticBody = -1;

/// A moving rigid body at the start of a step. C is a frame at its centre of mass with the axes of W.
struct SolverBody {
  double mass_kg = 0;
  Eigen::Matrix3d inertia_W = Eigen::Matrix3d::Zero();  ///< inertia about C
  Vec3 p_WC = Vec3::Zero();
  Twist V_WC;       ///< velocity of C
  Wrench wrench_W;  ///< external wrench (weight, fields) about C
  /// True: the body moves with V_WC regardless of forces; mass, inertia and wrench_W are not used. Between such a body
  /// and a static or another prescribed one, no force could end an overlap. Their contacts therefore have no hard floor
  /// at the rigid depth: the soft layer (ContactRows) extends to any depth.
  bool is_prescribed = false;
};

/// A user's coupling to a freely moving body.
struct SolverCoupling {
  int body = 0;
  const haptics::CouplingLaw* law = nullptr;
  Pose X_WH;
  Twist V_WH;
  Pose X_WT;  ///< pose of the tool, which is fixed to the body
  /// Brake: damping of the tool's absolute velocity, in addition to the law's damping of the relative velocity.
  double brake_n_s_per_m = 0;
  double brake_n_m_s_per_rad = 0;
};

/// Ratio of the tangential stiffness of sticking friction to the normal stiffness of a contact, see ContactRows.
inline constexpr double kTangentialRatio = 0.8;

/// The contacts of body `a` with body `b`. One of them may be kStaticBody.
struct SolverPatch {
  int a = 0;
  int b = kStaticBody;
  std::span<ContactPoint> contacts;  ///< contacts, with normals out of b; the solver reads and updates their bristles
  double stiffness_n_per_m3 = 5e9;   ///< normal stiffness by area and depth
  double rigid_depth_m = 5e-4;       ///< depth beyond which contact is as stiff as the step allows
  double friction = 0.5;
  double dissipation_s = 1e-3;  ///< damping of the normal contact: force ∝ depth + dissipation · closing speed
};

/// Result of the solver for one patch.
struct PatchResult {
  Wrench on_a_W;               ///< mean wrench on a over the step, about the origin of W; b gets the opposite
  double normal_force_n = 0;   ///< sum of the magnitudes of the normal forces
  double deepest_m = 0;        ///< depth of the deepest contact with a force, at the start of the step
  std::uint32_t pressing = 0;  ///< number of contacts with a force
};

}  // namespace tandem::contact
