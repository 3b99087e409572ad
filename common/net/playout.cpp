#include "common/net/playout.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::net {
namespace {

constexpr Duration kPlayoutSettling{std::chrono::milliseconds(500)};
constexpr Duration kClockJump{std::chrono::milliseconds(200)};
/// Maximum weight of one gap between samples. It prevents a long silence from dominating the statistics.
constexpr Duration kMaxCountedGap{std::chrono::milliseconds(100)};

std::uint32_t microseconds(Duration duration) {
  return static_cast<std::uint32_t>(duration / std::chrono::microseconds(1));
}

/// Returns the position between two samples with positions p0, p1 and velocities v0, v1, by cubic Hermite
/// interpolation. `gap_s` is the time between the samples; u is the fraction of this time that has passed (0 to 1).
Vec3 hermite(const Vec3& p0, const Vec3& v0, const Vec3& p1, const Vec3& v1, double u, double gap_s) {
  const double u2 = u * u, u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * p0 + (u3 - 2 * u2 + u) * gap_s * v0 + (3 * u2 - 2 * u3) * p1 + (u3 - u2) * gap_s * v1;
}

/// Returns the state at the time `since` after the newest sample, by extrapolation: the twist decreases linearly to
/// zero within kRunOut (constant deceleration).
RigidState run_out(const RigidState& last, Duration since) {
  const double whole_s = to_seconds(RigidTrack::kRunOut);
  const double t_s = std::min(to_seconds(since), whole_s);
  const double left = 1 - t_s / whole_s;
  const double way_s = t_s - t_s * t_s / (2 * whole_s);
  return {integrate(last.X, last.V, way_s), {last.V.v * left, last.V.w * left}};
}

}  // namespace

void PlayoutDelay::add(Duration sampled, Duration arrived) noexcept {
  if (has_started_ && sampled <= last_sampled_) return;
  if (!has_started_) {
    has_started_ = true;
    started_ = half_began_ = arrived;
    last_sampled_ = sampled;
  }
  if (arrived - half_began_ >= settings_.window) {
    newer_ = 1 - newer_;
    halves_[newer_] = Half{};
    half_began_ = arrived;
  }
  Half& half = halves_[newer_];
  const Duration transit = arrived - sampled;
  half.base = half.is_used ? std::min(half.base, transit) : transit;
  half.is_used = true;
  const Duration gap = std::clamp(sampled - last_sampled_, Duration{0}, kMaxCountedGap);
  const Duration waiting = std::max(Duration{0}, arrived - last_sampled_ - base());
  const auto bin = std::min(static_cast<std::size_t>(waiting / kBin), kBins - 1);
  half.weight_us[bin] += microseconds(gap);
  half.sum_us += microseconds(gap);
  last_sampled_ = sampled;
}

Duration PlayoutDelay::base() const noexcept {
  const Half& newer = halves_[newer_];
  const Half& older = halves_[1 - newer_];
  return older.is_used ? std::min(newer.base, older.base) : newer.base;
}

Duration PlayoutDelay::target() const noexcept {
  const std::uint64_t sum = halves_[0].sum_us + halves_[1].sum_us;
  const auto enough = static_cast<std::uint64_t>(settings_.quantile * static_cast<double>(sum));
  std::uint64_t reached = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    reached += halves_[0].weight_us[bin] + halves_[1].weight_us[bin];
    if (reached >= enough) return base() + std::min(settings_.longest, kBin * static_cast<int>(bin + 1));
  }
  return base() + settings_.longest;
}

Duration PlayoutDelay::play_at(Duration now) noexcept {
  const Duration wanted = target();
  const Duration off = wanted > offset_ ? wanted - offset_ : offset_ - wanted;
  if (!has_played_ || now - started_ < kPlayoutSettling || off > kClockJump) {
    offset_ = wanted;
  } else {
    const auto most = std::chrono::duration_cast<Duration>((now - played_at_) * settings_.slew);
    offset_ += std::clamp(wanted - offset_, -most, most);
  }
  has_played_ = true;
  played_at_ = now;
  return now - offset_;
}

Duration PlayoutDelay::delay() const noexcept {
  // If the sender's clock jumps back by hours, base() changes at once, but offset_ only at the next call of play_at().
  // The clamp bounds the result until then.
  return has_played_ ? std::clamp(offset_ - base(), Duration{0}, settings_.longest + kClockJump) : Duration{0};
}

void RigidTrack::add(Duration sampled, const RigidState& state) noexcept {
  if (count_ > 0 && sampled <= newest_time()) return;
  if (count_ > 0 && sampled - newest_time() > kMaxGap) count_ = 0;
  if (count_ == kSamples) {
    first_ = (first_ + 1) % kSamples;
    --count_;
  }
  samples_[(first_ + count_) % kSamples] = {sampled, state};
  ++count_;
}

std::size_t RigidTrack::after(Duration time) const noexcept {
  std::size_t low = 0, high = count_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (sample(middle).time > time) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

RigidState RigidTrack::at(Duration time) const noexcept {
  if (count_ == 0) return {};
  const std::size_t next = after(time);
  if (next == count_) return run_out(newest(), time - newest_time());
  if (next == 0) return sample(0).state;
  const Sample& a = sample(next - 1);
  const Sample& b = sample(next);
  const double gap_s = to_seconds(b.time - a.time);
  const double u = to_seconds(time - a.time) / gap_s;
  RigidState state;
  state.X.p = hermite(a.state.X.p, a.state.V.v, b.state.X.p, b.state.V.v, u, gap_s);
  state.X.q = (quaternion_of(u * rotation_vector(b.state.X.q * a.state.X.q.conjugate())) * a.state.X.q).normalized();
  state.V.v = (1 - u) * a.state.V.v + u * b.state.V.v;
  state.V.w = (1 - u) * a.state.V.w + u * b.state.V.w;
  return state;
}

}  // namespace tandem::net
