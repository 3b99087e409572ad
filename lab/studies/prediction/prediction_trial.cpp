#include "lab/studies/prediction/prediction_trial.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::lab {
namespace {

/// Period of the haptic loop.
constexpr Duration kTick = std::chrono::milliseconds(1);

/// The true force as a function of time, interpolated between the samples of a series. The times of successive calls
/// must not decrease.
class Truth {
 public:
  explicit Truth(const std::vector<ForceSample>& samples) : samples_(samples) {}
  Wrench at(Duration time) {
    while (next_ < samples_.size() && samples_[next_].at <= time) ++next_;
    if (next_ == 0) return samples_.front().on_hand_W;
    const ForceSample& a = samples_[next_ - 1];
    if (next_ == samples_.size()) return a.on_hand_W;
    const ForceSample& b = samples_[next_];
    const double u = to_seconds(time - a.at) / to_seconds(b.at - a.at);
    return a.on_hand_W + (b.on_hand_W - a.on_hand_W) * u;
  }

 private:
  const std::vector<ForceSample>& samples_;
  std::size_t next_ = 0;
};

/// Returns the samples that are sent at this period. A sample is marked if a contact began or ended since the previous
/// sent sample.
std::vector<ForceSample> sent_of(const ForceSeries& series, Duration period) {
  std::vector<ForceSample> sent;
  bool has_changed = false;
  for (const ForceSample& sample : series.samples) {
    has_changed |= sample.has_contact_changed;
    if (!sent.empty() && sample.at < sent.back().at + period) continue;
    sent.push_back({sample.at, sample.on_hand_W, has_changed});
    has_changed = false;
  }
  return sent;
}

class ErrorSum {
 public:
  void add(const Vec3& error) {
    const double length = error.norm();
    length_ += length;
    square_ += error.squaredNorm();
    sum_ += error;
    largest_ = std::max(largest_, length);
    ++count_;
  }
  ErrorFigures figures() const {
    if (count_ == 0) return {};
    const auto n = static_cast<double>(count_);
    return {length_ / n, square_ / n - (sum_ / n).squaredNorm(), std::sqrt(square_ / n), largest_};
  }

 private:
  std::size_t count_ = 0;
  double length_ = 0, square_ = 0, largest_ = 0;
  Vec3 sum_ = Vec3::Zero();
};

/// Converts a time of the series to a local time. The origin is arbitrary, because only differences matter.
LocalTime local(Duration time) {
  return LocalTime(time + std::chrono::seconds(1));
}

}  // namespace

PredictionErrors predict_series(const ForceSeries& series, haptics::ForceStream& stream, Duration sample_period,
                                Duration delay) {
  PredictionErrors result;
  const std::vector<ForceSample> sent = sent_of(series, sample_period);
  Truth truth(series.samples);
  ErrorSum force, torque, steps;
  Wrench before;
  std::size_t next = 0;
  const Duration begin = sent.front().at + delay;
  for (Duration now = begin; now <= sent.back().at; now += kTick) {
    for (; next < sent.size() && sent[next].at + delay <= now; ++next) {
      stream.push(local(sent[next].at), sent[next].on_hand_W, sent[next].has_contact_changed);
    }
    const Wrench shown = stream.at(local(now));
    // A live client computes the fit on its io thread within one tick. The fit takes about 1 % of a tick.
    stream.fit();
    const Wrench is = truth.at(now);
    force.add(shown.f - is.f);
    torque.add(shown.t - is.t);
    if (now > begin) steps.add(shown.f - before.f);
    before = shown;
    result.shown_n.push_back(shown.f);
    result.true_n.push_back(is.f);
  }
  result.force = force.figures();
  result.torque = torque.figures();
  result.step_max_n = steps.figures().largest;
  result.step_rms_n = steps.figures().rms;
  result.stream = stream.figures();
  return result;
}

}  // namespace tandem::lab
