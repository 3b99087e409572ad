#include "common/net/link.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace tandem::net {
namespace {

constexpr Duration kMaxDelay = std::chrono::seconds(10);
// Lower limit of mean_bad_period, for two reasons. Bad periods shorter than the interval between packets would make
// losses independent of each other. Each period costs the drawing of a random number.
constexpr Duration kMinBadPeriod = std::chrono::microseconds(100);
// Maximum length of a period, about three years. It is longer than any trial, and a sum of a few such periods does not
// overflow a Duration.
constexpr double kMaxPeriod_s = 1e8;
// Offsets of the random stream numbers for duplicates and delay paths. Both exceed the stream numbers of all links.
constexpr std::uint64_t kDuplicateStreams = 1ULL << 40U;
constexpr std::uint64_t kPathStreams = 1ULL << 41U;

// Shape parameter of the Pareto distribution; our choice. The smaller it is, the heavier is the tail of the
// distribution. 3 is the smallest integer for which the standard deviation, which `jitter` gives, is finite.
constexpr double kParetoShape = 3.0;
// Standard deviation σ of a Pareto (type I) variable of scale 1: √(a / ((a−1)² (a−2))).
const double kParetoUnitSigma = std::sqrt(kParetoShape / (std::pow(kParetoShape - 1, 2) * (kParetoShape - 2)));

template <class Value>
std::string complaint(const char* field, Value value, const char* remedy) {
  std::ostringstream text;
  text << field << " is " << value << "; it must be " << remedy;
  return text.str();
}

double milliseconds(Duration duration) {
  return to_seconds(duration) * 1e3;
}

bool is_delay(Duration delay) {
  return delay >= Duration(0) && delay <= kMaxDelay;
}

std::string path_problem(const DelayPath& path) {
  if (path.points.empty()) return "";
  if (path.points.front().at != Duration(0)) return complaint("delay_path", "not there at 0 s", "begun at 0 s");
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    if (!is_delay(path.points[i].delay)) {
      return complaint("delay_path", milliseconds(path.points[i].delay), "of delays of 0 to 10000 ms");
    }
    if (i > 0 && path.points[i].at < path.points[i - 1].at) {
      return complaint("delay_path", to_seconds(path.points[i].at), "in order of time [s]");
    }
  }
  return path.length() > Duration(0) ? "" : complaint("delay_path", "0 s long", "longer");
}

LinkParameters for_a_stream(LinkParameters parameters) {
  parameters.loss = 0;
  parameters.duplication = 0;
  parameters.allows_reordering = false;
  return parameters;
}

}  // namespace

Duration DelayPath::at(Duration time) const {
  if (length() <= Duration(0)) return Duration(0);
  const Duration here = time % length();
  const auto next = std::upper_bound(points.begin(), points.end(), here,
                                     [](Duration value, const Point& point) { return value < point.at; });
  const Point& to = *next;  // valid, because `here` is before the last point
  const Point& from = *(next - 1);
  const double share = to_seconds(here - from.at) / to_seconds(to.at - from.at);
  return from.delay + from_seconds(share * to_seconds(to.delay - from.delay));
}

