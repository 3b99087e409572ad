#include "common/haptics/coupling/sampled_loop.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

namespace tandem::haptics {
namespace {

constexpr int kMaxPeriodsBack = 64;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_usable(const LoopModel& m) {
  const std::array numbers{m.stiffness, m.damping,        m.tool_mass,    m.device_mass,      m.device_damping,
                           m.hand_mass, m.hand_stiffness, m.hand_damping, m.contact_stiffness};
  const auto is_good = [](double a) { return std::isfinite(a) && a >= 0; };
  return std::all_of(numbers.begin(), numbers.end(), is_good) && std::isfinite(m.period_s) && m.period_s > 0 &&
         m.device_mass + m.hand_mass > 0 && m.velocity_window >= 1 && m.delay_periods >= 0 &&
         m.velocity_window <= kMaxPeriodsBack && m.delay_periods <= kMaxPeriodsBack;
}

/// Motion of hand and device over one period: (x, v) at the end = state · (x, v) at the start + force · F.
struct HandStep {
  Eigen::Matrix2d state;
  Eigen::Vector2d force;
};
HandStep hand_step(const LoopModel& m) {
  const double mass = m.device_mass + m.hand_mass;
  // In the matrix exponential of [A B; 0 0], the last column is the response to a force that is held over the period.
  Eigen::Matrix3d rates = Eigen::Matrix3d::Zero();
  rates(0, 1) = 1;
  rates(1, 0) = -m.hand_stiffness / mass;
  rates(1, 1) = -(m.device_damping + m.hand_damping) / mass;
  rates(1, 2) = 1 / mass;
  const Eigen::Matrix3d step = (rates * m.period_s).exp();
  return {step.topLeftCorner<2, 2>(), step.topRightCorner<2, 1>()};
}

/// State vector of the loop: z = (x, x₋₁ − x, …, x₋L − x, y − x or y, v, u).
///   x, v  position and velocity of the hand; x₋ᵢ is its position i periods ago, up to L periods
///   y, u  position and velocity of the tool
/// If the coupling has a spring, y − x is stored in place of y, because the spring force depends only on this
/// difference.
class LoopState {
 public:
  explicit LoopState(const LoopModel& m)
      : back_(m.velocity_window + m.delay_periods), is_tool_relative_(m.stiffness > 0) {}
  int size() const { return back_ + 4; }
  int back() const { return back_; }
  int tool_index() const { return back_ + 1; }
  bool is_tool_relative() const { return is_tool_relative_; }

  /// Each function returns a row vector r such that r · z is the named quantity of the loop.
  Eigen::RowVectorXd x(int periods_ago = 0) const { return periods_ago == 0 ? unit(0) : unit(0) + unit(periods_ago); }
  Eigen::RowVectorXd y() const { return is_tool_relative_ ? unit(0) + unit(tool_index()) : unit(tool_index()); }
  Eigen::RowVectorXd v() const { return unit(back_ + 2); }
  Eigen::RowVectorXd u() const { return unit(back_ + 3); }

 private:
  Eigen::RowVectorXd unit(int index) const { return Eigen::RowVectorXd::Unit(size(), index); }
  int back_;
  bool is_tool_relative_;
};

Eigen::MatrixXd transition(const LoopModel& m, const LoopState& z) {
  const double T = m.period_s;
  const Eigen::RowVectorXd handle = z.x(m.delay_periods);
  const Eigen::RowVectorXd handle_velocity =
      (handle - z.x(m.delay_periods + m.velocity_window)) / (m.velocity_window * T);
  // Implicit Euler for the tool: m (u⁺ − u)/T = k (x_h − y⁺) + b (v_h − u⁺) − k_c y⁺ with y⁺ = y + T u⁺, solved for u⁺.
  const double resistance = m.tool_mass + T * m.damping + T * T * (m.stiffness + m.contact_stiffness);
  const Eigen::RowVectorXd push =
      m.stiffness * (handle - z.y()) + m.damping * handle_velocity - m.contact_stiffness * z.y();
  const Eigen::RowVectorXd u_next = (m.tool_mass * z.u() + T * push) / resistance;
  const Eigen::RowVectorXd y_next = z.y() + T * u_next;
  const Eigen::RowVectorXd on_hand = -m.stiffness * (handle - y_next) - m.damping * (handle_velocity - u_next);
  const HandStep hand = hand_step(m);
  const Eigen::RowVectorXd x_next = hand.state(0, 0) * z.x() + hand.state(0, 1) * z.v() + hand.force(0) * on_hand;

  Eigen::MatrixXd next(z.size(), z.size());
  next.row(0) = x_next;
  for (int i = 1; i <= z.back(); ++i) next.row(i) = z.x(i - 1) - x_next;
  next.row(z.tool_index()) = z.is_tool_relative() ? Eigen::RowVectorXd(y_next - x_next) : y_next;
  next.row(z.tool_index() + 1) = hand.state(1, 0) * z.x() + hand.state(1, 1) * z.v() + hand.force(1) * on_hand;
  next.row(z.tool_index() + 2) = u_next;
  return next;
}

Eigen::MatrixXd without_state(const Eigen::MatrixXd& a, int index) {
  const Eigen::Index rest = a.rows() - index - 1;
  Eigen::MatrixXd result(a.rows() - 1, a.cols() - 1);
  result.topLeftCorner(index, index) = a.topLeftCorner(index, index);
  result.topRightCorner(index, rest) = a.topRightCorner(index, rest);
  result.bottomLeftCorner(rest, index) = a.bottomLeftCorner(rest, index);
  result.bottomRightCorner(rest, rest) = a.bottomRightCorner(rest, rest);
  return result;
}

// Returns the transition matrix without the positions that influence no other state. Such a position only accumulates
// motion, and would contribute the eigenvalue 1.
Eigen::MatrixXd felt_transition(const LoopModel& m) {
  const LoopState z(m);
  Eigen::MatrixXd a = transition(m, z);
  const bool is_hand_held = m.hand_stiffness > 0, is_tool_held = m.contact_stiffness > 0;
  if (!z.is_tool_relative() && !is_tool_held) a = without_state(a, z.tool_index());
  if (!is_hand_held && !(z.is_tool_relative() && is_tool_held)) a = without_state(a, 0);
  return a;
}

// Returns true if hand and tool can move together at constant speed. This motion is undamped, because the coupling's
// forces on hand and tool are opposite and conserve the total momentum.
bool can_glide(const LoopModel& m) {
  return !(m.hand_stiffness > 0) && !(m.contact_stiffness > 0) && !(m.device_damping + m.hand_damping > 0);
}

}  // namespace

double spectral_radius(const LoopModel& model) {
  if (!is_usable(model)) return kInfinity;
  if (!(model.stiffness > 0) && !(model.damping > 0)) return 0;
  const Eigen::MatrixXd a = felt_transition(model);
  if (!a.allFinite()) return kInfinity;
  Eigen::VectorXcd eigenvalues = a.eigenvalues();
  if (can_glide(model)) {
    Eigen::Index glide = 0;
    (eigenvalues.array() - 1.0).abs().minCoeff(&glide);
    eigenvalues(glide) = 0;
  }
  return eigenvalues.cwiseAbs().maxCoeff();
}

}  // namespace tandem::haptics
