#include "common/haptics/prediction/force_stream.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/haptics/prediction/axis_forecast.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::haptics {
namespace {

/// Ratio of an error to the running error above which a sample flagged as a contact change resets the model (our
/// choice). The threshold is needed for a chattering contact: all its samples are flagged, and each would otherwise
/// reset the model.
constexpr double kFlaggedFactor = 5;
/// Number of samples per coefficient that the first fit needs (our choice).
constexpr std::size_t kFirstFit = 4;
/// Upper bound of a wrench's components; a larger wrench is rejected. We chose a value for which differences cannot
/// overflow.
constexpr double kLargest_n = 1e6;
/// Minimum age of a forecast when it is scored [periods]. If samples arrive faster than the series' rate, forecasts
/// would be scored at a smaller age. Over so short a time the force hardly changes, so the scores would favour hold.
constexpr double kMinAhead = 0.75;
/// Errors below this fraction of the recent range are rounding errors, not jumps.
constexpr double kRounding = 1e-9;

/// Ring buffer with the newest samples of six series at uneven times. Values between samples are interpolated linearly.
/// Before the oldest sample and after the newest one, the nearest sample's value is returned.
///
/// Limits  A sample less than an eighth of `period` after the previous one replaces the newest sample. The full ring
///         thus always spans at least kCapacity/8 periods
/// Thread  haptic: no allocation
class SampleHistory {
 public:
  static constexpr std::size_t kCapacity = 320;

  explicit SampleHistory(Duration period) : least_spacing_(period / 8) {}

  std::size_t size() const noexcept { return count_; }
  LocalTime newest_at() const noexcept { return back(0).at; }
  const Vec6& newest() const noexcept { return back(0).value; }

  /// In      at  later than newest_at()
  void add(LocalTime at, const Vec6& value) noexcept {
    if (count_ < 2 || back(0).at - back(1).at >= least_spacing_) {
      newest_ = (newest_ + 1) % kCapacity;
      count_ = count_ < kCapacity ? count_ + 1 : kCapacity;
    }
    samples_[newest_] = {at, value};
  }
  void keep_newest(std::size_t count) noexcept { count_ = count_ < count ? count_ : count; }

  Vec6 at(LocalTime time) const noexcept {
    std::size_t older = 0;
    while (older < count_ && back(older).at > time) ++older;
    if (older == 0) return newest();
    if (older == count_) return back(count_ - 1).value;
    const Sample& a = back(older);
    const Sample& b = back(older - 1);
    const double u = static_cast<double>((time - a.at).count()) / static_cast<double>((b.at - a.at).count());
    return a.value + u * (b.value - a.value);
  }

 private:
  struct Sample {
    LocalTime at{};
    Vec6 value = Vec6::Zero();
  };
  const Sample& back(std::size_t age) const noexcept { return samples_[(newest_ + kCapacity - age) % kCapacity]; }

  Duration least_spacing_;
  std::array<Sample, kCapacity> samples_;
  std::size_t count_ = 0;
  std::size_t newest_ = 0;
};

struct FitRequest {
  std::uint32_t generation = 0;
  std::size_t count = 0;
  std::array<std::array<double, kMaxWindow>, 6> series{};
};
struct FitResult {
  std::uint32_t generation = 0;
  ArModels models{};
};

template <class T>
void require(const char* name, T value, T low, T high) {
  // This comparison is false for NaN, too.
  if (value >= low && value <= high) return;
  throw std::invalid_argument(std::string("ForceStreamSettings.") + name + " is " + std::to_string(value) +
                              "; it must be from " + std::to_string(low) + " to " + std::to_string(high));
}

const ForceStreamSettings& checked(const ForceStreamSettings& s) {
  require("series_rate_hz", s.series_rate_hz, 10.0, 1000.0);
  require("order", s.order, std::size_t{1}, kMaxArOrder / 2);
  require("window", s.window, std::size_t{20}, kMaxWindow);
  require("fit_period", s.fit_period, std::size_t{1}, kMaxWindow);
  require("error_memory", s.error_memory, 1.0, 1e4);
  require("sharpness", s.sharpness, 0.0, 10.0);
  require("jump_factor", s.jump_factor, 1.0, 1e9);
  require("range_factor", s.range_factor, 0.0, 100.0);
  require("blend [s]", to_seconds(s.blend), 0.0, 0.1);
  require("longest_horizon [s]", to_seconds(s.longest_horizon), 0.0, 10.0);
  return s;
}

bool is_wrench(const Wrench& wrench) {
  return is_finite(wrench) && wrench.f.cwiseAbs().maxCoeff() <= kLargest_n &&
         wrench.t.cwiseAbs().maxCoeff() <= kLargest_n;
}

std::size_t steps_of(const ForceStreamSettings& settings) {
  const double periods = std::ceil(to_seconds(settings.longest_horizon) * settings.series_rate_hz);
  return static_cast<std::size_t>(std::clamp(periods, 3.0, static_cast<double>(AxisForecast::kMaxSteps)));
}

/// Minimum and maximum of the samples in the current and the previous window.
class RecentRange {
 public:
  void add(const Vec6& value, std::size_t window) noexcept {
    if (count_ == 0) {
      before_low_ = before_high_ = low_ = high_ = value;
    } else if (count_ % window == 0) {
      before_low_ = low_;
      before_high_ = high_;
      low_ = high_ = value;
    }
    low_ = low_.cwiseMin(value);
    high_ = high_.cwiseMax(value);
    ++count_;
  }
  ForecastBounds bounds_of(int axis) const noexcept {
    return {std::min(low_[axis], before_low_[axis]), std::max(high_[axis], before_high_[axis])};
  }

