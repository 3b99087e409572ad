// The coupling laws: the damper and saturation that they have in common, one elastic curve for each law, and the
// catalog.
#include "common/haptics/coupling/laws.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/haptics/coupling/radial.hpp"
#include "common/haptics/coupling/saturation.hpp"

namespace tandem::haptics {

/// Coefficients for either translation (units N, m) or rotation (units N·m, rad); the fields are those of
/// CouplingParameters.
struct CouplingChannel {
  double stiffness = 0;
  double damping = 0;
  double limit = 0;
  double softness = 0;
  double sharpness = 0;
};

namespace {

// Elastic curves.
//
//   force                                        k    stiffness
//   limit ┤            . - ‾ ‾ qsa               L    limit
//         │        . ‾   _ - ‾ stable dynamic    x    displacement; the curves bend at L / k
//         │     .‾    ／                         u    k x / L
//         │   ／    ／
//       0 ┼─‾──__-‾──────────┬────── x
//         0                 L/k

/// Largest exponent that is computed. With a larger exponent, the curve equals its limit in double precision. The
/// square of a large exponent could also overflow.
constexpr double kSpent = 700;

/// Model   f = k x
/// Source  McNeely, Puterbaugh, Troy, "Six degree-of-freedom haptic rendering using voxel sampling", SIGGRAPH 1999
RadialStiffness linear_curve(const CouplingChannel& channel, double /*displacement*/, bool /*is_pushing*/) noexcept {
  return {channel.stiffness, channel.stiffness};
}

/// Curve of the quasi-static approximation (QSA).
/// * While the handle pushes, the slope is largest at zero displacement, and the force approaches the limit.
/// * While the handle recedes, the law is a linear spring, so that the tool does not stick to a surface.
/// The force jumps when the handle changes from one to the other. Receding returns more energy than pushing stored, so
/// the law is active.
///
/// Model   pushing: f = L (1 − e^(−u)), slope k at 0; receding: f = k x
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 3.10–3.14, after Wan, McNeely, "Quasi-static approximation for 6
///         degrees-of-freedom haptic rendering", IEEE Visualization 2003. The damper and the use with a tool that has
///         mass are from the thesis. For rotation we differ from the thesis:
///         * Thesis: a moment arm R gives θ_max = d_max/R and k_r = 2 R² k_t (as far as the printed formula is
///           legible).
///         * Here: k_r and T_max are parameters, and the curve bends at θ_max = T_max/k_r. With k_r as in the thesis,
///           T_max = 2 R F_max gives its curve.
///         * Reasons: a device has a separate torque limit, and R would make the rotational stiffness depend on the
///           tool's size
RadialStiffness qsa_curve(const CouplingChannel& channel, double displacement, bool is_pushing) noexcept {
  const double u = channel.stiffness * displacement / channel.limit;
  if (!is_pushing || !(u > 0)) return linear_curve(channel, displacement, is_pushing);
  if (u > kSpent) return {channel.limit / displacement, 0};
  return {channel.stiffness * (-std::expm1(-u) / u), channel.stiffness * std::exp(-u)};
}

/// Single-valued curve: pushing and receding have the same force. It is flat at zero displacement, so that the user
/// does not feel the jitter of a light tool. Then it becomes steep, and finally it approaches the limit.
///
/// Model   f = L (1 − e^(−c u²)): slope 0 at 0; largest slope √(2c/e) k = 0.86 √c k at u = 1/√(2c); f = 0.63 L at u =
///         1/√c
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 4.3, 4.7. The printed formula contains a single 2 beside u, which we read
///         as the exponent of u. Read as a factor, it would not give the flat beginning that the text describes. Read
///         as both, it would mean c = 2. In the thesis, the receding force follows k x
///         (literal_stable_dynamic_curve()), which creates energy. We use one curve in both directions, which is
///         passive
RadialStiffness stable_dynamic_curve(const CouplingChannel& channel, double displacement,
                                     bool /*is_pushing*/) noexcept {
  const double u = channel.stiffness * displacement / channel.limit;
  if (!(u > 0)) return {};
  const double exponent = channel.sharpness * u * u;
  if (exponent > kSpent) return {channel.limit / displacement, 0};
  return {channel.stiffness * (-std::expm1(-exponent) / u),
          2 * channel.sharpness * u * channel.stiffness * std::exp(-exponent)};
}

/// Curve as printed in the thesis: while the handle recedes, the force is that of a linear spring.
///
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 4.4, 4.5
RadialStiffness literal_stable_dynamic_curve(const CouplingChannel& channel, double displacement,
                                             bool is_pushing) noexcept {
  return is_pushing ? stable_dynamic_curve(channel, displacement, is_pushing)
                    : linear_curve(channel, displacement, is_pushing);
}

double slope_of_linear(const CouplingParameters& /*parameters*/) noexcept {
  return 1;
}
double slope_of_stable_dynamic(const CouplingParameters& parameters) noexcept {
  return std::sqrt(2 * parameters.curve_sharpness / std::numbers::e);
}
double slope_of_literal(const CouplingParameters& parameters) noexcept {
  return std::max(1.0, slope_of_stable_dynamic(parameters));
}

double usable(double coefficient) noexcept {
  return std::isfinite(coefficient) ? std::max(coefficient, 0.0) : 0.0;
}

/// Derivatives of a force or torque with respect to displacement and velocity.
struct Slopes {
  Eigen::Matrix3d by_displacement = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d by_velocity = Eigen::Matrix3d::Zero();
};

/// Law of the form f = S(e(|d|) d̂ + b v), with the displacement d, its direction d̂, and the velocity v of the handle
/// relative to the tool. e is the law's non-decreasing elastic curve, b the damping, and S is saturated() with the
/// limit F_max and the softness ε. The torque is the same function of the rotation θ and the angular velocity ω.
///
/// Model   Passivity: S is the gradient of a convex function, so (S(e + b v) − S(e))·v ≥ 0. The damper therefore
///         dissipates even if the limit bends the sum. The elastic part stores the integral of S(e), a function of |d|
///         alone. For rotation d|θ|/dt = θ̂·ω, so the same proof holds for the torque.
///         Largest force: a curve that reaches its limit L gives the force L (1 − ε exp(−1)), which is 0.926 L at ε =
///         0.2. The damper may use the rest up to L.
///         Gradient: with K = radial_gradient() of e and G = saturation_gradient(), ∂f/∂d = K^½ G K^½, which has the
///         eigenvalues of the exact G K. ∂f/∂v = b G is exact
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 3.4, 3.5, 5.10: the saturation applies to the total force of spring and
///         damper. Gradient and proof of passivity are our derivation
/// Cost    no allocation; `tandem-lab bench coupling`
class RadialLaw final : public CouplingLaw {
 public:
  RadialLaw(const CouplingLawInfo& info, const CouplingParameters& parameters) noexcept
      : name_(info.name), tool_(info.tool), elastic_(info.elastic) {
    RadialLaw::set_parameters(parameters);
  }
  std::string_view name() const noexcept override { return name_; }
  ToolDynamics tool_dynamics() const noexcept override { return tool_; }
  /// Sets the coefficients. A negative or non-finite coefficient is replaced by 0, because the polynomial of an
  /// adaptive fit may return such values.
  void set_parameters(const CouplingParameters& parameters) noexcept override;
  Wrench wrench_on_tool_W(const CouplingState& state) const noexcept override;
  CouplingGradient gradient(const CouplingState& state) const noexcept override;

