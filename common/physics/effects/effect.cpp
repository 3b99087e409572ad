#include "common/physics/effects/effect.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tandem::physics {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Limit of the stiffness of an effect with a spring, as a fraction of m/h² (mass m, step h). A sampled spring with its
/// damper is passive up to m/h². The limit is half of that, because the regions of two such effects may overlap.
constexpr double kStiffestShare = 0.5;

/// State of a tool in the effect's frame E.
struct Probe {
  const EffectInput* input = nullptr;
  Vec3 p_E;
  Vec3 v_E;
  Vec3 w_E;
  Vec3 normal_E;
  double strength = 0;
  bool in_contact = false;

  double stiffest_n_per_m() const { return kStiffestShare * input->mass_kg / (input->step_s * input->step_s); }
  /// Returns the predicted displacement of the tool after the fraction `share` of the step. It is zero for a massless
  /// tool, for which the forces are evaluated at the present position.
  Vec3 ahead_E(double share) const {
    return input->is_massless ? Vec3(Vec3::Zero()) : Vec3(share * input->step_s * v_E);
  }
};

/// Returns a smooth function that rises from 0 at x = 0 to 1 at x = 1 and has zero slope at both ends.
double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Returns the vector to `p` from the nearest point of a block. The block has half edges `half` and its centre at the
/// origin.
Vec3 off_block(const Vec3& p, const Vec3& half) {
  return p - p.cwiseMax(-half).cwiseMin(half);
}

double outside_m(std::monostate /*everywhere*/, const Vec3& /*p_E*/) {
  return 0;
}
double outside_m(const BoxRegion& region, const Vec3& p_E) {
  return off_block(p_E, region.size_m / 2).norm();
}
double outside_m(const SphereRegion& region, const Vec3& p_E) {
  return std::max(0.0, p_E.norm() - region.radius_m);
}

/// Limits a damping to the value that just stops a free mass within the step, because a larger value would reverse the
/// motion. Without the limit in effect, the force is exactly damping times speed.
double bounded_damping(double damping, double step_s, double inertia) {
  return std::min(damping, inertia / step_s);
}

Wrench wrench_of(const Viscosity& model, const Probe& probe, EffectMemory& /*memory*/) {
  const EffectInput& input = *probe.input;
  const double b = bounded_damping(probe.strength * model.damping_n_s_per_m, input.step_s, input.mass_kg);
  const double c = bounded_damping(probe.strength * model.damping_n_m_s_per_rad, input.step_s, input.inertia_kg_m2);
  return {-b * probe.v_E, -c * probe.w_E};
}

Wrench wrench_of(const ConstantField& model, const Probe& probe, EffectMemory& /*memory*/) {
  return {probe.strength * model.force_n, Vec3::Zero()};
}

/// Magnet with the potential U = −U₀ (1 − s²)³, s = r/R, where r is the distance from the core and R the range. The
/// force towards the core is f = k (1 − s²)² r with k = 6 U₀/R². It is largest at s = 1/√5.
Wrench wrench_of(const Magnet& model, const Probe& probe, EffectMemory& /*memory*/) {
  constexpr double kPeak = 0.28621670111997307;  // 16/(25√5)
  const Vec3 off = off_block(probe.p_E + probe.ahead_E(0.5), model.core_size_m / 2);
  const double inside = 1 - (off / model.range_m).squaredNorm();
  if (!(inside > 0)) return {};
  const double k = std::min(model.peak_force_n / (kPeak * model.range_m), probe.stiffest_n_per_m());
  return {-k * inside * inside * off, Vec3::Zero()};
}

Wrench wrench_of(const Vibration& model, const Probe& probe, EffectMemory& memory) {
  const double since_s = probe.input->time_s - memory.inside_since_s;
  const bool rings = model.decay_s > 0;
  // A decaying vibration starts with phase zero at each entry. A continuous one has the same phase for all tools.
  const double phase = kTurn * model.frequency_hz * (rings ? since_s : probe.input->time_s);
  const double amplitude = model.amplitude_n * (rings ? std::exp(-since_s / model.decay_s) : 1);
  return {probe.strength * amplitude * std::sin(phase) * model.direction.normalized(), Vec3::Zero()};
}

/// Returns the force along one axis of the potential N a sin(2π x/λ), with the normal force N, the amplitude a and the
/// wavelength λ. The force is averaged over the tool's path in the coming step. If the tool passes bumps faster than it
/// is sampled, the mean fades to zero, whereas a point sample would alias to another frequency.
double slope_force_n(double height_m, double period_m, double middle_m, double way_m, double normal_force_n,
                     double stiffest) {
  const double q = kTurn / period_m;
  const double stiffness = normal_force_n * height_m * q * q;
  const double half = 0.5 * q * way_m;
  const double fading = std::abs(half) < 1e-6 ? 1 : std::sin(half) / half;
  const double share = stiffness > stiffest ? stiffest / stiffness : 1;
  return -share * normal_force_n * height_m * q * std::cos(q * middle_m) * fading;
}

