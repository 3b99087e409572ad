#include "server/room/input_playout.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::server {
namespace {

/// Tick rate of a client that is assumed until its second input arrives: the 1 kHz of usual haptic loops.
constexpr double kUsualTicks_per_s = 1000;
/// Longest silence between two inputs that counts as network jitter. A longer silence counts as an absence of the user.
constexpr Duration kMaxGap = std::chrono::milliseconds(115);
/// Largest difference [ticks] between the played tick and the tick that the delay demands. Beyond it the stride, the
/// advance of the played tick per step, changes (see InputPlayout).
constexpr double kStrideTolerance = 0.75;
/// Length below which lead_, the offset of the played position after an extrapolation, is set to zero. A hand cannot
/// feel a jump of this size.
constexpr double kNoLead_m = 1e-6;
/// Largest plausible difference of ticks between two inputs. A larger difference means that the client has restarted
/// its count. The limit also keeps differences of ticks exact as doubles.
constexpr std::uint32_t kMaxStep = 1U << 20U;

/// A point of a cubic in time.
struct Cubic {
  Vec3 value;
  Vec3 rate;
};
/// Returns value and rate of a cubic at the parameter `u` in 0..1. The cubic lasts `length_s`, rises from 0 to `to`,
/// and has the rates `from_rate` and `to_rate` at its ends.
Cubic cubic(const Vec3& to, const Vec3& from_rate, const Vec3& to_rate, double length_s, double u) {
  const double u2 = u * u, u3 = u2 * u;
  const Vec3 value = (3 * u2 - 2 * u3) * to + length_s * ((u3 - 2 * u2 + u) * from_rate + (u3 - u2) * to_rate);
  const Vec3 rate = (6 * u - 6 * u2) / length_s * to + (3 * u2 - 4 * u + 1) * from_rate + (3 * u2 - 2 * u) * to_rate;
  return {value, rate};
}

RigidState between(const RigidState& from, const RigidState& to, double length_s, double u) {
  const Cubic way = cubic(to.X.p - from.X.p, from.V.v, to.V.v, length_s, u);
  // The cubic interpolates the rotation vector θ between the two poses. To first order in θ, the angular velocity is ω
  // = θ̇ + θ × θ̇ / 2. At the beginning θ is 0, so ω = θ̇.
  const Vec3 turn = rotation_vector(to.X.q * from.X.q.conjugate());
  const Cubic turning = cubic(turn, from.V.w, to.V.w - 0.5 * turn.cross(to.V.w), length_s, u);
  const Vec3 w = turning.rate + 0.5 * turning.value.cross(turning.rate);
  return {{from.X.p + way.value, (quaternion_of(turning.value) * from.X.q).normalized()},
          {clamped_to_length(way.rate, proto::kMaxSpeedMPerS), clamped_to_length(w, proto::kMaxTurnRadPerS)}};
}

RigidState held(RigidState state, double underrun_s) {
  const double left = std::clamp(1 - underrun_s / InputPlayout::kTwistFade_s, 0.0, 1.0);
  state.V.v *= left;
  state.V.w *= left;
  return state;
}

}  // namespace

const PlayedInput& InputPlayout::input(std::size_t age) const noexcept {
  return inputs_[(newest_ + kHistory - age) % kHistory];
}

void InputPlayout::receive(const proto::ClientUpdate& update, Duration now) noexcept {
  const Duration sent = update.sent.time_since_epoch();
  if (count_ > 0) {
    if (update.input_tick <= input(0).tick || sent <= input(0).sent) return;
    const bool follows = sent - input(0).sent <= kMaxGap && update.input_tick.value - input(0).tick.value <= kMaxStep;
    if (!follows) reset();
  }
  delay_.add(sent, now);
  newest_ = (newest_ + 1) % kHistory;
  inputs_[newest_] = {.tick = update.input_tick,
                      .handle = update.handle,
                      .buttons = update.buttons,
                      .energy_to_hand_j = update.energy_to_hand_j,
                      .energy_from_hand_j = update.energy_from_hand_j,
                      .on_hand_W = update.on_hand_W,
                      .sent = sent};
  count_ = std::min(count_ + 1, kHistory);
}

void InputPlayout::reset() noexcept {
  count_ = 0;
  played_ = 0;
  steps_behind_ = 0;
  underrun_s_ = 0;
  has_run_on_ = false;
  due_ = 0;
  ran_to_ = 0;
  lead_.setZero();
  delay_.reset();
}

double InputPlayout::ticks_per_second() const noexcept {
  const PlayedInput& oldest = input(count_ - 1);
  const PlayedInput& newest = input(0);
  const auto ticks = static_cast<double>(newest.tick.value - oldest.tick.value);
  return count_ > 1 ? ticks / to_seconds(newest.sent - oldest.sent) : kUsualTicks_per_s;
}