 private:
  Vec3 force(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
             const Vec3& handle_velocity) const noexcept;
  Slopes slopes(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                const Vec3& handle_velocity) const noexcept;

  std::string_view name_;
  ToolDynamics tool_;
  RadialStiffness (*elastic_)(const CouplingChannel&, double, bool) noexcept;
  CouplingChannel translation_;
  CouplingChannel rotation_;
};

void RadialLaw::set_parameters(const CouplingParameters& parameters) noexcept {
  const double softness = std::min(usable(parameters.saturation_softness), 1.0);
  const double sharpness = usable(parameters.curve_sharpness);
  translation_ = {usable(parameters.stiffness_n_per_m), usable(parameters.damping_n_s_per_m),
                  usable(parameters.force_limit_n), softness, sharpness};
  rotation_ = {usable(parameters.stiffness_n_m_per_rad), usable(parameters.damping_n_m_s_per_rad),
               usable(parameters.torque_limit_n_m), softness, sharpness};
}

Wrench RadialLaw::wrench_on_tool_W(const CouplingState& state) const noexcept {
  return {force(translation_, state.d_W, state.v_W, state.v_WH),
          force(rotation_, state.theta_W, state.w_W, state.w_WH)};
}

CouplingGradient RadialLaw::gradient(const CouplingState& state) const noexcept {
  const Slopes translation = slopes(translation_, state.d_W, state.v_W, state.v_WH);
  const Slopes rotation = slopes(rotation_, state.theta_W, state.w_W, state.w_WH);
  return {translation.by_displacement, translation.by_velocity, rotation.by_displacement, rotation.by_velocity};
}

Vec3 RadialLaw::force(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                      const Vec3& handle_velocity) const noexcept {
  if (channel.limit <= 0) return Vec3::Zero();
  const bool is_pushing = displacement.dot(handle_velocity) >= 0;
  const RadialStiffness stiffness = elastic_(channel, polar(displacement).length, is_pushing);
  return saturated(Vec3(stiffness.secant * displacement + channel.damping * velocity), channel.limit, channel.softness);
}

Slopes RadialLaw::slopes(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                         const Vec3& handle_velocity) const noexcept {
  const bool is_pushing = displacement.dot(handle_velocity) >= 0;
  const Polar d = polar(displacement);
  if (channel.limit <= 0) return {};
  const RadialStiffness stiffness = elastic_(channel, d.length, is_pushing);
  const Vec3 sum = stiffness.secant * displacement + channel.damping * velocity;
  const Eigen::Matrix3d bend = saturation_gradient(sum, channel.limit, channel.softness);
  // For a linear curve K is a multiple of the identity; the general formula with its square root would only add
  // rounding errors.
  if (stiffness.slope == stiffness.secant) return {stiffness.secant * bend, channel.damping * bend};
  const Eigen::Matrix3d root = radial_gradient(d.direction, {std::sqrt(stiffness.secant), std::sqrt(stiffness.slope)});
  return {root * bend * root, channel.damping * bend};
}

/// Law without a coupling: the tool is at the handle, and the contact wrench is displayed directly. The caller
/// saturates the contact wrench with the same limits and softness as the force of a coupling.
///
/// Source  "direct rendering" in Hou, PhD thesis, NTU, 2014, ch. 2. The thesis argues against it; it serves as the
///         baseline of comparisons
class DirectRendering final : public CouplingLaw {
 public:
  explicit DirectRendering(const CouplingLawInfo& info) noexcept : name_(info.name) {}
  std::string_view name() const noexcept override { return name_; }
  void set_parameters(const CouplingParameters& /*parameters*/) noexcept override {}
  Wrench wrench_on_tool_W(const CouplingState& /*state*/) const noexcept override { return {}; }
  CouplingGradient gradient(const CouplingState& /*state*/) const noexcept override { return {}; }
  ToolDynamics tool_dynamics() const noexcept override { return ToolDynamics::kAtHandle; }