 private:
  std::uint64_t count_ = 0;
  Vec6 low_ = Vec6::Zero(), high_ = Vec6::Zero();
  Vec6 before_low_ = Vec6::Zero(), before_high_ = Vec6::Zero();
};

ForecastBounds widened(const ForecastBounds& range, double factor) {
  const double margin = factor * (range.high - range.low);
  return {range.low - margin, range.high + margin};
}

/// Ring buffer of evenly spaced samples. A copy of it has the oldest sample first.
class EvenSeries {
 public:
  void clear() noexcept { count_ = 0; }
  std::size_t count() const noexcept { return count_; }
  void append(const Vec6& value, std::size_t window) noexcept {
    end_ = (end_ + 1) % kMaxWindow;
    values_[end_] = value;
    count_ = std::min(count_ + 1, window);
  }
  void copy_to(FitRequest& request) const noexcept {
    request.count = count_;
    std::size_t from = (end_ + 1 + kMaxWindow - count_) % kMaxWindow;
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t axis = 0; axis < 6; ++axis) request.series[axis][i] = values_[from][static_cast<int>(axis)];
      from = (from + 1) % kMaxWindow;
    }
  }

 private:
  std::array<Vec6, kMaxWindow> values_;
  std::size_t count_ = 0;
  std::size_t end_ = 0;
};

ArModel model_of(std::span<double> series, const ForceStreamSettings& settings) {
  if (!settings.is_on_differences) return fit_ar(series, settings.order, settings.ar_fit, true);
  for (std::size_t i = 0; i + 1 < series.size(); ++i) series[i] = series[i + 1] - series[i];
  ArModel model = fit_ar(series.first(series.size() - 1), settings.order, settings.ar_fit, false);
  // If all differences are equal, their mean is set to 0. Otherwise the linear motion in the window would be
  // extrapolated without end.
  if (model.order == 0) model.mean = 0;
  return model;
}

}  // namespace

struct ForceStream::Impl {
  explicit Impl(const ForceStreamSettings& s)
      : settings(checked(s)), period(from_seconds(1 / s.series_rate_hz)), history(period) {
    for (AxisForecast& axis : axes) axis.configure(settings, steps_of(settings));
  }

  double periods(Duration time) const noexcept { return to_seconds(time) * settings.series_rate_hz; }
  bool is_modelled() const noexcept {
    return settings.method != PredictionMethod::kHold && settings.method != PredictionMethod::kLinear;
  }

  void push(LocalTime sampled_at, const Wrench& wrench, bool contact_changed) noexcept {
    if (!is_wrench(wrench) || (history.size() > 0 && sampled_at <= history.newest_at())) {
      ++figures.rejected;
      return;
    }
    ++figures.samples;
    Vec6 value;
    value << wrench.f, wrench.t;
    apply_models();
    if (history.size() > 0) follow_up(sampled_at, value, contact_changed);
    extend_series(sampled_at, value);
    history.add(sampled_at, value);
    range.add(value, settings.window);
    predict();
    request_fit();
  }

