#include "common/net/fetch_rate.hpp"

#include <algorithm>
#include <numeric>

namespace tandem::net {
namespace {

/// Time for which one piece occupies the link at the current rate; it determines the size of a piece. A piece is a
/// requested part of a file. Pieces are requested in pairs (fetch_rate.hpp).
constexpr double kPiece_s = 1.75e-3;
/// Maximum credit, as time at the current rate. It lets a caller that polls too late make the requests that were due.
constexpr double kMadeUp_s = 5e-3;
/// Time between a rate reduction and the evaluation of its effect. By then the queue has drained, and the window kShort
/// contains only delays measured after the reduction.
constexpr Duration kAfterFall = std::chrono::milliseconds(100);
/// Factor by which the new allowance exceeds a queueing delay that our own traffic did not cause.
constexpr double kLeave = 1.25;
/// Interval over which the data rate of state updates is measured.
constexpr Duration kStateWindow = std::chrono::milliseconds(50);
/// If no state update arrives for this time, the data rate of state updates counts as zero.
constexpr Duration kWithoutState = std::chrono::milliseconds(200);

}  // namespace

std::size_t FetchRate::piece() const noexcept {
  return std::clamp(static_cast<std::size_t>(rate_ * kPiece_s), kMinPiece, kMaxPiece);
}

bool FetchRate::has_room_for(std::size_t bytes) const noexcept {
  const double round_trip_s = round_trip_ == Duration::max() ? 0.0 : to_seconds(round_trip_);
  const double most = rate_ * (round_trip_s + to_seconds(kAhead)) + 2.0 * static_cast<double>(piece());
  return static_cast<double>(in_flight_ + bytes) <= std::min(most, static_cast<double>(kMaxInFlight));
}

std::size_t FetchRate::bytes_to_request(LocalTime now) noexcept {
  const std::size_t bytes = piece();
  if (filled_ != LocalTime{}) {
    const double most = std::max(2.0 * static_cast<double>(bytes), rate_ * kMadeUp_s);
    credit_ = std::min(most, credit_ + rate_ * std::max(0.0, to_seconds(now - filled_)));
  }
  filled_ = now;
  has_half_pair_ = has_half_pair_ && half_pair_at_ == now;
  if (has_half_pair_) return bytes;
  return credit_ >= 2.0 * static_cast<double>(bytes) && has_room_for(2 * bytes) ? bytes : 0;
}

void FetchRate::note_request(LocalTime now, std::size_t bytes) {
  requests_.push_back({now, bytes, has_half_pair_});
  has_half_pair_ = !has_half_pair_;
  half_pair_at_ = now;
  in_flight_ += bytes;
  credit_ -= static_cast<double>(bytes);
}

void FetchRate::answered(LocalTime now) noexcept {
  if (requests_.empty()) return;
  const Request piece = requests_.front();
  requests_.pop_front();
  in_flight_ -= piece.bytes;
  round_trip_ = std::min(round_trip_, std::max(Duration{0}, now - piece.at));
  if (piece.is_second) note_pair(piece.bytes, now - first_came_);
  first_came_ = now;
  if (piece.at >= round_from_ && pairs_ > 0) end_round(now);
}

void FetchRate::note_pair(std::size_t bytes, Duration apart) noexcept {
  pair_s_per_byte_[pairs_ % kPairs] = std::max(0.0, to_seconds(apart)) / static_cast<double>(bytes);
  ++pairs_;
}

void FetchRate::state_came(LocalTime now, Duration delay, std::size_t bytes) noexcept {
  recent_.add(now.time_since_epoch(), delay);
  usual_.add(now.time_since_epoch(), delay);
  if (state_from_ == LocalTime{}) {
    state_from_ = now;
    return;
  }
  state_bytes_ += static_cast<double>(bytes);
  if (now - state_from_ < kStateWindow) return;
  state_bytes_per_s_ = state_bytes_ / to_seconds(now - state_from_);
  state_bytes_ = 0;
  state_from_ = now;
}

double FetchRate::free_bytes_per_s() const noexcept {
  std::array<double, kPairs> times = pair_s_per_byte_;
  const auto known = static_cast<std::ptrdiff_t>(std::min(pairs_, kPairs)), shorter = (known + 1) / 2;
  std::sort(times.begin(), times.begin() + known);
  const auto rate_of = [&times](std::ptrdiff_t count) {
    const double fastest = 2 * kMaxRate_bytes_per_s;
    const double sum_s = std::accumulate(times.begin(), times.begin() + count, 0.0);
    return sum_s * fastest > static_cast<double>(count) ? static_cast<double>(count) / sum_s : fastest;
  };
  return std::max(0.0, std::min(rate_of(shorter) - std::max(0.0, state_bytes_per_s_), rate_of(known)));
}

void FetchRate::end_round(LocalTime now) noexcept {
  round_from_ = now;
  if (begun_ == LocalTime{}) begun_ = now;
  const double most = std::clamp(kShare * free_bytes_per_s(), kMinRate_bytes_per_s, kMaxRate_bytes_per_s);
  const Duration queue = usual_.least() == Duration::max() ? Duration{0} : recent_.least() - usual_.least();
  if (queue > allowed_ && rate_ < kFall * most) {
    allowed_ = std::min(kMaxAllowed, from_seconds(kLeave * to_seconds(queue)));
    is_careful_ = false;
  } else if (queue > allowed_) {
    rate_ = std::max(kMinRate_bytes_per_s, kFall * std::min(rate_, most));
    is_careful_ = true;
    round_from_ = now + kAfterFall;
    return;
  }
  const bool knows_state = state_bytes_per_s_ >= 0 || now - begun_ > kWithoutState;
  const double faster = rate_ * (is_careful_ ? kCareful : 2.0);
  rate_ = std::min(most, knows_state ? faster : rate_);
}

}  // namespace tandem::net