 private:
  std::string_view name_;
};

/// Catalog of all laws. The adaptive law is the linear law under another name, by which a scene can select it. Its
/// coefficients depend on the tool's mass, so the caller computes them with adapted() (adaptive.hpp).
constexpr std::array kLaws{
    CouplingLawInfo{kDefaultCouplingLaw, true, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-c (d/d_max)^2)) + b v, d_max = F_max/k, one curve both ways",
                    "Hou, PhD thesis, NTU, 2014, eqs. 4.1-4.8, made single-valued",
                    "a heavy tool sags more than on a linear spring; around zero only the damper holds",
                    &stable_dynamic_curve, &slope_of_stable_dynamic},
    CouplingLawInfo{
        "spring-damper", true, ToolDynamics::kWithMass, "f = k d + b v", "McNeely, Puterbaugh, Troy, SIGGRAPH 1999",
        "one stiffness for light touch and firm grip; a light tool buzzes", &linear_curve, &slope_of_linear},
    CouplingLawInfo{kAdaptiveLaw, true, ToolDynamics::kWithMass, "f = k(m) d + b(k) v",
                    "Hou, PhD thesis, NTU, 2014, eqs. 5.1-5.16",
                    "needs a calibration of the device; outside its masses the nearest end counts", &linear_curve,
                    &slope_of_linear},
    CouplingLawInfo{"qsa-static", false, ToolDynamics::kMassless,
                    "f = F_max (1 - exp(-d/d_max)) + b v pushing, k d + b v receding",
                    "Wan, McNeely, IEEE Visualization 2003, as in Hou, PhD thesis, NTU, 2014, eqs. 3.10-3.14",
                    "no weight and no inertia to feel; a room sets b = 0 while the tool holds nothing; the force jumps "
                    "when the hand turns",
                    &qsa_curve, &slope_of_linear},
    CouplingLawInfo{"qsa-dynamic", false, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-d/d_max)) + b v pushing, k d + b v receding",
                    "Hou, PhD thesis, NTU, 2014, ch. 4: the curve of 3.10-3.14 on a tool with mass",
                    "a light tool buzzes; the force jumps when the hand turns", &qsa_curve, &slope_of_linear},
    CouplingLawInfo{"stable-dynamic-literal", false, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-c (d/d_max)^2)) + b v pushing, k d + b v receding",
                    "Hou, PhD thesis, NTU, 2014, eqs. 4.1-4.8, as printed",
                    "for comparison: gives back more than was put in; the force jumps when the hand turns or trembles",
                    &literal_stable_dynamic_curve, &slope_of_literal},
    CouplingLawInfo{"direct", false, ToolDynamics::kAtHandle, "none: the hand is shown the contact force",
                    "Hou, PhD thesis, NTU, 2014, ch. 2: the baseline it argues against",
                    "for comparison: contact as stiff as it is, through one period of delay; no tool dynamics"},
};

}  // namespace

