#include "lab/studies/rendering/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "lab/studies/conventions.hpp"
#include "lab/studies/rendering/polynomial_fit.hpp"

namespace tandem::lab {
namespace {

constexpr int kMasses = 8;
constexpr double kLightest_kg = 0.02;
constexpr double kHeaviest_kg = 2;
constexpr double kShareOfLimitToHold = 0.8;
/// Smallest tried stiffness, as a fraction of the largest.
constexpr double kSoftest = 1.0 / 64;
/// Number of bisections of the interval on a logarithmic scale. The resolution is 64^(1/128), i.e. 3 %.
constexpr int kBisections = 7;
/// Damping is searched in two rounds: first over kDampings values, then over kFinerDampings values between the
/// neighbours of the best value.
constexpr int kDampings = 9;
constexpr int kFinerDampings = 3;
constexpr double kMinDamping = 1.0 / 64;
/// Factor by which the roughness of a calibration point may exceed its limit if the point uses the fitted stiffness and
/// damping instead of the best ones. The same factor applies to the motion of a resting handle.
constexpr double kFitTolerance = 1.1;
/// Bounds for a fitted pair; both are our choice. The fitted stiffness is at least kMinShareOfStiffness times the best
/// one. The fitted damping differs from the best one by at most the factor kMaxOfDamping, upwards or downwards.
constexpr double kMinShareOfStiffness = 0.5;
constexpr double kMaxOfDamping = 2;
constexpr int kProbes = 64;
/// Factor below 1, so that a value does not exceed the maximum after it is rounded to 12 digits.
constexpr double kBelowMost = 1 - 1e-9;

/// Rounds to 12 significant digits. Even JSON readers that are not exact to the last bit reproduce such a number.
double rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return std::strtod(text, nullptr);
}

void round(haptics::AdaptiveFit& fit) {
  for (double* const value : {&fit.mass_low_kg, &fit.mass_high_kg, &fit.inertia_low_kg_m2, &fit.inertia_high_kg_m2}) {
    *value = rounded(*value);
  }
  for (haptics::Cubic* const cubic :
       {&fit.stiffness_n_per_m, &fit.damping_n_s_per_m, &fit.stiffness_n_m_per_rad, &fit.damping_n_m_s_per_rad}) {
    for (double& coefficient : cubic->c) coefficient = rounded(coefficient);
  }
}

std::vector<double> default_masses(const devices::DeviceProfile& profile) {
  const double held_kg = kShareOfLimitToHold * profile.spec.force_limit_n / kGravity_m_per_s2;
  const double heaviest_kg = std::clamp(held_kg, 2 * kLightest_kg, kHeaviest_kg);
  std::vector<double> masses;
  for (int i = 0; i < kMasses; ++i) {
    masses.push_back(kLightest_kg * std::pow(heaviest_kg / kLightest_kg, i / (kMasses - 1.0)));
  }
  return masses;
}

std::vector<double> checked_masses(const devices::DeviceProfile& profile, const CalibrationSettings& settings) {
  if (settings.masses_kg.empty()) return default_masses(profile);
  double before = 0;
  for (const double mass : settings.masses_kg) {
    if (!(mass >= 0.001 && mass <= 100 && mass > before)) {
      throw std::invalid_argument("masses: " + std::to_string(mass) +
                                  " kg; they must be increasing, from 0.001 to 100 kg");
    }
    before = mass;
  }
  return settings.masses_kg;
}

/// Calibrates one axis: finds its points and then fits the polynomials.
class AxisCalibrator {
 public:
  AxisCalibrator(const devices::DeviceProfile& profile, bool is_rotation, const CalibrationSettings& settings,
                 std::function<void(double)> on_progress)
      : trial_(profile, is_rotation, settings),
        name_(profile.name),
        is_rotation_(is_rotation),
        settings_(settings),
        masses_kg_(checked_masses(profile, settings)),
        on_progress_(std::move(on_progress)) {
    const haptics::CouplingParameters most = devices::coupling_bounds(profile);
    result_.stiffness_maximum = is_rotation ? most.stiffness_n_m_per_rad : most.stiffness_n_per_m;
    result_.is_maximum_verified =
        devices::is_verified(is_rotation ? profile.stiffness_maximum_n_m_per_rad : profile.stiffness_maximum_n_per_m);
    result_.damping_maximum = is_rotation ? most.damping_n_m_s_per_rad : most.damping_n_s_per_m;
  }

  AxisCalibration run() {
    find_stiffnesses();
    fit_stiffness();
    find_dampings();
    fit_damping();
    judge_fit();
    return std::move(result_);
  }

