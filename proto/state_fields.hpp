// Private to the state codec: writes and reads the parts that client update and server update have in common. Reading
// checks each value against the limits of state.hpp; writing does not.
#pragma once

#include <google/protobuf/arena.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "proto/state_codec.hpp"
#include "tandem/state.pb.h"

namespace tandem::proto {

inline constexpr int kPoseNumbers = 7;
inline constexpr int kTwistNumbers = 6;
inline constexpr int kWrenchNumbers = 6;
inline constexpr int kTriangleNumbers = 21;

/// Empties the arena of this thread and returns it; messages in it become invalid. The arena avoids that Protobuf
/// allocates and frees sub-messages for every message. Its first block is large enough for any message that a peer of
/// this version can send.
inline google::protobuf::Arena& fresh_arena() {
  constexpr std::size_t kBlockBytes = 64 * 1024;
  thread_local std::vector<char> block(kBlockBytes);
  thread_local google::protobuf::Arena arena(block.data(), block.size());
  arena.Reset();
  return arena;
}
template <class Message>
Message& fresh_message() {
  return *google::protobuf::Arena::CreateMessage<Message>(&fresh_arena());
}

// Returns the nanoseconds of a time; 0 for a negative one, which no monotonic clock gives. (Converted to an unsigned
// number without the clamp, it would be centuries.)
inline std::uint64_t nanoseconds_of(Duration duration) {
  return static_cast<std::uint64_t>(std::max(duration, Duration{0}).count());
}

inline bool read_time(std::uint64_t nanoseconds, Duration& out) {
  if (nanoseconds > static_cast<std::uint64_t>(kMaxTimestamp.count())) return false;
  out = Duration(static_cast<Duration::rep>(nanoseconds));
  return true;
}

template <class Clock>
bool read_time(std::uint64_t nanoseconds, std::chrono::time_point<Clock, Duration>& out) {
  Duration since_epoch{0};
  if (!read_time(nanoseconds, since_epoch)) return false;
  out = std::chrono::time_point<Clock, Duration>(since_epoch);
  return true;
}

// Returns whether the length of `a` is at most `limit`. For a NaN or an overflow of the length, the result is false.
inline bool is_within(const Vec3& a, double limit) {
  return a.norm() <= limit;
}
/// Returns whether force and torque are within their limits.
inline bool is_wrench(const Wrench& wrench) {
  return is_within(wrench.f, kMaxForceN) && is_within(wrench.t, kMaxTorqueNM);
}
inline bool is_cumulative_energy(double energy_j) {
  return energy_j >= 0 && energy_j <= kMaxEnergyJ;
}

inline bool is_unit(const Quat& q) {
  return std::abs(q.norm() - 1.0) <= kMaxQuaternionError;
}

inline bool is_in_range(const RigidState& state) {
  return is_within(state.X.p, kMaxPositionM) && is_unit(state.X.q) && is_within(state.V.v, kMaxSpeedMPerS) &&
         is_within(state.V.w, kMaxTurnRadPerS);
}

inline bool is_at_rest(const Twist& V) {
  return V.v.norm() < kRestSpeedMPerS && V.w.norm() < kRestTurnRadPerS;
}

inline void write_rigid(const RigidState& state, wire::RigidState& out) {
  out.mutable_p()->set_x_m(state.X.p.x());
  out.mutable_p()->set_y_m(state.X.p.y());
  out.mutable_p()->set_z_m(state.X.p.z());
  out.mutable_q()->set_w(state.X.q.w());
  out.mutable_q()->set_x(state.X.q.x());
  out.mutable_q()->set_y(state.X.q.y());
  out.mutable_q()->set_z(state.X.q.z());
  out.set_vx_m_per_s(state.V.v.x());
  out.set_vy_m_per_s(state.V.v.y());
  out.set_vz_m_per_s(state.V.v.z());
  out.set_wx_rad_per_s(state.V.w.x());
  out.set_wy_rad_per_s(state.V.w.y());
  out.set_wz_rad_per_s(state.V.w.z());
}

/// Checks the ranges of `state` and normalises its rotation.
inline DropReason accept_rigid(RigidState& state) {
  if (!is_in_range(state)) return DropReason::kNotFinite;
  state.X.q.normalize();
  return DropReason::kNone;
}

inline DropReason read_rigid(const wire::RigidState& in, RigidState& out) {
  if (!in.has_p() || !in.has_q()) return DropReason::kMalformed;
  out.X.p = {in.p().x_m(), in.p().y_m(), in.p().z_m()};
  out.X.q = Quat(in.q().w(), in.q().x(), in.q().y(), in.q().z());
  out.V.v = {in.vx_m_per_s(), in.vy_m_per_s(), in.vz_m_per_s()};
  out.V.w = {in.wx_rad_per_s(), in.wy_rad_per_s(), in.wz_rad_per_s()};
  return accept_rigid(out);
}

/// Reads a pose of 7 numbers: position, then quaternion (w x y z).
template <class Number>
DropReason read_pose(const google::protobuf::RepeatedField<Number>& in, Pose& out) {
  if (in.size() != kPoseNumbers) return DropReason::kMalformed;
  out.p = {in[0], in[1], in[2]};
  out.q = Quat(in[3], in[4], in[5], in[6]);
  if (!is_within(out.p, kMaxPositionM) || !is_unit(out.q)) return DropReason::kNotFinite;
  out.q.normalize();
  return DropReason::kNone;
}

template <class Number>
void write_six(const Wrench& six, google::protobuf::RepeatedField<Number>& out) {
  out.Reserve(kWrenchNumbers);
  for (const double number : six.f) out.Add(static_cast<Number>(number));
  for (const double number : six.t) out.Add(static_cast<Number>(number));
}

template <class Number>
Wrench six_of(const google::protobuf::RepeatedField<Number>& in) {
  return {Vec3(in[0], in[1], in[2]), Vec3(in[3], in[4], in[5])};
}

inline bool is_wave(const Wrench& wave) {
  return is_within(wave.f, kMaxWaveSum) && is_within(wave.t, kMaxWaveSum);
}
inline bool is_zero(const Wrench& wrench) {
  return wrench.f.isZero(0) && wrench.t.isZero(0);
}

/// Reads a wave variable; absent means zero.
inline DropReason read_wave(const google::protobuf::RepeatedField<double>& in, Wrench& out) {
  out = {};
  if (in.empty()) return DropReason::kNone;
  if (in.size() != kWrenchNumbers) return DropReason::kMalformed;
  out = six_of(in);
  return is_wave(out) ? DropReason::kNone : DropReason::kNotFinite;
}

inline bool read_delay(std::uint64_t nanoseconds, Duration& out) {
  return read_time(nanoseconds, out) && out <= kMaxDelay;
}
inline std::uint64_t nanoseconds_of_delay(Duration delay) {
  return nanoseconds_of(std::min(delay, kMaxDelay));
}

inline DropReason read_compact(const wire::CompactState& in, RigidState& out) {
  if (in.id() == 0) return DropReason::kMalformed;
  if (in.twist_size() != 0 && in.twist_size() != kTwistNumbers) return DropReason::kMalformed;
  if (const DropReason drop = read_pose(in.pose(), out.X); drop != DropReason::kNone) return drop;
  out.V = {};
  if (in.twist_size() == kTwistNumbers) {
    const Wrench numbers = six_of(in.twist());
    out.V = {numbers.f, numbers.t};
  }
  return accept_rigid(out);
}

inline DropReason read_wrench(const wire::WrenchOnHand& in, Wrench& out) {
  out.f = {in.fx_n(), in.fy_n(), in.fz_n()};
  out.t = {in.tx_n_m(), in.ty_n_m(), in.tz_n_m()};
  return is_wrench(out) ? DropReason::kNone : DropReason::kNotFinite;
}

/// Returns whether a reader would accept the state. The margin covers the rounding to single precision.
inline bool is_sendable(const RigidState& state) {
  constexpr double kInside = 1.0 - 1e-6;
  return is_within(state.X.p, kInside * kMaxPositionM) && is_unit(state.X.q) &&
         is_within(state.V.v, kInside * kMaxSpeedMPerS) && is_within(state.V.w, kInside * kMaxTurnRadPerS);
}

template <class Message>
bool parse_payload(std::span<const std::byte> payload, Message& out) {
  return payload.size() <= kMaxPayloadBytes && out.ParseFromArray(payload.data(), static_cast<int>(payload.size()));
}

/// Appends `message`. `size` must be the result of ByteSizeLong(), and the message must not have changed since that
/// call, because its cached sizes are used.
inline void append_bytes(const google::protobuf::MessageLite& message, std::size_t size, Bytes& out) {
  const std::size_t start = out.size();
  out.resize(start + size);
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(out.data() + start));
}

}  // namespace tandem::proto