/// Returns the number of ticks from the oldest stored input to `client_time`, a time of the client's clock. Between two
/// stored inputs the ticks are interpolated. Before the first and after the last one they are extrapolated at the mean
/// tick rate.
double InputPlayout::ticks_until(Duration client_time) const noexcept {
  std::size_t age = 0;
  while (age + 1 < count_ && input(age).sent > client_time) ++age;
  const PlayedInput& before = input(age);
  double rate = ticks_per_second();
  if (age > 0 && before.sent <= client_time) {
    const PlayedInput& after = input(age - 1);
    rate = static_cast<double>(after.tick.value - before.tick.value) / to_seconds(after.sent - before.sent);
  }
  const std::uint64_t first = input(count_ - 1).tick.value;
  return static_cast<double>(before.tick.value - first) + to_seconds(client_time - before.sent) * rate;
}

/// Selects the tick to play. It never precedes the last played tick. If the played tick lags behind, it advances by two
/// strides instead of one in every fourth step (kCatchUpSteps).
/// In      wanted  tick that the delay demands now, counted from the oldest input
void InputPlayout::choose_tick(double wanted) noexcept {
  const std::uint64_t first = input(count_ - 1).tick.value;
  const auto last = static_cast<double>(input(0).tick.value - first);
  const double so_far = played_ > first ? static_cast<double>(played_ - first) : 0;
  const double stride = std::round(step_s_ * ticks_per_second());
  const bool keeps_stride = played_ != 0 && std::abs(wanted - so_far - stride) <= kStrideTolerance;
  double chosen = keeps_stride ? so_far + stride : std::round(wanted);
  if (played_ != 0 && !has_run_on_) {
    steps_behind_ = chosen > so_far + std::max(stride, 1.0) ? steps_behind_ + 1 : 0;
    chosen = std::min(chosen, so_far + std::max(stride, 1.0) * (steps_behind_ % kCatchUpSteps == 1 ? 2 : 1));
  }
  played_ = first + static_cast<std::uint64_t>(std::clamp(chosen, so_far, last));
}

PlayedInput InputPlayout::at_tick(std::uint64_t tick) const noexcept {
  std::size_t age = 0;
  while (age + 1 < count_ && input(age).tick.value > tick) ++age;
  const PlayedInput& before = input(age);
  if (age == 0 || before.tick.value == tick) return before;
  const PlayedInput& after = input(age - 1);
  const double u =
      static_cast<double>(tick - before.tick.value) / static_cast<double>(after.tick.value - before.tick.value);
  const double length_s = to_seconds(input(age - 1).sent - input(age).sent);
  PlayedInput played{Tick{tick},
                     between(before.handle, after.handle, length_s, u),
                     after.buttons,
                     std::lerp(before.energy_to_hand_j, after.energy_to_hand_j, u),
                     std::lerp(before.energy_from_hand_j, after.energy_from_hand_j, u),
                     before.on_hand_W * (1 - u) + after.on_hand_W * u};
  return played;
}

std::optional<PlayedInput> InputPlayout::play(Duration now) noexcept {
  if (count_ == 0) return std::nullopt;
  const double wanted = ticks_until(delay_.play_at(now));
  choose_tick(wanted);
  const std::uint64_t first = input(count_ - 1).tick.value;
  const auto last = static_cast<double>(input(0).tick.value - first);
  const bool has_underrun = wanted > last + 0.5;
  due_ = has_underrun ? first + static_cast<std::uint64_t>(std::min(wanted, last + kMaxStep) + 0.5) : played_;
  underrun_s_ = has_underrun ? underrun_s_ + step_s_ : 0;
  PlayedInput played = at_tick(played_);
  played.has_underrun = has_underrun;
  played.handle = held(played.handle, underrun_s_);
  lead(played);
  played.tick.value = std::max(played.tick.value, ran_to_);
  return played;
}

/// Adds the offset lead_ to the played position, so that the position does not jump at the end of an extrapolation by
/// run_on().
/// * During an underrun, lead_ holds the position to which run_on() has extrapolated.
/// * After the underrun, lead_ decays with the time constant kLeadFade_s, and the position returns to the played
///   inputs.
void InputPlayout::lead(PlayedInput& played) noexcept {
  if (has_run_on_) lead_ = played_p_ - played.handle.X.p;
  if (!played.has_underrun) {
    has_run_on_ = false;
    lead_ = lead_.norm() < kNoLead_m ? Vec3(Vec3::Zero()) : Vec3(lead_ * (1 - step_s_ / kLeadFade_s));
  }
  played.handle.X.p += lead_;
  played_p_ = played.handle.X.p;
}

void InputPlayout::run_on(PlayedInput& played) noexcept {
  has_run_on_ = true;
  ran_to_ = std::max(ran_to_, due_);
  played.tick.value = ran_to_;
  const Vec3 v = std::max(0.0, 1 - underrun_s_ / kRunOn_s) * input(0).handle.V.v;
  const Vec3 more = clamped_to_length(lead_ + step_s_ * v, kRunOnMost_m) - lead_;
  lead_ += more;
  played.handle.X.p += more;
  played.handle.V.v = more / step_s_;
  played_p_ = played.handle.X.p;
}

}  // namespace tandem::server
