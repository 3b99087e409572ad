// Another user in one's own local world: where his hand is by now, foreseen from what the server told of it.
//
//   told, and some time old        foreseen                             stepped in the local world
//   handle, wrench on the hand ──▶ where his hand wants to go ──▶ handle ──▶ his tool, by the coupling ──▶ what it touches
//                                  + how it gives way to ◀──────────── wrench of the model on his hand
//
// So all that is stiff closes its loop here, at 1 kHz, and only where his hand goes by its own will comes late.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/haptics/prediction/trajectory_forecast.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A person's hand on a handle that gives way to what pushes it.
///
/// Model   m p'' + b p' + k p = f, I θ'' + b_r θ' + k_r θ = τ, from where the hand wants to be; implicit Euler
class GivingHand {
 public:
  static constexpr double kMass_kg = 0.3;  ///< of a relaxed hand, likewise the others
  static constexpr double kStiffness_n_per_m = 200;
  static constexpr double kDamping_n_s_per_m = 8;
  static constexpr double kInertia_kg_m2 = 4e-4;
  static constexpr double kStiffness_n_m_per_rad = 1;
  static constexpr double kDamping_n_m_s_per_rad = 0.02;

  void step(const Wrench& on_hand_W, double period_s) noexcept;
  void set(double mass_kg, double stiffness_n_per_m) noexcept;
  const Vec3& p() const { return p_; }
  const Vec3& theta() const { return theta_; }
  const Twist& V() const { return V_; }

 private:
  double mass_kg_ = kMass_kg;
  double stiffness_n_per_m_ = kStiffness_n_per_m;
  Vec3 p_ = Vec3::Zero();
  Vec3 theta_ = Vec3::Zero();
  Twist V_;
};

/// How heavy and how stiff a hand is, from where it went and what it was shown.
///
/// Model   each of kHands hands, a grid of m and k, says where the hand wants to be: x − a_j, a_j how it gives way to the
///         force shown. For the right one that is what a person does by will, slow and smooth; so each is scored by how
///         well a fixed forecast of it over kHorizon_s came true (RMS over kMemory_s). The estimate is the mean of log m
///         and log k, with weights of prior · score⁻⁸. Where nothing shakes the hand all score alike, and it is the relaxed
///         one.
/// Source  multiple-model adaptive estimation: Magill, "Optimal adaptive estimation of sampled stochastic processes", IEEE
///         Trans. Automatic Control 10(4), 1965; scores and grid are ours
/// Thread  one; no allocation
class HandEstimate {
 public:
  static constexpr std::size_t kHands = 9;
  static constexpr double kHorizon_s = 0.1;
  static constexpr double kMemory_s = 5;

  HandEstimate();
  void observe(const Vec3& handle_W, const Vec3& shown_W, double period_s) noexcept;
  double mass_kg() const;
  double stiffness_n_per_m() const;

 private:
  void score(std::size_t j, const Vec3& intent, double fast, double slow, double period_s) noexcept;

  static constexpr std::size_t kKept = 100;
  std::array<GivingHand, kHands> hands_;
  std::array<Vec3, kHands> fast_, slow_;
  std::array<double, kHands> squares_{};
  std::array<std::array<Vec3, kHands>, kKept> forecasts_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  double log_mass_;
  double log_stiffness_;
};

/// What the local world has of the partner in a step.
struct PartnerSurroundings {
  Wrench on_hand_W;                ///< of the model, on the partner's hand
  bool is_foreseen = true;         ///< where the partner's hand goes by its own will; else it stays where it was told
  bool is_coupled = false;         ///< what the partner moves touches what this user moves, be it through others
  bool has_common_body = false;    ///< the partner and this user both have a hand on a body itself
  RigidState body;                 ///< that, as the model has it now
  Pose X_WB_then;                  ///< as the server had it when the partner's handle was told
  bool is_held = false;            ///< by the partner's tool, and not only pressed
  Vec3 pressing_W = Vec3::Zero();  ///< along which the partner's tool presses on it, unit; zero: holds it, or unknown
};

/// One other user.
///
/// Model   X̂_H = X_H(t_s) + e(now) − a(t_s) + u, with t_s when the told handle was there;
///         e: how the hand gives way to the model's force, a: to the force that it was really shown then (GivingHand, as
///         heavy and stiff as HandEstimate finds it)
///         u: forecast of where the hand wants to be, X_H − a, from how that moved, and from how a body that both have a
///         hand on has moved since t_s, across the pressing direction (TrajectoryForecast: cautious where the two touch, be
///            it through other things, for then this user's answer pushes the partner's hand)
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
  /// 1: he and this user both have a hand on one body, or had a moment ago; 0: they have not. Smooth.
  double common_share() const { return lately_common_; }
  /// What he holds, as last told, and his tool's place on it; none before both were told together.
  BodyId holds() const { return holds_; }
  const std::optional<Pose>& place() const { return X_BT_; }
  const RigidState& told_tool() const { return told_tool_; }
  ServerTime told_at() const { return told_at_; }

 private:
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
  net::RigidTrack force_;   ///< on his hand, in place of positions
  net::RigidTrack torque_;  ///< likewise
  HandEstimate hand_;
  GivingHand modelled_;  ///< e
  GivingHand shown_;     ///< a
  // A partner who is taken to go along with what both hold gives way to its swing. With more than this, a bar that two turn
  // by its ends keeps swinging along itself, and gains energy.
  haptics::TrajectoryForecast intent_{0.01, 0.25};   ///< of X_H − a [m]
  haptics::TrajectoryForecast turn_intent_{0.1, 0};  ///< likewise, as the sum of its turns [rad]
  Vec3 turned_ = Vec3::Zero();
  Quat q_before_ = Quat::Identity();
  double common_share_ = 0;         ///< 1: both have a hand on a body; comes and goes in kChange_s
  double lately_common_ = 0;        ///< likewise; goes slowly
  double coupled_share_ = 0;        ///< likewise, of is_coupled; goes slowly
  Vec3 pressing_W_ = Vec3::Zero();  ///< its length says how far it counts
};

}  // namespace tandem::client
