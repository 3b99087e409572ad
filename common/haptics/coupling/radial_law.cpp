#include "common/haptics/coupling/radial_law.hpp"

#include "common/haptics/coupling/saturation.hpp"

namespace tandem::haptics {
namespace {

double usable(double coefficient) noexcept {
  return std::isfinite(coefficient) ? std::max(coefficient, 0.0) : 0.0;
}

}  // namespace

void RadialLaw::set_parameters(const CouplingParameters& parameters) noexcept {
  const double softness = std::min(usable(parameters.saturation_softness), 1.0);
  const double sharpness = usable(parameters.curve_sharpness);
  translation_ = {usable(parameters.stiffness_n_per_m), usable(parameters.damping_n_s_per_m),
                  usable(parameters.force_limit_n), softness, sharpness};
  rotation_ = {usable(parameters.stiffness_n_m_per_rad), usable(parameters.damping_n_m_s_per_rad),
               usable(parameters.torque_limit_n_m), softness, sharpness};
}

Wrench RadialLaw::wrench_on_tool_W(const CouplingState& state) const noexcept {
  return {pull(translation_, state.d_W, state.v_W, state.v_WH), pull(rotation_, state.theta_W, state.w_W, state.w_WH)};
}

CouplingGradient RadialLaw::gradient(const CouplingState& state) const noexcept {
  const Slopes force = slopes(translation_, state.d_W, state.v_W, state.v_WH);
  const Slopes torque = slopes(rotation_, state.theta_W, state.w_W, state.w_WH);
  return {force.by_displacement, force.by_velocity, torque.by_displacement, torque.by_velocity};
}

Vec3 RadialLaw::pull(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                     const Vec3& handle_velocity) const noexcept {
  if (channel.limit <= 0) return Vec3::Zero();
  const bool is_pushing = displacement.dot(handle_velocity) >= 0;
  const RadialStiffness stiffness = elastic(channel, polar(displacement).length, is_pushing);
  return saturated(Vec3(stiffness.secant * displacement + channel.damping * velocity), channel.limit, channel.softness);
}

RadialLaw::Slopes RadialLaw::slopes(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                                    const Vec3& handle_velocity) const noexcept {
  const bool is_pushing = displacement.dot(handle_velocity) >= 0;
  const Polar d = polar(displacement);
  if (channel.limit <= 0) return {};
  const RadialStiffness stiffness = elastic(channel, d.length, is_pushing);
  const Vec3 sum = stiffness.secant * displacement + channel.damping * velocity;
  const Eigen::Matrix3d bend = saturation_gradient(sum, channel.limit, channel.softness);
  // A root of a linear curve's gradient would only round.
  if (stiffness.slope == stiffness.secant) return {stiffness.secant * bend, channel.damping * bend};
  const Eigen::Matrix3d root = radial_gradient(d.direction, {std::sqrt(stiffness.secant), std::sqrt(stiffness.slope)});
  return {root * bend * root, channel.damping * bend};
}

}  // namespace tandem::haptics
