#include "common/haptics/prediction/axis_forecast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::haptics {
namespace {

/// Lower bound of a mean square error, relative to the largest one of the candidates. With this bound, candidates
/// without error have equal, finite weights.
constexpr double kMinErrorRatio = 1e-24;

}  // namespace

double AxisForecast::at(const Steps& values, double periods, std::size_t last) noexcept {
  const double clamped = std::clamp(periods, 0.0, static_cast<double>(last));
  const std::size_t index = std::min(static_cast<std::size_t>(clamped), last - 1);
  const double u = clamped - static_cast<double>(index);
  return values[index] + u * (values[index + 1] - values[index]);
}

double AxisForecast::Forecast::point(std::ptrdiff_t i, std::size_t last) const noexcept {
  if (i < 0) return before[static_cast<std::size_t>(std::min<std::ptrdiff_t>(-i - 1, 1))];
  return blend[std::min(static_cast<std::size_t>(i), last)];
}

void AxisForecast::configure(const ForceStreamSettings& settings, std::size_t steps) noexcept {
  *this = {};
  settings_ = settings;
  steps_ = steps;
  blend_periods_ = std::max(to_seconds(settings.blend) * settings.series_rate_hz, 1e-9);
}

double AxisForecast::error_rms() const noexcept {
  return blend_error_.is_known() ? std::sqrt(blend_error_.value()) : std::numeric_limits<double>::infinity();
}

void AxisForecast::score(double actual, double periods) noexcept {
  const double memory = settings_.error_memory;
  const Forecast& then = scored_;
  const double model = then.has_model ? actual - at(then.model, periods, steps_) : 0;
  const double hold = actual - then.newest;
  const double linear = actual - then.bounds.clamp(then.newest + periods * then.slope);
  // Each candidate's error is divided by √n, where n is the norm of all candidates' errors at this sample. This is a
  // compromise between two extremes:
  // * undivided errors: a few impacts would determine the weights (minimum variance)
  // * errors divided by n: smooth segments would determine the weights (minimum mean error)
  const double size = std::pow(hold * hold + linear * linear + model * model, 0.25);
  const double share = size > 0 ? 1 / size : 0;
  errors_[kHold].add(hold * share, memory);
  errors_[kLinear].add(linear * share, memory);
  if (then.has_model) errors_[kModel].add(model * share, memory);
  blend_error_.add(error(actual, periods), memory);
}

void AxisForecast::forget_model() noexcept {
  errors_[kModel] = {};
  scored_.has_model = false;
}

void AxisForecast::predict(std::span<const double> lags, const ArModel* model, const ForecastBounds& bounds) noexcept {
  now_.newest = lags[0];
  now_.slope = lags[0] - lags[1];
  now_.before = {lags[1], lags[2]};
  now_.bounds = bounds;
  now_.has_model = model != nullptr;
  if (model != nullptr) run_model(lags, *model);
  weigh();
  mix();
  is_turning_ = true;
}

void AxisForecast::run_model(std::span<const double> lags, const ArModel& model) noexcept {
  const std::size_t p = settings_.order;
  std::array<double, kMaxArOrder> past{};
  for (std::size_t i = 0; i < p; ++i) past[i] = settings_.is_on_differences ? lags[i] - lags[i + 1] : lags[i];
  double value = lags[0];
  now_.model[0] = value;
  for (std::size_t j = 1; j <= steps_; ++j) {
    const double next = model.next(past);
    value = now_.bounds.clamp(settings_.is_on_differences ? value + next : next);
    now_.model[j] = value;
    for (std::size_t i = p - 1; i > 0; --i) past[i] = past[i - 1];
    past[0] = next;
  }
}

