// Predicts the hand pose of another user (partner) in the local model from the last received states.
//
//   received with delay            predicted                            stepped in the local model
//   handle, wrench on the hand ──▶ intended pose of the hand ──▶ handle ──▶ their tool, by the coupling ──▶ contact
//                                  + displacement by ◀───────────────── wrench of the model on their hand
//
// The loop of a stiff interaction between the users is thus closed locally at 1 kHz. Only voluntary motion of the
// partner's hand is felt late.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/haptics/prediction/trajectory_forecast.hpp"
#include "common/net/playout.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Impedance of a human hand: computes by how much a wrench on the handle displaces the hand.
///
/// Model   m p'' + b p' + k p = f, I θ'' + b_r θ' + k_r θ = τ, relative to the intended pose; implicit Euler
class GivingHand {
 public:
  static constexpr double kMass_kg = 0.3;  ///< mass of a relaxed hand; the constants below describe the same hand
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

/// Estimates mass and stiffness of a user's hand from its motion and the displayed force.
///
/// Model   Hypothetical hands j = 0 … kHands − 1 form a grid of mass m and stiffness k. From hand j follows the
///         intended position x − a_j:
///         x    position of the hand
///         a_j  displacement of hand j by the displayed force
///         If hand j has the correct mass and stiffness, x − a_j is the voluntary motion, which is slow and smooth. So
///         the score of a hand is the error of a fixed forecast of x − a_j over kHorizon_s (RMS over kMemory_s).
///         The estimate is the mean of log m and log k, weighted by prior · score⁻⁸. While the displayed force does not
///         change, all scores are equal, and the estimate is the relaxed hand.
/// Source  multiple-model adaptive estimation: Magill, "Optimal adaptive estimation of sampled stochastic processes",
///         IEEE Trans. Automatic Control 10(4), 1965; scores and grid are our choice
/// Thread  always the same thread; no allocation
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

/// State of the local model that the prediction of a partner needs in one step.
struct PartnerSurroundings {
  Wrench on_hand_W;  ///< the model's wrench on the partner's hand
  /// True: the partner's voluntary motion is predicted; false: their hand stays at the last received pose
  bool is_predicted = true;
  bool is_coupled = false;  ///< true: both users act on the same body, directly or through other bodies
  /// True: both users have a hand on the same body; the fields below describe this common body
  bool has_common_body = false;
  RigidState body;                 ///< current state of the common body in the model
  Pose X_WB_then;                  ///< pose of the common body at the server when the partner's handle was sampled
  bool is_held = false;            ///< true: the partner's tool holds the common body; false: it touches the body
  Vec3 pressing_W = Vec3::Zero();  ///< normal of the partner's contact with the common body, unit length; zero if held
};

/// Predictor of one partner: stores the received states and predicts the handle.
///
/// Model   X̂_H = X_H(t_s) + e(now) − a(t_s) + u
///         X̂_H, X_H  predicted and received handle pose
///         t_s       sampling time of X_H
///         e         displacement of the hand by the model's force
///         a         displacement of the hand by the force that was displayed at t_s
///         u         forecast of the change of the intended pose X_H − a since t_s
///         e and a are those of a GivingHand with the mass and stiffness of HandEstimate. u is forecast from the motion
///         of the intended pose, with two exceptions:
///         1. If both users hold or touch a common body, the motion of that body since t_s contributes to u (only
///            across the contact normal).
///         2. If the two users touch, even through other bodies, TrajectoryForecast predicts less, because this user's
///            response then pushes the partner's hand.
///         At rest with a correct force of the model, e = a and u = 0, so the predicted handle equals the received one.
/// Source  Smith's predictor, "Closer control of loops with dead time", Chem. Eng. Prog. 53(5), 1957: the loop is
///         closed locally through the modelled part of the remote end, and the unmodelled part is held. Using the
///         received force on the remote hand is our addition.
/// Thread  haptic: no allocation, no throw; finite for finite input
class Partner {
 public:
  explicit Partner(UserId id) : id_(id) {}

  /// In      received  state of the partner in `update`
  void receive(const proto::OtherUserState& received, const proto::ServerUpdate& update) noexcept;
  /// Predicts the current handle. Must be called only while has_handle().
  /// In      played   server time of the state that is displayed now (net::PlayoutDelay)
  ///         since_s  current server time minus `played` [s]
  RigidState predict(Duration played, double since_s, const PartnerSurroundings& around, double period_s) noexcept;

  UserId id() const { return id_; }
  std::size_t tool() const { return tool_; }
  bool has_handle() const { return !handle_.is_empty(); }
  /// Returns 1 while both users have a hand on the same body. After one of them has left the body, the result falls to
  /// 0 within kUncouple_s.
  double common_share() const { return lately_common_; }
  /// Returns the body that the partner holds, as last received (holds()), and the pose of the partner's tool on this
  /// body (place()). The pose is empty until one update has contained both tool and body.
  BodyId holds() const { return holds_; }
  const std::optional<Pose>& place() const { return X_BT_; }
  const RigidState& received_tool() const { return received_tool_; }
  ServerTime received_at() const { return received_at_; }

 private:
  void follow_grip(const PartnerSurroundings& around, double period_s) noexcept;
  /// Returns the displacement `way` without its component along the contact normal.
  Vec3 across(const Vec3& way) const noexcept;

  UserId id_;
  std::size_t tool_ = 0;
  BodyId holds_;
  std::optional<Pose> X_BT_;
  RigidState received_tool_;
  ServerTime received_at_{};
  Duration handle_age_{0};
  net::RigidTrack handle_;
  net::RigidTrack force_;   ///< force on the partner's hand [N], stored as a position so that the track interpolates it
  net::RigidTrack torque_;  ///< torque on the partner's hand [N m], stored in the same way
  HandEstimate hand_;
  GivingHand modelled_;  ///< computes e, the displacement by the model's force
  GivingHand shown_;     ///< computes a, the displacement by the force that was displayed
  // Arguments of the constructors: first a typical displacement, second the fraction of a common body's motion that the
  // partner is initially assumed to follow. The fraction 0.25 is a limit: with a larger one, a bar that two users turn
  // by its ends oscillates along its length with growing amplitude.
  haptics::TrajectoryForecast intent_{0.01, 0.25};   ///< forecast of X_H − a [m]
  haptics::TrajectoryForecast turn_intent_{0.1, 0};  ///< forecast of the accumulated rotation [rad]
  Vec3 turned_ = Vec3::Zero();
  Quat q_before_ = Quat::Identity();
  double common_share_ = 0;   ///< 1 if there is a common body, else 0; changes within kChange_s
  double lately_common_ = 0;  ///< rises like common_share_, but falls within kUncouple_s
  /// 1 while both users act on the same body, directly or through other bodies; later falls to 0 within kUncouple_s
  double coupled_share_ = 0;
  Vec3 pressing_W_ = Vec3::Zero();  ///< smoothed contact normal; its length is below 1 while the contact begins or ends
};

}  // namespace tandem::client