 private:
  double inertia_of(double mass_kg) const {
    return is_rotation_ ? mass_kg * settings_.gyration_radius_m * settings_.gyration_radius_m : mass_kg;
  }
  double roughness_allowed(double mass_kg) const {
    const double force_n = settings_.roughness_floor_n + settings_.roughness_share_of_weight * weight_n(mass_kg);
    return is_rotation_ ? force_n * settings_.gyration_radius_m : force_n;
  }
  /// Returns the damping with which the stiffness is searched. It is the larger of two values:
  /// * stiffness × period: dissipates the energy that sampling generates while the hand moves slowly;
  /// * 1.4 √(stiffness × inertia): gives the fastest settling in continuous time.
  double first_damping(double stiffness, double inertia) const {
    const double wanted = std::max(stiffness / settings_.rate_hz, 1.4 * std::sqrt(stiffness * inertia));
    return std::min(wanted, result_.damping_maximum);
  }
  void find_stiffnesses();
  /// Searches the largest stiffness for a mass. Returns false if even the smallest tried stiffness violates a
  /// criterion.
  bool find_stiffness(CalibrationPoint& point) const;
  std::string why_left_out() const;
  /// Returns the name of the first violated criterion, or an empty text if none is violated. Records the measured
  /// values in `point`.
  /// In      share  fraction of the permitted roughness that may be used
  std::string_view objection(CalibrationPoint& point, double share) const;
  void fit_stiffness();
  void find_dampings();
  void find_damping(CalibrationPoint& point) const;
  void fit_damping();
  void judge_fit();
  void advance(double share) const { on_progress_(std::min(share, 1.0)); }

  CouplingTrial trial_;
  std::string name_;
  bool is_rotation_;
  CalibrationSettings settings_;
  std::vector<double> masses_kg_;
  std::function<void(double)> on_progress_;
  AxisCalibration result_;
};

// Evaluates the cheapest criterion first, so that most rejected pairs need no simulation of hands.
std::string_view AxisCalibrator::objection(CalibrationPoint& point, double share) const {
  point.spectral_radius = trial_.spectral_radius(point.best, point.inertia);
  if (!(point.spectral_radius < 1)) return "stability";
  point.restlessness = trial_.restlessness(point.best, point.inertia);
  if (!(point.restlessness <= settings_.restlessness_steps)) return "rest";
  point.roughness = trial_.roughness(point.best, point.inertia);
  if (!(point.roughness <= share * point.roughness_allowed)) return "quiet";
  return "";
}

/// Searches by bisection. This is possible because the measured values of all three criteria increase with the
/// stiffness, except for a scatter of the roughness of about 10 %.
bool AxisCalibrator::find_stiffness(CalibrationPoint& point) const {
  const auto tried = [&](double stiffness) {
    point.first_damping = first_damping(stiffness, point.inertia);
    point.best = {stiffness, point.first_damping};
    return objection(point, settings_.stiffness_share_of_roughness);
  };
  point.limited_by = tried(result_.stiffness_maximum);
  if (point.limited_by.empty()) {
    point.limited_by = result_.is_maximum_verified ? "maximum" : "cap";
    return true;
  }
  double low = kSoftest * result_.stiffness_maximum;
  double high = result_.stiffness_maximum;
  const std::string_view wrong_with_softest = tried(low);
  if (!wrong_with_softest.empty()) {
    point.limited_by = wrong_with_softest;
    return false;
  }
  for (int i = 0; i < kBisections; ++i) {
    const double middle = std::sqrt(low * high);
    const std::string_view wrong = tried(middle);
    (wrong.empty() ? low : high) = middle;
    if (!wrong.empty()) point.limited_by = wrong;
  }
  tried(low);
  return true;
}

std::string AxisCalibrator::why_left_out() const {
  std::string text;
  for (const CalibrationPoint& point : result_.left_out) {
    text += (text.empty() ? "" : ", ") + std::to_string(point.mass_kg) + " kg (" + std::string(point.limited_by) + ")";
  }
  return text;
}

void AxisCalibrator::find_stiffnesses() {
  for (std::size_t i = 0; i < masses_kg_.size(); ++i) {
    CalibrationPoint point;
    point.mass_kg = masses_kg_[i];
    point.inertia = inertia_of(point.mass_kg);
    point.roughness_allowed = roughness_allowed(point.mass_kg);
    const bool is_found = find_stiffness(point);
    (is_found ? result_.points : result_.left_out).push_back(point);
    advance(0.6 * static_cast<double>(i + 1) / static_cast<double>(masses_kg_.size()));
    // The stiffness has reached its maximum and stays there for larger masses. For these, the adaptive law uses the
    // value of the last point, so no more points are needed.
    if (is_found && point.best.stiffness == result_.stiffness_maximum) break;
  }
  if (!result_.points.empty()) return;
  throw std::invalid_argument("device " + name_ + ": even " + std::to_string(kSoftest * result_.stiffness_maximum) +
                              (is_rotation_ ? " N·m/rad" : " N/m") + " is too much for each of the tools of " +
                              why_left_out() + "; try heavier masses, or check steps and damping of the profile");
}

std::vector<double> column(const std::vector<CalibrationPoint>& points, double (*of)(const CalibrationPoint&)) {
  std::vector<double> values;
  for (const CalibrationPoint& point : points) values.push_back(of(point));
  return values;
}

/// Returns kProbes + 1 values of `cubic` from `low` to `high`.
std::vector<double> probed(const haptics::Cubic& cubic, double low, double high) {
  std::vector<double> values;
  for (int i = 0; i <= kProbes; ++i) values.push_back(cubic(low + (high - low) * i / kProbes));
  return values;
}

/// Returns `cubic` multiplied by a factor of at most 1, such that two bounds hold: at each x[i] its value is at most
/// cap[i], and over the whole range it is at most `most`.
haptics::Cubic lowered(haptics::Cubic cubic, const std::vector<double>& x, const std::vector<double>& cap,
                       double most) {
  double share = 1;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (cubic(x[i]) > cap[i]) share = std::min(share, cap[i] / cubic(x[i]));
  }
  for (const double value : probed(cubic, x.front(), x.back())) {
    if (value > most) share = std::min(share, kBelowMost * most / value);
  }
  for (double& coefficient : cubic.c) coefficient *= share;
  return cubic;
}