std::string LinkParameters::problem() const {
  // The comparisons are written so that a NaN is reported as invalid.
  if (!is_delay(delay)) return complaint("delay", milliseconds(delay), "0 to 10000 ms");
  if (!is_delay(jitter)) return complaint("jitter", milliseconds(jitter), "0 to 10000 ms");
  if (distribution == JitterDistribution::kTrace && trace.empty()) {
    return complaint("trace", "empty", "one delay or more");
  }
  for (const Duration value : trace) {
    if (!is_delay(value)) return complaint("trace", milliseconds(value), "delays of 0 to 10000 ms");
  }
  if (!is_delay(jitter_correlation)) {
    return complaint("jitter_correlation", milliseconds(jitter_correlation), "0 to 10000 ms");
  }
  if (std::string bad = path_problem(delay_path); !bad.empty()) return bad;
  if (!(loss >= 0 && loss <= kMaxLoss)) return complaint("loss", loss, "0 to 0.95");
  if (!(mean_bad_period >= kMinBadPeriod && mean_bad_period <= kMaxDelay)) {
    return complaint("mean_bad_period", milliseconds(mean_bad_period), "0.1 to 10000 ms");
  }
  if (!(duplication >= 0 && duplication <= 1)) return complaint("duplication", duplication, "0 to 1");
  const bool is_rate = rate_limit_bytes_per_s == 0 || (rate_limit_bytes_per_s >= 1 && rate_limit_bytes_per_s <= 1e12);
  if (!is_rate) return complaint("rate_limit_bytes_per_s", rate_limit_bytes_per_s, "0 (unlimited) or 1 to 1e12");
  if (queue_limit == 0) return complaint("queue_limit", queue_limit, "1 or more");
  return "";
}

SimulatedLink::SimulatedLink(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream)
    : parameters_(std::move(parameters)),
      loss_random_(seed, 2 * stream),
      delays_{Random(seed, 2 * stream + 1)},
      duplicate_random_(seed, kDuplicateStreams + 2 * stream),
      duplicate_delays_{Random(seed, kDuplicateStreams + 2 * stream + 1)} {
  const std::string problem = parameters_.problem();
  if (!problem.empty()) throw std::invalid_argument("link: " + problem);
  const DelayPath& path = parameters_.delay_path;
  if (path.starts_anywhere && path.length() > Duration(0)) {
    path_from_ = from_seconds(Random(seed, kPathStreams + stream).uniform() * to_seconds(path.length()));
  }
}

SimulatedLink SimulatedLink::reliable(LinkParameters parameters, std::uint64_t seed, std::uint64_t stream) {
  SimulatedLink link(for_a_stream(std::move(parameters)), seed, stream);
  link.is_reliable_ = true;
  return link;
}

void SimulatedLink::set_parameters(LinkParameters parameters) {
  if (const std::string problem = parameters.problem(); !problem.empty()) {
    throw std::invalid_argument("link: " + problem);
  }
  parameters_ = is_reliable_ ? for_a_stream(std::move(parameters)) : std::move(parameters);
  // The old position may lie beyond the end of the new trace, so playback of the trace begins again.
  delays_.trace_position = duplicate_delays_.trace_position = 0;
}

void SimulatedLink::send(LocalTime now, std::span<const std::byte> packet) {
  ++counters_.sent;
  // Tail drop applies to datagrams only. A real stream would slow its sender down instead; the model omits this effect.
  if (!is_reliable_ && in_flight_.size() >= parameters_.queue_limit) {
    ++counters_.queue_full;
    return;
  }
  LocalTime on_wire = now;
  if (parameters_.rate_limit_bytes_per_s > 0) {
    const double seconds = static_cast<double>(packet.size()) / parameters_.rate_limit_bytes_per_s;
    *line_free_ = std::max(*line_free_, now) + from_seconds(seconds);
    on_wire = *line_free_;
  }
  // The delay is drawn even for a lost packet, so that delays do not depend on losses. Duplicates use a separate random
  // sequence.
  const Duration delay = draw_delay(delays_, on_wire);
  if (is_lost(on_wire)) {
    ++counters_.lost;
    return;
  }
  enqueue(on_wire + delay, packet);
  if (parameters_.duplication > 0 && duplicate_random_.uniform() < parameters_.duplication) {
    ++counters_.duplicated;
    enqueue(on_wire + draw_delay(duplicate_delays_, on_wire), packet);
  }
}

std::optional<std::vector<std::byte>> SimulatedLink::receive(LocalTime now) {
  if (in_flight_.empty() || in_flight_.begin()->first > now) return std::nullopt;
  std::vector<std::byte> bytes = std::move(in_flight_.begin()->second);
  in_flight_.erase(in_flight_.begin());
  ++counters_.delivered;
  return bytes;
}