Wrench wrench_of(const Texture& model, const Probe& probe, EffectMemory& /*memory*/) {
  const Vec3 way_E = probe.input->step_s * probe.v_E;
  const Vec3 middle_E = probe.p_E + probe.ahead_E(0.5);
  const double pressed_n = probe.strength * probe.input->normal_force_n;
  const double stiffest = probe.stiffest_n_per_m();
  Vec3 f_E = Vec3::Zero();
  f_E.x() = slope_force_n(model.height_m, model.period_x_m, middle_E.x(), way_E.x(), pressed_n, stiffest);
  if (model.period_y_m > 0) {
    f_E.y() = slope_force_n(model.height_m, model.period_y_m, middle_E.y(), way_E.y(), pressed_n, stiffest);
  }
  return {f_E - probe.normal_E * probe.normal_E.dot(f_E), Vec3::Zero()};
}

/// Stick-slip: a spring from the tool to an anchor. The strength of the effect scales the breakaway force, but not the
/// stiffness: a spring that becomes stiffer while it is stretched would create energy.
Wrench wrench_of(const StickSlip& model, const Probe& probe, EffectMemory& memory) {
  const auto along_surface = [&probe](const Vec3& a) -> Vec3 {
    return probe.in_contact ? Vec3(a - probe.normal_E * probe.normal_E.dot(a)) : a;
  };
  const double k = std::min(model.stiffness_n_per_m, probe.stiffest_n_per_m());
  Vec3 stretch = along_surface(probe.p_E - memory.anchor_E);
  // The stiffness is limited by the effective mass. If this mass grows while the tool sticks, the stiffness increases.
  // The stretch is then scaled down so that the stored energy is unchanged.
  if (memory.stiffness_n_per_m > 0 && memory.stiffness_n_per_m < k) stretch *= std::sqrt(memory.stiffness_n_per_m / k);
  const double holds_n = probe.strength * model.breakaway_force_n;
  if (k * stretch.norm() > holds_n) stretch = clamped_to_length(stretch, probe.strength * model.slip_force_n / k);
  memory.anchor_E = probe.p_E - stretch;
  memory.stiffness_n_per_m = k;
  const Vec3 ahead = stretch + along_surface(probe.ahead_E(1));
  return {-clamped_to_length(k * ahead, holds_n), Vec3::Zero()};
}

bool is_usable(const EffectInput& input) {
  const bool is_positive = input.step_s > 0 && input.mass_kg > 0 && input.inertia_kg_m2 > 0;
  return is_positive && std::isfinite(input.time_s) && std::isfinite(input.step_s) && std::isfinite(input.mass_kg) &&
         std::isfinite(input.inertia_kg_m2) && std::isfinite(input.normal_force_n) && is_finite(input.normal_O) &&
         is_finite(input.p_OT) && is_finite(input.V_OT);
}

}  // namespace

Effect::Effect(const EffectSettings& settings) : settings_(settings), X_EO_(settings.X_OE.inverse()) {
  if (const std::string problem = find_problem(settings); !problem.empty()) {
    throw std::invalid_argument("effect: " + problem);
  }
}

double Effect::strength(const Vec3& p_E, double normal_force_n) const noexcept {
  const double outside = std::visit([&p_E](const auto& region) { return outside_m(region, p_E); }, settings_.region);
  const double in_region = smooth_step(1 - outside / settings_.fade_m);
  return settings_.in_contact ? in_region * smooth_step(normal_force_n / settings_.full_contact_n) : in_region;
}

Viscosity Effect::damping(const EffectInput& input) const noexcept {
  const auto* fluid = std::get_if<Viscosity>(&settings_.model);
  if (fluid == nullptr || !is_usable(input)) return {0, 0};
  const double w = strength(X_EO_ * input.p_OT, input.normal_force_n);
  return {w * fluid->damping_n_s_per_m, w * fluid->damping_n_m_s_per_rad};
}

Wrench Effect::wrench_on_tool_O(const EffectInput& input, EffectMemory& memory) const noexcept {
  if (!is_usable(input)) {
    memory = EffectMemory{};
    return {};
  }
  const Quat& q_EO = X_EO_.q;
  Probe probe{&input, X_EO_ * input.p_OT,  q_EO * input.V_OT.v, q_EO * input.V_OT.w, q_EO * input.normal_O,
              0,      settings_.in_contact};
  probe.strength = strength(probe.p_E, input.normal_force_n);
  if (!(probe.strength > 0)) {
    memory = EffectMemory{};
    return {};
  }
  if (!memory.is_inside) memory = {true, input.time_s, probe.p_E, 0};
  const Wrench wrench_E =
      std::visit([&](const auto& model) { return wrench_of(model, probe, memory); }, settings_.model);
  if (!is_finite(memory.anchor_E)) memory = EffectMemory{};
  const Quat& q_OE = settings_.X_OE.q;
  return {q_OE * clamped_to_length(wrench_E.f, settings_.force_limit_n),
          q_OE * clamped_to_length(wrench_E.t, settings_.torque_limit_n_m)};
}

}  // namespace tandem::physics