void AxisCalibrator::fit_stiffness() {
  const std::vector<double> x = column(result_.points, [](const CalibrationPoint& p) { return p.inertia; });
  const std::vector<double> k = column(result_.points, [](const CalibrationPoint& p) { return p.best.stiffness; });
  const auto is_allowed = [&](const haptics::Cubic& cubic) {
    const std::vector<double> values = probed(lowered(cubic, x, k, result_.stiffness_maximum), x.front(), x.back());
    return values.front() > 0 && std::ranges::is_sorted(values);
  };
  const ChosenFit fit = chosen_fit(x, k, is_allowed);
  result_.stiffness_degree = fit.degree;
  result_.stiffness = lowered(fit.cubic, x, k, result_.stiffness_maximum);
}

/// Searches the damping of a point. Damping values are tried in the order of increasing settling time, until a pair
/// meets the criteria "stability", "rest" and "quiet".
void AxisCalibrator::find_damping(CalibrationPoint& point) const {
  struct Tried {
    double damping, cost;
  };
  std::vector<Tried> all;
  const auto cost_of = [&](double damping) {
    all.push_back({damping, trial_.settling_cost({point.best.stiffness, damping}, point.inertia)});
  };
  const double low = std::min(std::max(point.best.stiffness / settings_.rate_hz, kMinDamping * result_.damping_maximum),
                              result_.damping_maximum);
  const double ratio = std::pow(result_.damping_maximum / low, 1.0 / (kDampings - 1));
  for (int i = 0; i < kDampings; ++i) cost_of(std::min(low * std::pow(ratio, i), result_.damping_maximum));
  const double best = std::ranges::min_element(all, {}, &Tried::cost)->damping;
  for (int i = -kFinerDampings; i <= kFinerDampings; ++i) {
    const double finer = best * std::pow(ratio, static_cast<double>(i) / (kFinerDampings + 1));
    if (i != 0 && finer >= low && finer <= result_.damping_maximum) cost_of(finer);
  }
  std::ranges::sort(all, {}, &Tried::cost);
  const CalibrationPoint before = point;
  for (const Tried& tried : all) {
    point.best.damping = tried.damping;
    if (objection(point, 1).empty()) return;
  }
  point = before;  // keeps the damping from the search for the stiffness
}

void AxisCalibrator::find_dampings() {
  for (std::size_t i = 0; i < result_.points.size(); ++i) {
    find_damping(result_.points[i]);
    advance(0.6 + 0.3 * static_cast<double>(i + 1) / static_cast<double>(result_.points.size()));
  }
}

void AxisCalibrator::fit_damping() {
  std::vector<CalibrationPoint> by_stiffness = result_.points;
  std::ranges::sort(by_stiffness, {}, [](const CalibrationPoint& p) { return p.best.stiffness; });
  const std::vector<double> k = column(by_stiffness, [](const CalibrationPoint& p) { return p.best.stiffness; });
  const std::vector<double> b = column(by_stiffness, [](const CalibrationPoint& p) { return p.best.damping; });
  const std::vector<double> most(k.size(), result_.damping_maximum);
  const auto is_allowed = [&](const haptics::Cubic& cubic) {
    return std::ranges::min(probed(lowered(cubic, k, most, result_.damping_maximum), k.front(), k.back())) > 0;
  };
  const ChosenFit fit = chosen_fit(k, b, is_allowed);
  result_.damping_degree = fit.degree;
  result_.damping = lowered(fit.cubic, k, most, result_.damping_maximum);
}