std::size_t SimulatedLink::queued_bytes(LocalTime now) const {
  return static_cast<std::size_t>(to_seconds(line_wait(now)) * parameters_.rate_limit_bytes_per_s);
}

std::optional<LocalTime> SimulatedLink::next_due() const {
  if (in_flight_.empty()) return std::nullopt;
  return in_flight_.begin()->first;
}

// Returns whether a packet sent now is lost. Good and bad periods have exponentially distributed lengths (a two-state
// Markov chain in continuous time). All packets of a bad period are lost. The fraction of lost packets is therefore bad
// / (bad + good), from the mean lengths of the periods, at any packet rate.
bool SimulatedLink::is_lost(LocalTime now) {
  if (parameters_.loss <= 0) return false;
  const double bad_s = to_seconds(parameters_.mean_bad_period);
  const double good_s = std::min(kMaxPeriod_s, bad_s * (1 - parameters_.loss) / parameters_.loss);
  const auto draw = [&] {
    return from_seconds(std::min(kMaxPeriod_s, loss_random_.exponential(in_bad_period_ ? bad_s : good_s)));
  };
  if (!has_period_) {
    // An exponential distribution is memoryless: the rest of the current period is distributed like a whole period.
    has_period_ = true;
    in_bad_period_ = loss_random_.uniform() < parameters_.loss;
    period_end_ = now + draw();
  }
  while (period_end_ <= now) {
    in_bad_period_ = !in_bad_period_;
    period_end_ += draw();
  }
  return in_bad_period_;
}

Duration SimulatedLink::draw_delay(DelaySource& source, LocalTime now) {
  const Duration along_path = path_delay(now);
  if (parameters_.distribution != JitterDistribution::kTrace) {
    return std::max(Duration(0), parameters_.delay + variable_delay(source, now)) + along_path;
  }
  const Duration delay = parameters_.trace[source.trace_position];
  source.trace_position = (source.trace_position + 1) % parameters_.trace.size();
  return delay + along_path;
}

Duration SimulatedLink::path_delay(LocalTime now) {
  if (!std::exchange(has_path_begun_, true)) path_began_ = now;
  return parameters_.delay_path.at(path_from_ + (now - path_began_));
}

Duration SimulatedLink::variable_delay(DelaySource& source, LocalTime now) const {
  const double sigma_s = to_seconds(parameters_.jitter);
  if (sigma_s <= 0) return Duration(0);
  if (parameters_.distribution == JitterDistribution::kNormal) return from_seconds(sigma_s * draw_deviate(source, now));
  const bool is_correlated = parameters_.jitter_correlation > Duration(0);
  const double beyond =
      is_correlated ? 0.5 * std::erfc(draw_deviate(source, now) / std::numbers::sqrt2) : 1.0 - source.random.uniform();
  return from_seconds(sigma_s / kParetoUnitSigma * (std::pow(beyond, -1.0 / kParetoShape) - 1.0));
}

// Samples an Ornstein–Uhlenbeck process; the result is exact for any time step.
double SimulatedLink::draw_deviate(DelaySource& source, LocalTime now) const {
  const double fresh = source.random.normal();
  if (parameters_.jitter_correlation <= Duration(0)) return fresh;
  const double kept =
      source.has_drawn ? std::exp(-to_seconds(now - source.drawn) / to_seconds(parameters_.jitter_correlation)) : 0.0;
  source.deviate = kept * source.deviate + std::sqrt(1 - kept * kept) * fresh;
  source.drawn = now;
  source.has_drawn = true;
  return source.deviate;
}

void SimulatedLink::enqueue(LocalTime due, std::span<const std::byte> packet) {
  if (!parameters_.allows_reordering) {
    due = std::max(due, last_due_);
    last_due_ = due;
  }
  in_flight_.emplace(due, std::vector<std::byte>(packet.begin(), packet.end()));
}

}  // namespace tandem::net
