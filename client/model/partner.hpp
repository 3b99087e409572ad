// Another user in one's own local world: where his hand is by now, foreseen from what the server told of it.
//
//   told, and some time old        foreseen                             stepped in the local world
//   handle, wrench on the hand ──▶ where his hand wants to go ──▶ handle ──▶ his tool, by the coupling ──▶ what it touches
//                                  + how it gives way to ◀──────────── wrench of the model on his hand
//
// So all that is stiff closes its loop here, at 1 kHz, and only where his hand goes by its own will comes late.
#pragma once

#include <cstdint>
#include <optional>

#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A person's hand on a handle that gives way to what pushes it.
///
/// Model   m p'' + b p' + k p = f, I θ'' + b_r θ' + k_r θ = τ, from where the hand wants to be; implicit Euler
/// Limits  a hand is not told of: m, k, b are those of a relaxed one. A stiffer or lighter one does little harm, one of
///         five times the mass rings (lab)
class GivingHand {
 public:
  static constexpr double kMass_kg = 0.3;
  static constexpr double kStiffness_n_per_m = 200;
  static constexpr double kDamping_n_s_per_m = 8;
  static constexpr double kInertia_kg_m2 = 4e-4;
  static constexpr double kStiffness_n_m_per_rad = 1;
  static constexpr double kDamping_n_m_s_per_rad = 0.02;

  void step(const Wrench& on_hand_W, double period_s) noexcept;
  const Vec3& p() const { return p_; }
  const Vec3& theta() const { return theta_; }
  const Twist& V() const { return V_; }

 private:
  Vec3 p_ = Vec3::Zero();
  Vec3 theta_ = Vec3::Zero();
  Twist V_;
};

/// What the partner and this user both have a hand on, in the local world.
struct CommonBody {
  RigidState here;                 ///< as the model has it now
  Pose X_there;                    ///< as the server had it when the partner's handle was told
  Vec3 pressing_W = Vec3::Zero();  ///< along which the partner's tool presses on it, unit; zero: holds it, or unknown
  bool is_held_by_partner = false;
};

/// What the local world has of the partner in a step.
struct PartnerSurroundings {
  Wrench on_hand_W;                  ///< of the model, on the partner's hand
  std::optional<CommonBody> common;  ///< none: there is no such body
  bool holds_molecule = false;       ///< alone: felt from afar
};

/// One other user.
///
/// Model   X̂_H = X_H(t_s) + e(now) − a(t_s) + H u, with t_s when the told handle was there and H how long that is ago;
///         e: how the hand gives way to the model's force, a: to the force that it was really shown then (GivingHand);
///         u: velocity of where the hand wants to be, X_H − a, through a low pass, times a gain: wishes are slow. Of a
///         body that both press the hand goes along, across the pressing direction, by a share of the body's movement
///         since t_s: it holds on to it.
///         At rest e = a wherever the model's force is the true one, so the handle is the told one and the force exact.
/// Source  Smith's predictor, "Closer control of loops with dead time", Chem. Eng. Prog. 53(5), 1957: what is known of
///         the far end is closed locally, what is not is held; ours here with the far hand's own force told
/// Thread  haptic: no allocation, no throw; finite for finite input
class Partner {
 public:
  explicit Partner(UserId id) : id_(id) {}

  /// In      told  of this user, in `update`
  void take(const proto::OtherUserState& told, const proto::ServerUpdate& update) noexcept;
  /// His handle as it is by now; only while has_handle().
  /// In      played   server time of the update in use
  ///         since_s  how long ago that was
  RigidState foresee(Duration played, double since_s, const PartnerSurroundings& around, double period_s) noexcept;

  UserId id() const { return id_; }
  std::size_t tool() const { return tool_; }
  bool has_handle() const { return !handle_.is_empty(); }
  /// What he holds, as last told, and his tool's place on it; none before both were told together.
  BodyId holds() const { return holds_; }
  const std::optional<Pose>& place() const { return X_BT_; }
  const RigidState& told_tool() const { return told_tool_; }
  ServerTime told_at() const { return told_at_; }

 private:
  void follow_wish(const RigidState& told, double period_s) noexcept;
  void follow_grip(const PartnerSurroundings& around, double period_s) noexcept;
  /// `way` without the part along which he presses.
  Vec3 across(const Vec3& way) const noexcept;

  UserId id_;
  std::size_t tool_ = 0;
  BodyId holds_;
  std::optional<Pose> X_BT_;
  RigidState told_tool_;
  ServerTime told_at_{};
  Duration handle_age_{0};
  net::RigidTrack handle_;
  net::RigidTrack force_;           ///< on his hand, in place of positions
  net::RigidTrack torque_;          ///< likewise
  GivingHand modelled_;             ///< e
  GivingHand shown_;                ///< a
  std::optional<Vec3> slow_p_;      ///< where the hand wants to be, through a low pass
  Twist wish_;                      ///< u, at gain 1
  double common_share_ = 0;         ///< 1: both have a hand on a body; comes and goes in kChange_s
  double afar_share_ = 0;           ///< 1: he holds a molecule alone
  Vec3 pressing_W_ = Vec3::Zero();  ///< its length says how far it counts
};

}  // namespace tandem::client