  /// Scores the forecasts with a new sample. Resets the model after a large error.
  void follow_up(LocalTime sampled_at, const Vec6& value, bool contact_changed) noexcept {
    for (AxisForecast& axis : axes) axis.shift(periods(sampled_at - history.newest_at()));
    has_contact_changed |= contact_changed;
    const double ahead = periods(sampled_at - scored_from);
    is_scoring = ahead >= kMinAhead;
    if (!is_scoring) return;
    bool is_surprise = sampled_at - history.newest_at() > settings.longest_horizon;
    for (int i = 0; i < 6; ++i) {
      AxisForecast& axis = axes[static_cast<std::size_t>(i)];
      const ForecastBounds seen = range.bounds_of(i);
      const double factor = has_contact_changed ? kFlaggedFactor : settings.jump_factor;
      is_surprise |=
          std::abs(axis.error(value[i], ahead)) > factor * axis.error_rms() + kRounding * (seen.high - seen.low);
      axis.score(value[i], ahead);
    }
    has_contact_changed = false;
    if (is_surprise && settings.resets_at_contact && is_modelled()) forget();
  }

  /// Discards the series and the coefficients from before a jump. Of the samples only the newest is kept: linear
  /// extrapolation needs it together with the next sample.
  void forget() noexcept {
    ++figures.resets;
    ++generation;
    has_models = false;
    series.clear();
    history.keep_newest(1);
    for (AxisForecast& axis : axes) axis.forget_model();
  }

  /// Appends evenly spaced values up to `sampled_at`, interpolated between the previous newest sample and the new one.
  /// After a gap longer than the window, the series is restarted. Therefore at most `window` values are appended for
  /// any time stamps.
  void extend_series(LocalTime sampled_at, const Vec6& value) noexcept {
    const bool is_beyond_window = sampled_at - series_at > static_cast<Duration::rep>(settings.window) * period;
    if (series.count() == 0 || is_beyond_window) {
      series.clear();
      series.append(value, settings.window);
      ++figures.resampled;
      series_at = sampled_at;
      return;
    }
    const LocalTime before = history.newest_at();
    const double span = to_seconds(sampled_at - before);
    for (; series_at + period <= sampled_at; ++since_fit) {
      ++figures.resampled;
      series_at += period;
      const double u = std::clamp(to_seconds(series_at - before) / span, 0.0, 1.0);
      series.append(history.newest() + u * (value - history.newest()), settings.window);
    }
  }

  void predict() noexcept {
    std::array<Vec6, kMaxArOrder> past;
    const std::size_t count = settings.order + 2;
    for (std::size_t i = 0; i < count; ++i) {
      past[i] = history.at(history.newest_at() - static_cast<Duration::rep>(i) * period);
    }
    for (std::size_t a = 0; a < 6; ++a) {
      const auto axis = static_cast<int>(a);
      std::array<double, kMaxArOrder> lags;
      for (std::size_t i = 0; i < count; ++i) lags[i] = past[i][axis];
      const ArModel* model = has_models && is_modelled() ? &models[a] : nullptr;
      axes[a].predict(std::span(lags).first(count), model, widened(range.bounds_of(axis), settings.range_factor));
      figures.model_weight[a] = axes[a].model_weight();
      if (is_scoring) axes[a].remember();
    }
    if (is_scoring) scored_from = history.newest_at();
    is_scoring = false;
  }

  void apply_models() noexcept {
    if (!results.poll() || results.front().generation != generation) return;
    models = results.front().models;
    has_models = true;
    ++figures.fits;
  }

  void request_fit() noexcept {
    if (!is_modelled() || !settings.updates_online) return;
    const std::size_t first = kFirstFit * settings.order;
    if (series.count() < first) return;
    if (has_models && since_fit < settings.fit_period) return;
    since_fit = 0;
    requests.back().generation = generation;
    series.copy_to(requests.back());
    requests.publish();
  }

  Wrench at(LocalTime now) noexcept {
    if (history.size() == 0) return {};
    const double age = std::max(0.0, periods(now - history.newest_at()));
    Vec6 shown;
    for (std::size_t a = 0; a < 6; ++a) shown[static_cast<int>(a)] = axes[a].show(age);
    return {shown.head<3>(), shown.tail<3>()};
  }

  void reset() noexcept {
    const ForceStreamFigures before = figures;
    forget();
    figures = before;
    history.keep_newest(0);
    range = {};
    has_contact_changed = false;
    is_scoring = true;
    for (AxisForecast& axis : axes) axis.configure(settings, steps_of(settings));
  }