void AxisForecast::weigh() noexcept {
  const bool has_model = now_.has_model;
  weights_ = {1, 0, 0};
  if (settings_.method == PredictionMethod::kHold) return;
  if (settings_.method == PredictionMethod::kLinear) weights_ = {0, 1, 0};
  if (settings_.method == PredictionMethod::kLinear) return;
  if (!settings_.shrinks) {
    weights_ = has_model ? std::array<double, kCandidates>{0, 0, 1} : std::array<double, kCandidates>{0, 1, 0};
    return;
  }
  if (!errors_[kHold].is_known()) return;
  double most = 0;
  for (const RunningSquare& error : errors_) most = std::max(most, error.value());
  if (most <= 0) return;
  double sum = 0;
  for (std::size_t c = 0; c < kCandidates; ++c) {
    const bool is_known = errors_[c].is_known() && (c != kModel || has_model);
    weights_[c] = is_known ? std::pow(errors_[c].value() / most + kMinErrorRatio, -settings_.sharpness) : 0;
    sum += weights_[c];
  }
  for (double& weight : weights_) weight /= sum;
}

void AxisForecast::mix() noexcept {
  for (std::size_t j = 0; j <= steps_; ++j) {
    double sum = weights_[kHold] * now_.newest;
    if (weights_[kLinear] > 0) {
      sum += weights_[kLinear] * now_.bounds.clamp(now_.newest + static_cast<double>(j) * now_.slope);
    }
    if (weights_[kModel] > 0) sum += weights_[kModel] * now_.model[j];
    now_.blend[j] = sum;
  }
}

void AxisForecast::shift(double periods) noexcept {
  curve_.from -= periods;
  curve_.turned -= periods;
  curve_.shown -= periods;
}

double AxisForecast::show(double periods) noexcept {
  switch (settings_.method) {
    case PredictionMethod::kHold:
      return now_.newest;
    case PredictionMethod::kLinear:
    case PredictionMethod::kAr:
      return at(now_.blend, periods, steps_);
    case PredictionMethod::kArSpline:
      return now_.bounds.clamp(show_spline(periods));
    case PredictionMethod::kLiteral:
      return show_literal(periods);
  }
  return 0;
}

CurvePoint AxisForecast::spline(const Forecast& forecast, double periods) const noexcept {
  const double clamped = std::min(periods, static_cast<double>(steps_) + 1);
  const auto segment = static_cast<std::ptrdiff_t>(std::max(clamped, 0.0));
  const auto point = [&](std::ptrdiff_t i) { return forecast.point(i, steps_); };
  std::array<double, 4> control;
  for (std::ptrdiff_t k = 0; k < 4; ++k) {
    const std::ptrdiff_t i = segment - 1 + k;
    // This correction of the control points makes the curve pass through the forecast values up to third order. With
    // the forecast values as control points, the curve would smooth them.
    control[static_cast<std::size_t>(k)] = point(i) - (point(i + 1) - 2 * point(i) + point(i - 1)) / 6;
  }
  // The newest sample is the only displayed value that is measured. The curve passes through it exactly.
  if (segment == 0) control[0] = 6 * forecast.newest - 4 * control[1] - control[2];
  return uniform_cubic(control, clamped - static_cast<double>(segment));
}

CurvePoint AxisForecast::shown_spline(double periods) const noexcept {
  const CurvePoint left = faded(curve_.difference, (periods - curve_.turned) / blend_periods_);
  const double scale = 1 / blend_periods_;
  return spline(curve_.forecast, periods - curve_.from) +
         CurvePoint{left.value, left.slope * scale, left.curvature * scale * scale};
}

double AxisForecast::show_spline(double periods) noexcept {
  if (is_turning_) {
    // The transition begins at the last displayed point, because the rest of the previous curve was never displayed.
    const double begin = std::min(curve_.shown, periods);
    CurvePoint difference;
    if (!curve_.is_new) difference = shown_spline(begin) - spline(now_, begin);
    difference.slope *= blend_periods_;
    difference.curvature *= blend_periods_ * blend_periods_;
    curve_ = {now_, 0, difference, begin, begin, false};
    is_turning_ = false;
  }
  curve_.shown = periods;
  return shown_spline(periods).value;
}

double AxisForecast::show_literal(double periods) const noexcept {
  const std::array<double, 4> control{now_.before[1], now_.before[0], now_.blend[0], now_.blend[1]};
  return uniform_cubic(control, std::clamp(periods, 0.0, 1.0)).value;
}

}  // namespace tandem::haptics
