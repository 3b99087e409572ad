// Another user in the local model: predicted pose of their hand, from the last received states.
//
//   received, and some time old    predicted                            stepped in the local model
//   handle, wrench on the hand ──▶ intended pose of the hand ──▶ handle ──▶ their tool, by the coupling ──▶ contact
//                                  + how it yields to ◀──────────────── wrench of the model on their hand
//
// Stiff interaction thus closes its loop locally, at 1 kHz. Only voluntary motion of the other hand is late.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/haptics/prediction/trajectory_forecast.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Impedance of a person's hand: its displacement under a force on the handle.
///
/// Model   m p'' + b p' + k p = f, I θ'' + b_r θ' + k_r θ = τ, relative to the intended pose; implicit Euler
class GivingHand {
 public:
  static constexpr double kMass_kg = 0.3;  ///< relaxed hand, as all constants below
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

/// Estimates mass and stiffness of a hand from its motion and the displayed force.
///
/// Model   each of kHands hands, a grid of m and k, gives an intended position x − a_j; a_j is its yield to the
///         displayed force. For the right hand the intended position is the voluntary motion, slow and smooth. So each
///         hand is scored by the error of a fixed forecast of it over kHorizon_s (RMS over kMemory_s). The estimate is
///         the mean of log m and log k, with weights prior · score⁻⁸. Without excitation all scores are alike, and the
///         estimate is the relaxed hand.
/// Source  multiple-model adaptive estimation: Magill, "Optimal adaptive estimation of sampled stochastic processes",
///         IEEE Trans. Automatic Control 10(4), 1965; scores and grid are ours
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

/// State of the local model around a partner in one step.
struct PartnerSurroundings {
  Wrench on_hand_W;              ///< wrench of the model on the partner's hand
  bool is_predicted = true;      ///< predicts the partner's voluntary motion; false: it stays at the last received pose
  bool is_coupled = false;       ///< the partner's bodies touch this user's, possibly through others
  bool has_common_body = false;  ///< partner and this user both have a hand on the same body
  RigidState body;               ///< that body, current state in the model
  Pose X_WB_then;                ///< its pose at the server when the partner's handle was sampled
  bool is_held = false;          ///< held by the partner's tool, not only pressed
  Vec3 pressing_W = Vec3::Zero();  ///< unit direction in which the partner's tool presses on it; zero: held, or unknown
};

/// Predictor of one other user: received states and predicted handle.
///
/// Model   X̂_H = X_H(t_s) + e(now) − a(t_s) + u, t_s the time of the received handle;
///         e: yield of the hand to the model's force; a: yield to the force really displayed then (GivingHand with mass
///         and stiffness of HandEstimate);
///         u: forecast of the intended pose X_H − a, from its motion and from the motion since t_s of a body that both
///         hold or press, across the pressing direction. TrajectoryForecast is cautious where the two touch, also
///         through other bodies, because this user's response then pushes the partner's hand.
///         At rest e = a where the model's force is true, so the handle is the received one and the force exact.
/// Source  Smith's predictor, "Closer control of loops with dead time", Chem. Eng. Prog. 53(5), 1957: the known part of
///         the far end is closed locally, the unknown part is held; ours here with the far hand's force received
/// Thread  haptic: no allocation, no throw; finite for finite input
class Partner {
 public:
  explicit Partner(UserId id) : id_(id) {}

  /// In      received  this user's state in `update`
  void receive(const proto::OtherUserState& received, const proto::ServerUpdate& update) noexcept;
  /// Predicted current handle; only while has_handle().
  /// In      played   server time of the playout
  ///         since_s  time since then [s]
  RigidState predict(Duration played, double since_s, const PartnerSurroundings& around, double period_s) noexcept;

  UserId id() const { return id_; }
  std::size_t tool() const { return tool_; }
  bool has_handle() const { return !handle_.is_empty(); }
  /// 1: this user and the partner have, or had a moment ago, a hand on the same body; 0: they have not. Smooth.
  double common_share() const { return lately_common_; }
  /// Body that the partner holds, as last received, and the tool's pose on it; none until both were in one update.
  BodyId holds() const { return holds_; }
  const std::optional<Pose>& place() const { return X_BT_; }
  const RigidState& received_tool() const { return received_tool_; }
  ServerTime received_at() const { return received_at_; }

 private:
  void follow_grip(const PartnerSurroundings& around, double period_s) noexcept;
  /// `way` without its component along the pressing direction.
  Vec3 across(const Vec3& way) const noexcept;

  UserId id_;
  std::size_t tool_ = 0;
  BodyId holds_;
  std::optional<Pose> X_BT_;
  RigidState received_tool_;
  ServerTime received_at_{};
  Duration handle_age_{0};
  net::RigidTrack handle_;
  net::RigidTrack force_;   ///< force on the partner's hand, stored as a position
  net::RigidTrack torque_;  ///< torque on the partner's hand, stored as a position
  HandEstimate hand_;
  GivingHand modelled_;  ///< e
  GivingHand shown_;     ///< a
  // Arguments: typical way, and prior share of a common body's motion that the partner is assumed to follow. Above this
  // value a bar that two users turn by its ends keeps swinging along its length and gains energy.
  haptics::TrajectoryForecast intent_{0.01, 0.25};   ///< forecast of X_H − a [m]
  haptics::TrajectoryForecast turn_intent_{0.1, 0};  ///< forecast of the accumulated rotation [rad]
  Vec3 turned_ = Vec3::Zero();
  Quat q_before_ = Quat::Identity();
  double common_share_ = 0;         ///< 1: both have a hand on a body; changes within kChange_s
  double lately_common_ = 0;        ///< same, but falls slowly
  double coupled_share_ = 0;        ///< 1: is_coupled; falls slowly
  Vec3 pressing_W_ = Vec3::Zero();  ///< its length is the weight of the direction
};

}  // namespace tandem::client