  bool fit() noexcept {
    if (!fit_pending()) return false;
    has_request = false;
    const FitRequest& request = requests.front();
    FitResult& result = results.back();
    result.generation = request.generation;
    for (std::size_t a = 0; a < 6; ++a) {
      std::ranges::copy_n(request.series[a].begin(), static_cast<std::ptrdiff_t>(request.count), work.begin());
      result.models[a] = model_of(std::span(work).first(request.count), settings);
    }
    results.publish();
    return true;
  }
  bool fit_pending() noexcept { return has_request = has_request || requests.poll(); }

  ForceStreamSettings settings;
  Duration period;
  ForceStreamFigures figures;

  // Data of the haptic thread.
  SampleHistory history;
  RecentRange range;
  EvenSeries series;
  LocalTime series_at{};
  LocalTime scored_from{};
  std::array<AxisForecast, 6> axes{};
  ArModels models{};
  std::size_t since_fit = 0;
  std::uint32_t generation = 0;
  bool has_models = false;
  bool has_contact_changed = false;
  bool is_scoring = true;

  // Data of the io thread.
  bool has_request = false;
  std::array<double, kMaxWindow> work{};

  realtime::Mailbox<FitRequest> requests;
  realtime::Mailbox<FitResult> results;
};

ForceStream::ForceStream(const ForceStreamSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
ForceStream::~ForceStream() = default;
ForceStream::ForceStream(ForceStream&&) noexcept = default;
ForceStream& ForceStream::operator=(ForceStream&&) noexcept = default;

void ForceStream::push(LocalTime sampled_at, const Wrench& wrench, bool contact_changed) noexcept {
  impl_->push(sampled_at, wrench, contact_changed);
}
Wrench ForceStream::at(LocalTime now) noexcept {
  return impl_->at(now);
}
void ForceStream::reset() noexcept {
  impl_->reset();
}
void ForceStream::adopt(const ArModels& models) noexcept {
  impl_->models = models;
  impl_->has_models = true;
}
const ArModels& ForceStream::models() const noexcept {
  return impl_->models;
}
ForceStreamFigures ForceStream::figures() const noexcept {
  return impl_->figures;
}
const ForceStreamSettings& ForceStream::settings() const noexcept {
  return impl_->settings;
}
bool ForceStream::fit_pending() noexcept {
  return impl_->fit_pending();
}
bool ForceStream::fit() noexcept {
  return impl_->fit();
}

namespace {

struct NamedMethod {
  std::string_view name;
  PredictionMethod method;
};
constexpr std::array kMethods{
    NamedMethod{"hold", PredictionMethod::kHold}, NamedMethod{"linear", PredictionMethod::kLinear},
    NamedMethod{"ar", PredictionMethod::kAr}, NamedMethod{"ar-spline", PredictionMethod::kArSpline},
    NamedMethod{"literal", PredictionMethod::kLiteral}};

}  // namespace

ForceStreamSettings force_stream_settings(std::string_view name) {
  const auto* const found = std::ranges::find(kMethods, name, &NamedMethod::name);
  if (found == kMethods.end()) {
    throw std::invalid_argument("\"" + std::string(name) +
                                "\" is no prediction; use one of: " + listed_force_stream_names());
  }
  ForceStreamSettings settings;
  settings.method = found->method;
  if (settings.method != PredictionMethod::kLiteral) return settings;
  settings.ar_fit = ArFit::kYuleWalker;
  settings.is_on_differences = false;
  settings.resets_at_contact = false;
  settings.shrinks = false;
  return settings;
}

std::unique_ptr<ForceStream> make_force_stream(std::string_view name) {
  if (std::ranges::find(kMethods, name, &NamedMethod::name) == kMethods.end()) return nullptr;
  return std::make_unique<ForceStream>(force_stream_settings(name));
}

std::string_view name_of(PredictionMethod method) {
  return std::ranges::find(kMethods, method, &NamedMethod::method)->name;
}

std::vector<std::string_view> force_stream_names() {
  std::vector<std::string_view> names;
  for (const NamedMethod& method : kMethods) names.push_back(method.name);
  return names;
}

std::string listed_force_stream_names() {
  std::string text;
  for (const NamedMethod& method : kMethods) text += (text.empty() ? "" : ", ") + std::string(method.name);
  return text;
}

}  // namespace tandem::haptics
