// One axis of a force stream: what hold, linear and the model say of the coming periods, how wrong each was of late,
// and the curve that is shown of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/haptics/prediction/force_stream.hpp"
#include "common/haptics/prediction/uniform_spline.hpp"

namespace tandem::haptics {

/// Mean square that fades over `memory` values; the plain mean until there were that many.
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

/// Where the output may be.
struct ForecastBounds {
  double low = 0;
  double high = 0;
  double of(double value) const noexcept { return value < low ? low : value > high ? high : value; }
};

/// Thread  haptic: no allocation, no throw
class AxisForecast {
 public:
  static constexpr std::size_t kMaxSteps = 64;
  /// In      steps  periods that are foreseen, 3 … kMaxSteps
  void configure(const ForceStreamSettings& settings, std::size_t steps) noexcept;

  /// From here on score() asks about what is foreseen now.
  void remember() noexcept { scored_ = now_; }
  /// Error of the blend, `periods` after remember().
  double error(double actual, double periods) const noexcept { return actual - at(scored_.blend, periods, steps_); }
  /// RMS of those errors so far; infinite before the first.
  double error_rms() const noexcept;
  /// Adds what each candidate, and their blend, had foreseen of a sample that came `periods` after remember().
  void score(double actual, double periods) noexcept;
  void forget_model() noexcept;

  /// Looks ahead from `lags` (newest first, a period apart, settings.order + 2 of them). `model` null: there is none.
  void foresee(std::span<const double> lags, const ArModel* model, const ForecastBounds& bounds) noexcept;
  double model_weight() const noexcept { return weights_[kModel]; }

  /// Shown so many periods after the newest sample, by the settings' method. The first call after a foresee() turns the
  /// spline from what it showed to what is foreseen now.
  double show(double periods) noexcept;
  /// The newest sample is `periods` newer than the one before; the spline's curve lies in that one's time.
  void shift(double periods) noexcept;

 private:
  /// Values one period apart, from the newest sample (index 0) on.
  using Steps = std::array<double, kMaxSteps + 1>;
  /// Straight between them, level after the last.
  static double at(const Steps& values, double periods, std::size_t last) noexcept;

  enum Candidate : std::uint8_t { kHold, kLinear, kModel, kCandidates };
  struct Forecast {
    double newest = 0;
    double slope = 0;  ///< by the period
    Steps model{};
    Steps blend{};
    std::array<double, 2> before{};  ///< one and two periods before the newest
    ForecastBounds bounds;
    bool has_model = false;

    double point(std::ptrdiff_t i, std::size_t last) const noexcept;
  };
  /// What the hand is shown now: a forecast, and what is left of the difference to that before.
  struct Curve {
    Forecast forecast;
    double from = 0;  ///< of `forecast`'s newest sample, in periods after now_'s
    CurvePoint difference;
    double turned = 0;  ///< when the difference began to fade
    double shown = 0;   ///< when it was asked for last
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
