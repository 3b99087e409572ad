// A wrench received late and irregularly, displayed at 1 kHz. Each of the six axes is a separate series, extrapolated
// over the age of its newest sample.
//
//   haptic thread                                       io thread
//   push(sample) ─▶ ring of raw samples ─▶ series at 200 Hz ──mailbox──▶ fit(): six AR models
//                   │                      running errors                      │
//   at(now) ◀─ curve over the predicted periods ◀───────coefficients──mailbox──┘
//
// The fit runs on another thread because it costs a hundred times the budget of a tick. It may finish late or never:
// without a model, or wherever it errs more than they do, hold and linear are used (running errors, axis by axis).
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
  kHold,      ///< the newest sample
  kLinear,    ///< line through the newest sample and the one a period before
  kAr,        ///< AR on differences, blended with linear and hold by running errors; linear between periods
  kArSpline,  ///< kAr, displayed by a cubic B-spline through the newest sample: no lag; see `blend`
  kLiteral,  ///< the thesis: Yule–Walker on values, B-spline over F(t−2), F(t−1), F(t), F̂(t+1); one period late
};

/// Settings of a stream; the defaults are the best ones measured by the lab (common/haptics/prediction/README.md).
struct ForceStreamSettings {
  PredictionMethod method = PredictionMethod::kArSpline;
  double series_rate_hz = 200;  ///< rate of the modelled series; 10 … 1000
  std::size_t order = 5;        ///< p; 1 … kMaxArOrder / 2
  std::size_t window = 300;     ///< number of samples in a fit; 20 … kMaxWindow
  std::size_t fit_period = 4;   ///< number of samples of the series between two fits
  ArFit ar_fit = ArFit::kLeastSquares;
  bool is_on_differences = true;
  bool updates_online = true;     ///< false: no fit is requested (use adopt())
  bool resets_at_contact = true;  ///< at flagged contact changes, and at jumps of the series itself
  bool shrinks = true;            ///< false: the model alone, as soon as one exists
  double error_memory = 7;        ///< number of samples over which running errors fade by 1/e
  double sharpness = 2;           ///< weights are the running mean square error to the power of minus this
  double jump_factor = 12;        ///< an error this many times its running RMS counts as a jump
  double range_factor = 1.0;      ///< share of the recent range by which the output may leave it on each side
  /// Duration of the change to a corrected forecast (kArSpline). With 0 the curve is C² between samples and steps at a
  /// sample that was not predicted. With two ticks or more it is always C², but the correction is late.
  Duration blend{0};
  Duration longest_horizon{from_seconds(0.1)};  ///< upper bound of the extrapolated age of a sample
};

/// One model for each axis: force x, y, z, torque x, y, z.
using ArModels = std::array<ArModel, 6>;

/// Counters and weights of a stream, for traces and reports.
struct ForceStreamFigures {
  std::uint64_t samples = 0;
  std::uint64_t resampled = 0;           ///< samples appended to the even series
  std::uint64_t fits = 0;                ///< number of adopted fits
  std::uint64_t resets = 0;              ///< resets by contact changes, jumps and gaps
  std::uint64_t rejected = 0;            ///< samples that were not finite, or not newer than the newest
  std::array<double, 6> model_weight{};  ///< weight of AR against linear and hold in the newest prediction
};

/// Extrapolates a stream of wrenches.
///
/// Fails   at() before the first sample returns zero. A sample that is not finite or not newer is dropped and counted.
///         The output is always finite and within the recent range widened by range_factor
/// Cost    push and at: O(p) for each axis; push after a gap appends at most `window` samples, for a gap of any length.
///         No allocation, no lock; fit: see `tandem-lab reproduce prediction`
/// Thread  push, at, reset, adopt, figures: haptic. fit_pending, fit: io (one thread).
class ForceStream {
 public:
  /// Fails   std::invalid_argument naming the first setting out of its range, and the range
  explicit ForceStream(const ForceStreamSettings& settings = {});
  ~ForceStream();
  ForceStream(ForceStream&&) noexcept;
  ForceStream& operator=(ForceStream&&) noexcept;

  /// In      sampled_at  time at which the wrench was valid, in the clock of at(); its age is measured from here. Must
  ///                     increase from sample to sample
  ///         contact_changed  contacts appeared or vanished since the previous sample
  void push(LocalTime sampled_at, const Wrench& wrench, bool contact_changed = false) noexcept;
  /// Returns the wrench at `now`. Not const: the spline continues from the last displayed point.
  Wrench at(LocalTime now) noexcept;
  /// Discards samples and coefficients.
  void reset() noexcept;
  /// Uses these models until the next fit or reset.
  void adopt(const ArModels& models) noexcept;
  const ArModels& models() const noexcept;
  ForceStreamFigures figures() const noexcept;
  const ForceStreamSettings& settings() const noexcept;

  /// Returns whether a window waits to be fitted.
  bool fit_pending() noexcept;
  /// Fits the newest waiting window, if any, and publishes the models. Returns true when it did.
  bool fit() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the settings of a method by its name: "hold", "linear", "ar", "ar-spline", "literal".
/// Fails   std::invalid_argument for an unknown name (lists the known names)
ForceStreamSettings force_stream_settings(std::string_view name);
/// Returns null for an unknown name.
std::unique_ptr<ForceStream> make_force_stream(std::string_view name);
std::string_view name_of(PredictionMethod method);
std::vector<std::string_view> force_stream_names();
/// Returns "hold, linear, ar, ar-spline, literal" for messages.
std::string listed_force_stream_names();

}  // namespace tandem::haptics
