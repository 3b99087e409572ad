// One axis of a force stream: three forecasts (hold, linear extrapolation, AR model), their recent errors, and the
// displayed curve.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/haptics/prediction/force_stream.hpp"
#include "common/haptics/prediction/uniform_spline.hpp"

namespace tandem::haptics {

/// Running mean of squared errors, in which old errors are forgotten with a time constant of `memory` values. Until
/// `memory` values have been added, all have the same weight.
class RunningSquare {
 public:
  void add(double error, double memory) noexcept {
    count_ = count_ + 1 < memory ? count_ + 1 : memory;
    value_ += (error * error - value_) / count_;
  }
  bool is_known() const noexcept { return count_ > 0; }
  double value() const noexcept { return value_; }

 private:
  double value_ = 0;
  double count_ = 0;
};

/// Range to which the output is clamped.
struct ForecastBounds {
  double low = 0;
  double high = 0;
  double clamp(double value) const noexcept { return value < low ? low : value > high ? high : value; }
};

/// Forecast of one axis: a weighted mixture of three candidates (hold, linear, model), displayed as a smooth curve.
///
/// Thread  haptic: no allocation, no throw
class AxisForecast {
 public:
  static constexpr std::size_t kMaxSteps = 64;
  /// In      steps  number of periods in a forecast, 3 … kMaxSteps
  void configure(const ForceStreamSettings& settings, std::size_t steps) noexcept;

  /// Stores the present forecast, to which later calls of error() and score() refer.
  void remember() noexcept { scored_ = now_; }
  /// Error of the stored mixture, `periods` after its newest sample.
  double error(double actual, double periods) const noexcept { return actual - at(scored_.blend, periods, steps_); }
  /// RMS of all scored errors of the mixture; infinite before the first score().
  double error_rms() const noexcept;
  /// Updates the running errors of the three candidates and of their mixture. `actual` is a sample taken `periods`
  /// after the newest sample of the stored forecast.
  void score(double actual, double periods) noexcept;
  void forget_model() noexcept;

  /// Computes the forecast from `lags`: settings.order + 2 values, newest first, one period apart. `model` is null if
  /// there is no fitted model.
  void predict(std::span<const double> lags, const ArModel* model, const ForecastBounds& bounds) noexcept;
  double model_weight() const noexcept { return weights_[kModel]; }

  /// Returns the value to display at the time `periods` after the newest sample, by the method in the settings. If the
  /// method is a spline, the first call after predict() starts the transition from the displayed curve to the new
  /// forecast.
  double show(double periods) noexcept;
  /// Moves the time origin of the curve to a new sample, `periods` after the previous one.
  void shift(double periods) noexcept;

 private:
  /// Forecast values one period apart; index 0 is the newest sample.
  using Steps = std::array<double, kMaxSteps + 1>;
  /// Interpolates linearly; constant after the last value.
  static double at(const Steps& values, double periods, std::size_t last) noexcept;

  enum Candidate : std::uint8_t { kHold, kLinear, kModel, kCandidates };
  struct Forecast {
    double newest = 0;
    double slope = 0;  ///< change per period
    Steps model{};
    Steps blend{};
    std::array<double, 2> before{};  ///< samples one and two periods before the newest sample
    ForecastBounds bounds;
    bool has_model = false;

    double point(std::ptrdiff_t i, std::size_t last) const noexcept;
  };
  /// Displayed curve: a forecast plus the remaining difference from the previously displayed curve.
  struct Curve {
    Forecast forecast;
    /// Time from the newest sample of now_ to the newest sample of `forecast` [periods]; ≤ 0.
    double from = 0;
    CurvePoint difference;
    double turned = 0;  ///< time at which the difference began to fade out, counted like `from`
    double shown = 0;   ///< time of the last displayed value, counted like `from`
    bool is_new = true;
  };

  void run_model(std::span<const double> lags, const ArModel& model) noexcept;
  void weigh() noexcept;
  void mix() noexcept;
  CurvePoint spline(const Forecast& forecast, double periods) const noexcept;
  CurvePoint shown_spline(double periods) const noexcept;
  double show_spline(double periods) noexcept;
  double show_literal(double periods) const noexcept;

  ForceStreamSettings settings_;
  std::size_t steps_ = 3;
  double blend_periods_ = 1;
  Forecast now_;
  Forecast scored_;
  Curve curve_;
  bool is_turning_ = false;
  std::array<double, kCandidates> weights_{1, 0, 0};
  std::array<RunningSquare, kCandidates> errors_{};
  RunningSquare blend_error_;
};

}  // namespace tandem::haptics
