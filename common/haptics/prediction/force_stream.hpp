// A wrench that arrives now and then, late, shown a thousand times a second: each of the six axes is a series of its
// own, continued over the age of its newest sample.
//
//   haptic thread                                       io thread
//   push(sample) ─▶ ring of raw samples ─▶ series at 200 Hz ──mailbox──▶ fit(): six AR models
//                   │                      running errors                      │
//   at(now) ◀─ curve over the predicted periods ◀───────coefficients──mailbox──┘
//
// Why the fit is elsewhere: it costs a hundred times what a tick may. Why it may come late or never: until then, and
// wherever a model errs more than they do, hold and linear are used (running errors, axis by axis).
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
  kLinear,    ///< on through the newest sample and the one a period before
  kAr,        ///< AR on differences, shrunk towards linear and hold by running errors; straight between periods
  kArSpline,  ///< the same, shown by a cubic B-spline through the newest sample: no lag; see `blend`
  kLiteral,   ///< the thesis: Yule–Walker on values, B-spline over F(t−2), F(t−1), F(t), F̂(t+1): a period late
};

/// What a stream does; the defaults are those that the lab measured as best (common/haptics/prediction/README.md).
struct ForceStreamSettings {
  PredictionMethod method = PredictionMethod::kArSpline;
  double series_rate_hz = 200;  ///< of the series that is modelled; 10 … 1000
  std::size_t order = 5;        ///< p; 1 … kMaxArOrder / 2
  std::size_t window = 300;     ///< samples that a fit uses; 20 … kMaxWindow
  std::size_t fit_period = 4;   ///< a fit is asked for every so many samples of the series
  ArFit ar_fit = ArFit::kLeastSquares;
  bool is_on_differences = true;
  bool updates_online = true;     ///< false: no fit is ever asked for (use adopt())
  bool resets_at_contact = true;  ///< at flagged changes, and at jumps of the series itself
  bool shrinks = true;            ///< false: the model alone as soon as there is one
  double error_memory = 7;        ///< samples over which running errors fade by 1/e
  double sharpness = 2;           ///< shares go with the running mean square error to minus this power
  double jump_factor = 12;        ///< an error this many times its running RMS is an onset
  double range_factor = 1.0;      ///< the output stays within the recent range, widened by so much of it each way
  /// In which what a sample corrects is carried in (kArSpline). With 0 the curve is C² between samples and steps at one
  /// that was not foreseen; with two ticks or more it is C² always, and late where it is wrong.
  Duration blend{0};
  Duration longest_horizon{from_seconds(0.1)};  ///< an older sample is predicted no further than this
};

/// One model for each axis: force x, y, z, torque x, y, z.
using ArModels = std::array<ArModel, 6>;

/// Running figures of a stream, for traces and reports.
struct ForceStreamFigures {
  std::uint64_t samples = 0;
  std::uint64_t resampled = 0;           ///< of the even series, appended
  std::uint64_t fits = 0;                ///< coefficients taken over
  std::uint64_t resets = 0;              ///< by contact changes, jumps and gaps
  std::uint64_t rejected = 0;            ///< samples that were not finite, or not newer than the newest
  std::array<double, 6> model_weight{};  ///< of AR against linear and hold in the newest prediction
};

/// Continues a stream of wrenches.
///
/// Fails   at() before the first sample gives zero; a sample that is not finite or not newer is dropped and counted;
///         the output is finite always and within the recent range widened by range_factor
/// Cost    push and at: O(p) for each axis, and of push after a gap at most `window` samples, however long the gap is; no
///         allocation, no lock; fit: see `tandem-lab reproduce prediction`
/// Thread  push, at, reset, adopt, figures: haptic. fit_pending, fit: io (one thread).
class ForceStream {
 public:
  /// Fails   std::invalid_argument naming the first setting out of its range, and the range
  explicit ForceStream(const ForceStreamSettings& settings = {});
  ~ForceStream();
  ForceStream(ForceStream&&) noexcept;
  ForceStream& operator=(ForceStream&&) noexcept;

  /// In      sampled_at  when the wrench was true, in the clock of at(): its age is measured from here. Larger than
  ///                     that of the sample before
  ///         contact_changed  contacts appeared or vanished since the sample before
  void push(LocalTime sampled_at, const Wrench& wrench, bool contact_changed = false) noexcept;
  /// The wrench as of `now`. Not const: the spline remembers what it showed, to go on from there.
  Wrench at(LocalTime now) noexcept;
  /// Forgets samples and coefficients.
  void reset() noexcept;
  /// Uses these from now on, until a fit or a reset brings others.
  void adopt(const ArModels& models) noexcept;
  const ArModels& models() const noexcept;
  ForceStreamFigures figures() const noexcept;
  const ForceStreamSettings& settings() const noexcept;

  /// Whether a window waits to be fitted.
  bool fit_pending() noexcept;
  /// Fits the newest window, if one waits, and hands the models back. True when it did.
  bool fit() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The settings of a method by its name: "hold", "linear", "ar", "ar-spline", "literal".
/// Fails   std::invalid_argument for an unknown name (lists the known)
ForceStreamSettings force_stream_settings(std::string_view name);
/// Null for an unknown name.
std::unique_ptr<ForceStream> make_force_stream(std::string_view name);
std::string_view name_of(PredictionMethod method);
std::vector<std::string_view> force_stream_names();
/// "hold, linear, ar, ar-spline, literal": for messages.
std::string listed_force_stream_names();

}  // namespace tandem::haptics
