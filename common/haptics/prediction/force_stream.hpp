// Displays at 1 kHz a wrench that is received late and at irregular intervals. Each of the six axes is a separate
// series, which is extrapolated over the age of its newest sample.
//
//   haptic thread                                       io thread
//   push(sample) ─▶ ring of raw samples ─▶ series at 200 Hz ──mailbox──▶ fit(): six AR models
//                   │                      running errors                      │
//   at(now) ◀─ curve over the predicted periods ◀───────coefficients──mailbox──┘
//
// The fit runs on another thread, because it costs a hundred times the budget of a tick. It may finish late or never,
// so hold and linear extrapolation are always available. They replace the model while none has been fitted. Later, each
// axis weights the three forecasts by their running errors.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/haptics/prediction/ar_model.hpp"

namespace tandem::haptics {

inline constexpr std::size_t kMaxWindow = 1024;

enum class PredictionMethod : std::uint8_t {
  kHold,      ///< value of the newest sample
  kLinear,    ///< line through the newest sample and the value one period earlier
  kAr,        ///< AR on differences, blended with linear and hold by running errors; linear between periods
  kArSpline,  ///< kAr, displayed by a cubic B-spline through the newest sample: no lag; see `blend`
  kLiteral,   ///< as in the thesis: AR on values, B-spline over F(t−2), F(t−1), F(t), F̂(t+1); lags by one period
};

/// Settings of a stream. The defaults gave the smallest errors in the lab's measurements
/// (common/haptics/prediction/README.md).
struct ForceStreamSettings {
  PredictionMethod method = PredictionMethod::kArSpline;
  double series_rate_hz = 200;  ///< rate of the modelled series; 10 … 1000
  std::size_t order = 5;        ///< order p of the AR model; 1 … kMaxArOrder / 2
  std::size_t window = 300;     ///< number of samples in a fit; 20 … kMaxWindow
  std::size_t fit_period = 4;   ///< number of new samples of the series between two fits
  ArFit ar_fit = ArFit::kLeastSquares;
  bool is_on_differences = true;
  bool updates_online = true;     ///< false: no fit is requested; models are set by adopt()
  bool resets_at_contact = true;  ///< whether the model is reset at contact changes and at jumps
  bool shrinks = true;            ///< true: weights follow from errors; false: a fitted model has weight 1
  double error_memory = 7;        ///< time constant of the running errors [samples]
  double sharpness = 2;           ///< s: each forecast is weighted by its running mean square error to the power −s
  double jump_factor = 12;        ///< ratio of an error to its running RMS above which it counts as a jump
  double range_factor = 1.0;  ///< the output range is the recent range, extended at both ends by this fraction of it
  /// Duration of the transition from the displayed curve to a corrected forecast (kArSpline only).
  /// * 0: the curve is C² between samples, but has a step at each sample that was not predicted exactly.
  /// * Two ticks or more: the curve is always C², but corrections take effect later.
  Duration blend{0};
  Duration longest_horizon{from_seconds(0.1)};  ///< maximum age up to which a sample is extrapolated
};

/// One model for each axis, in the order force x, y, z, torque x, y, z.
using ArModels = std::array<ArModel, 6>;

/// Counters and weights of a stream, for traces and reports.
struct ForceStreamFigures {
  std::uint64_t samples = 0;
  std::uint64_t resampled = 0;           ///< number of samples appended to the evenly spaced series
  std::uint64_t fits = 0;                ///< number of fits that were used
  std::uint64_t resets = 0;              ///< number of resets, caused by contact changes, jumps or gaps
  std::uint64_t rejected = 0;            ///< number of samples that were not finite, or not newer than the previous one
  std::array<double, 6> model_weight{};  ///< weight of the AR model in the newest prediction, 0 to 1
};

/// Extrapolates a stream of wrenches.
/// Fails   at() returns zero before the first sample. A sample that is not finite or not newer than the previous one is
///         rejected and counted. The output is always finite. It stays within the recent range, widened by range_factor
/// Cost    push and at: O(p) for each axis, without allocation or lock. push appends at most `window` samples, even
///         after a long gap. fit: see `tandem-lab reproduce prediction`
/// Thread  push, at, reset, adopt, figures: haptic. fit_pending, fit: io (one thread).
class ForceStream {
 public:
  /// Fails   throws std::invalid_argument that names the first setting out of its range, and the range
  explicit ForceStream(const ForceStreamSettings& settings = {});
  ~ForceStream();
  ForceStream(ForceStream&&) noexcept;
  ForceStream& operator=(ForceStream&&) noexcept;

  /// In      sampled_at  time at which the wrench was valid, on the same clock as the argument of at(). It must
  ///         increase from sample to sample
  ///         contact_changed  whether contacts appeared or vanished since the previous sample
  void push(LocalTime sampled_at, const Wrench& wrench, bool contact_changed = false) noexcept;
  /// Returns the wrench at `now`. The function is not const, because it stores the displayed point: a new forecast
  /// starts its spline from this point.
  Wrench at(LocalTime now) noexcept;
  /// Discards samples and coefficients.
  void reset() noexcept;
  /// Uses these models until the next fit or reset.
  void adopt(const ArModels& models) noexcept;
  const ArModels& models() const noexcept;
  ForceStreamFigures figures() const noexcept;
  const ForceStreamSettings& settings() const noexcept;

  /// Returns whether a window of samples is ready to be fitted.
  bool fit_pending() noexcept;
  /// Fits the newest window that is ready and publishes the models. Returns false if no window was ready.
  bool fit() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the settings for the name of a method: "hold", "linear", "ar", "ar-spline", "literal".
/// Fails   throws std::invalid_argument for an unknown name; the message lists the known names
ForceStreamSettings force_stream_settings(std::string_view name);
/// Returns null for an unknown name.
std::unique_ptr<ForceStream> make_force_stream(std::string_view name);
std::string_view name_of(PredictionMethod method);
std::vector<std::string_view> force_stream_names();
/// Returns "hold, linear, ar, ar-spline, literal" for messages.
std::string listed_force_stream_names();

}  // namespace tandem::haptics