void AxisCalibrator::judge_fit() {
  for (CalibrationPoint& point : result_.points) {
    point.fitted.stiffness = result_.stiffness(point.inertia);
    point.fitted.damping = result_.damping(point.fitted.stiffness);
    point.fitted_spectral_radius = trial_.spectral_radius(point.fitted, point.inertia);
    point.fitted_restlessness = trial_.restlessness(point.fitted, point.inertia);
    point.fitted_roughness = trial_.roughness(point.fitted, point.inertia);
  }
  advance(1);
}

/// Worst values over all points of an axis.
struct Worst {
  double radius = 0;
  double stiffness = 0;
  double rest = 0;
  double roughness = 0;
  double share_of_stiffness = INFINITY;
  double least_damping = INFINITY;
  double most_damping = 0;
};

Worst worst_of(const AxisCalibration& axis) {
  Worst worst;
  for (const CalibrationPoint& point : axis.points) {
    worst.radius = std::max(worst.radius, point.fitted_spectral_radius);
    worst.stiffness = std::max(worst.stiffness, point.fitted.stiffness / axis.stiffness_maximum);
    worst.rest = std::max(worst.rest, point.fitted_restlessness);
    worst.roughness = std::max(worst.roughness, point.fitted_roughness / point.roughness_allowed);
    worst.share_of_stiffness = std::min(worst.share_of_stiffness, point.fitted.stiffness / point.best.stiffness);
    worst.least_damping = std::min(worst.least_damping, point.fitted.damping / point.best.damping);
    worst.most_damping = std::max(worst.most_damping, point.fitted.damping / point.best.damping);
  }
  return worst;
}

void add_checks(const AxisCalibration& axis, const CalibrationSettings& settings, const std::string& scope,
                std::vector<Check>& checks) {
  const Worst worst = worst_of(axis);
  const auto add = [&](const char* claim, double value, Relation relation, double bound, int decimals) {
    checks.push_back({scope, claim, value, relation, bound, "", decimals});
  };
  add("largest spectral radius, with gain and delay margin", worst.radius, Relation::kBelow, 1, 6);
  add(axis.is_maximum_verified ? "largest stiffness as a share of the device's"
                               : "largest stiffness as a share of the cap",
      worst.stiffness, Relation::kAtMost, 1, 3);
  add("range of a resting handle in encoder steps", worst.rest, Relation::kAtMost,
      kFitTolerance * settings.restlessness_steps, 2);
  add("roughness as a share of the allowed one", worst.roughness, Relation::kAtMost, kFitTolerance, 3);
  add("least fitted stiffness as a share of the best", worst.share_of_stiffness, Relation::kAtLeast,
      kMinShareOfStiffness, 3);
  add("least fitted damping as a share of the best", worst.least_damping, Relation::kAtLeast, 1 / kMaxOfDamping, 3);
  add("most fitted damping as a share of the best", worst.most_damping, Relation::kAtMost, kMaxOfDamping, 3);
}

}  // namespace

Calibration calibrate(const devices::DeviceProfile& profile, const CalibrationSettings& settings,
                      const std::function<void(double)>& on_progress) {
  Calibration result;
  result.profile = profile;
  result.settings = settings;
  result.settings.rate_hz = profile.rate_hz;
  const double share = profile.has_torque() ? 0.5 : 1.0;
  const auto first = [&](double done) { on_progress(share * done); };
  result.translation = AxisCalibrator(profile, false, result.settings, first).run();

  haptics::AdaptiveFit fit;
  fit.mass_low_kg = result.translation.points.front().inertia;
  fit.mass_high_kg = result.translation.points.back().inertia;
  fit.stiffness_n_per_m = result.translation.stiffness;
  fit.damping_n_s_per_m = result.translation.damping;
  if (profile.has_torque()) {
    const auto second = [&](double done) { on_progress(share + (1 - share) * done); };
    result.rotation = AxisCalibrator(profile, true, result.settings, second).run();
    fit.inertia_low_kg_m2 = result.rotation->points.front().inertia;
    fit.inertia_high_kg_m2 = result.rotation->points.back().inertia;
    fit.stiffness_n_m_per_rad = result.rotation->stiffness;
    fit.damping_n_m_s_per_rad = result.rotation->damping;
  }
  round(fit);
  result.profile.adaptive = fit;
  result.profile.adaptive_source = "tandem-lab calibrate --device " + profile.name;
  return result;
}

std::vector<Check> checks_of(const Calibration& calibration) {
  std::vector<Check> checks;
  add_checks(calibration.translation, calibration.settings, "translation", checks);
  if (calibration.rotation) add_checks(*calibration.rotation, calibration.settings, "rotation", checks);
  return checks;
}

}  // namespace tandem::lab