std::unique_ptr<CouplingLaw> CouplingLawInfo::make(const CouplingParameters& parameters) const {
  if (elastic == nullptr) return std::make_unique<DirectRendering>(*this);
  return std::make_unique<RadialLaw>(*this, parameters);
}

std::span<const CouplingLawInfo> coupling_laws() noexcept {
  return kLaws;
}

const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept {
  if (name.empty()) name = kDefaultCouplingLaw;
  for (const CouplingLawInfo& law : kLaws) {
    if (law.name == name) return &law;
  }
  return nullptr;
}

std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters) {
  const CouplingLawInfo* law = find_coupling_law(name);
  return law == nullptr ? nullptr : law->make(parameters);
}

std::string listed_coupling_law_names() {
  std::string text;
  for (const CouplingLawInfo& law : kLaws) text.append(text.empty() ? "" : ", ").append(law.name);
  return text;
}

std::string law_change_problem(const CouplingLawInfo& of_scene, const CouplingLawInfo& wanted, bool has_fit) {
  if (&wanted == &of_scene) return {};
  if (!are_exchangeable(of_scene, wanted)) {
    const CouplingLawInfo& other = of_scene.tool == ToolDynamics::kWithMass ? wanted : of_scene;
    return "the tool of the law " + std::string(other.name) +
           (other.tool == ToolDynamics::kMassless ? " has no mass" : " is where the handle is") +
           ", so a change would move tools by a step; name the law in the scene's file";
  }
  if (!wanted.is_passive) {
    return "the law " + std::string(wanted.name) +
           " can create energy, and its force jumps when a hand turns: a user cannot choose it for the hands of other "
           "users; name the law in the scene's file";
  }
  if (wanted.name == kAdaptiveLaw && !has_fit) {
    return "the law adaptive needs the fit of a device, which this scene has not; name law and fit in the scene's file";
  }
  return {};
}

double steepest_slope_factor(std::string_view law, const CouplingParameters& parameters) noexcept {
  const CouplingLawInfo* info = find_coupling_law(law);
  if (info == nullptr) return 1;
  return info->steepest == nullptr ? 0 : info->steepest(parameters);
}

}  // namespace tandem::haptics
