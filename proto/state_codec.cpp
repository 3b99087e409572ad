#include "proto/state_codec.hpp"

#include <google/protobuf/arena.h>
#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "tandem/state.pb.h"

namespace tandem {
namespace {

constexpr int kPoseNumbers = 7;
constexpr int kTwistNumbers = 6;

/// Where this thread builds and parses its messages. Protobuf frees sub-messages at every Clear() unless they
/// live in an arena; the first block holds any message that a peer of this version can send.
class Scratch {
 public:
  template <class Message>
  Message& fresh() {
    arena_.Reset();
    return *google::protobuf::Arena::CreateMessage<Message>(&arena_);
  }

 private:
  static constexpr std::size_t kBlockBytes = 64 * 1024;
  std::vector<char> block_ = std::vector<char>(kBlockBytes);
  google::protobuf::Arena arena_{block_.data(), block_.size()};
};

Scratch& scratch() {
  thread_local Scratch scratch;
  return scratch;
}

// Negative times and ages do not occur on monotonic clocks; they would read as centuries.
std::uint64_t nanoseconds_of(Duration duration) {
  return static_cast<std::uint64_t>(std::max(duration, Duration{0}).count());
}

bool read_time(std::uint64_t nanoseconds, Duration& out) {
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

// Written so that NaN fails: every comparison with it is false. The norm of a huge vector is infinite and fails too.
bool is_within(const Vec3& a, double limit) {
  return a.norm() <= limit;
}
bool is_cumulative_energy(double energy_j) {
  return energy_j >= 0 && energy_j <= kMaxEnergyJ;
}

bool is_unit(const Quat& q) {
  return std::abs(q.norm() - 1.0) <= kMaxQuaternionError;
}

bool is_in_range(const RigidState& state) {
  return is_within(state.X.p, kMaxPositionM) && is_unit(state.X.q) && is_within(state.V.v, kMaxSpeedMPerS) &&
         is_within(state.V.w, kMaxTurnRadPerS);
}

bool is_at_rest(const Twist& V) {
  return V.v.norm() < kRestSpeedMPerS && V.w.norm() < kRestTurnRadPerS;
}

void write_rigid(const RigidState& state, wire::RigidState& out) {
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

/// Range-checks `state` and makes its rotation unit length.
DropReason accept_rigid(RigidState& state) {
  if (!is_in_range(state)) return DropReason::kNotFinite;
  state.X.q.normalize();
  return DropReason::kNone;
}

DropReason read_rigid(const wire::RigidState& in, RigidState& out) {
  if (!in.has_p() || !in.has_q()) return DropReason::kMalformed;
  out.X.p = {in.p().x_m(), in.p().y_m(), in.p().z_m()};
  out.X.q = Quat(in.q().w(), in.q().x(), in.q().y(), in.q().z());
  out.V.v = {in.vx_m_per_s(), in.vy_m_per_s(), in.vz_m_per_s()};
  out.V.w = {in.wx_rad_per_s(), in.wy_rad_per_s(), in.wz_rad_per_s()};
  return accept_rigid(out);
}

void write_compact(std::uint32_t id, const RigidState& state, wire::CompactState& out) {
  out.set_id(id);
  const auto add_to = [](google::protobuf::RepeatedField<float>& numbers, double number) {
    numbers.Add(static_cast<float>(number));
  };
  google::protobuf::RepeatedField<float>& pose = *out.mutable_pose();
  pose.Reserve(kPoseNumbers);
  for (const double number : state.X.p) add_to(pose, number);
  for (const double number : {state.X.q.w(), state.X.q.x(), state.X.q.y(), state.X.q.z()}) add_to(pose, number);
  if (is_at_rest(state.V)) return;
  google::protobuf::RepeatedField<float>& twist = *out.mutable_twist();
  twist.Reserve(kTwistNumbers);
  for (const double number : state.V.v) add_to(twist, number);
  for (const double number : state.V.w) add_to(twist, number);
}

DropReason read_compact(const wire::CompactState& in, RigidState& out) {
  if (in.id() == 0 || in.pose_size() != kPoseNumbers) return DropReason::kMalformed;
  if (in.twist_size() != 0 && in.twist_size() != kTwistNumbers) return DropReason::kMalformed;
  out.X.p = {in.pose(0), in.pose(1), in.pose(2)};
  out.X.q = Quat(in.pose(3), in.pose(4), in.pose(5), in.pose(6));
  out.V = {};
  if (in.twist_size() == kTwistNumbers) {
    out.V.v = {in.twist(0), in.twist(1), in.twist(2)};
    out.V.w = {in.twist(3), in.twist(4), in.twist(5)};
  }
  return accept_rigid(out);
}

void write_wrench(const Wrench& wrench, wire::WrenchOnHand& out) {
  out.set_fx_n(wrench.f.x());
  out.set_fy_n(wrench.f.y());
  out.set_fz_n(wrench.f.z());
  out.set_tx_n_m(wrench.t.x());
  out.set_ty_n_m(wrench.t.y());
  out.set_tz_n_m(wrench.t.z());
}

DropReason read_wrench(const wire::WrenchOnHand& in, Wrench& out) {
  out.f = {in.fx_n(), in.fy_n(), in.fz_n()};
  out.t = {in.tx_n_m(), in.ty_n_m(), in.tz_n_m()};
  const bool is_sane = is_within(out.f, kMaxForceN) && is_within(out.t, kMaxTorqueNM);
  return is_sane ? DropReason::kNone : DropReason::kNotFinite;
}

template <class Message>
bool parse_payload(std::span<const std::byte> payload, Message& out) {
  return payload.size() <= kMaxPayloadBytes && out.ParseFromArray(payload.data(), static_cast<int>(payload.size()));
}

/// `message` must have its sizes cached: ByteSizeLong() gave `size`, and nothing has changed since.
void append_bytes(const google::protobuf::MessageLite& message, std::size_t size, Bytes& out) {
  const std::size_t start = out.size();
  out.resize(start + size);
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(out.data() + start));
}

/// Everything but bodies and users: always sent.
void write_own_part(const ServerUpdate& update, wire::ServerUpdate& out) {
  out.set_step(update.step.value);
  out.set_stepped_server_ns(nanoseconds_of(update.stepped.time_since_epoch()));
  out.set_answered_input_tick(update.answered_input.value);
  out.set_echoed_local_ns(nanoseconds_of(update.echoed_sent.time_since_epoch()));
  out.set_received_server_ns(nanoseconds_of(update.received.time_since_epoch()));
  out.set_sent_server_ns(nanoseconds_of(update.sent.time_since_epoch()));
  write_rigid(update.tool, *out.mutable_tool());
  write_wrench(update.wrench_on_hand_W, *out.mutable_wrench_on_hand());
  out.set_held_body(update.held_body.value);
  out.set_tick_faults(update.tick_faults);
  out.set_energy_into_world_j(update.energy_into_world_j);
  out.set_energy_from_world_j(update.energy_from_world_j);
  // Clamped, unlike the rest: overlapping atoms give any energy, up to infinity, in a sound world.
  out.set_field_energy_kj_per_mol(
      std::clamp(update.field_energy_kj_per_mol, -kMaxFieldEnergyKjPerMol, kMaxFieldEnergyKjPerMol));
}

DropReason read_own_part(const wire::ServerUpdate& in, ServerUpdate& out) {
  if (!in.has_tool() || !in.has_wrench_on_hand()) return DropReason::kMalformed;
  out.step.value = in.step();
  out.answered_input.value = in.answered_input_tick();
  out.held_body.value = in.held_body();
  out.tick_faults = in.tick_faults();
  out.energy_into_world_j = in.energy_into_world_j();
  out.energy_from_world_j = in.energy_from_world_j();
  out.field_energy_kj_per_mol = in.field_energy_kj_per_mol();
  const bool has_times = read_time(in.stepped_server_ns(), out.stepped) &&
                         read_time(in.echoed_local_ns(), out.echoed_sent) &&
                         read_time(in.received_server_ns(), out.received) && read_time(in.sent_server_ns(), out.sent);
  const bool has_energies = is_cumulative_energy(out.energy_into_world_j) &&
                            is_cumulative_energy(out.energy_from_world_j) &&
                            std::abs(out.field_energy_kj_per_mol) <= kMaxFieldEnergyKjPerMol;
  if (!has_times || !has_energies) return DropReason::kNotFinite;
  if (const DropReason drop = read_rigid(in.tool(), out.tool); drop != DropReason::kNone) return drop;
  return read_wrench(in.wrench_on_hand(), out.wrench_on_hand_W);
}

template <class Items>
bool has_id(const Items& items, std::uint32_t id) {
  return std::ranges::any_of(items, [id](const auto& item) { return item.id.value == id; });
}

DropReason read_bodies(const wire::ServerUpdate& in, ServerUpdate& out) {
  out.bodies.clear();
  if (in.bodies_size() > static_cast<int>(kMaxBodies)) return DropReason::kMalformed;
  for (const wire::CompactState& compact : in.bodies()) {
    BodyState body{BodyId{compact.id()}, {}, UserId{compact.held_by_user()}};
    if (const DropReason drop = read_compact(compact, body.state); drop != DropReason::kNone) return drop;
    if (has_id(out.bodies, compact.id())) return DropReason::kMalformed;
    out.bodies.push_back(body);
  }
  return DropReason::kNone;
}

DropReason read_users(const wire::ServerUpdate& in, ServerUpdate& out) {
  out.users.clear();
  if (in.users_size() > static_cast<int>(kMaxUsers)) return DropReason::kMalformed;
  for (const wire::CompactState& compact : in.users()) {
    OtherUserState user{UserId{compact.id()}, {}, BodyId{compact.holds_body()}};
    if (const DropReason drop = read_compact(compact, user.tool); drop != DropReason::kNone) return drop;
    if (has_id(out.users, compact.id())) return DropReason::kMalformed;
    out.users.push_back(user);
  }
  return DropReason::kNone;
}

/// The same items as in `items`, in their order, each with what `turns` knew of it.
template <class Items, class Turns>
Turns turns_following(const Items& items, const Turns& turns) {
  using Turn = typename Turns::value_type;
  Turns followed;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::uint32_t id = items[i].id.value;
    // Nearly always nobody came or went, and everything is where it was.
    const bool is_in_place = i < turns.size() && turns[i].id == id;
    const auto known = is_in_place ? turns.begin() + static_cast<std::ptrdiff_t>(i)
                                   : std::ranges::find(turns, id, [](const Turn& turn) { return turn.id; });
    followed.push_back(known != turns.end() ? *known : Turn{.id = id, .sent = 0, .place = 0, .was_moving = false});
  }
  return followed;
}

/// The written priority after the own part; lower goes first.
enum Rank : int { kRankHeld, kRankOverdue, kRankUser, kRankHeldByOther, kRankMoving, kRankResting };

Rank rank_of(const BodyState& body, bool was_moving, BodyId held_body) {
  if (body.id == held_body) return kRankHeld;
  if (body.held_by.is_valid()) return kRankHeldByOther;
  return was_moving || !is_at_rest(body.state.V) ? kRankMoving : kRankResting;
}

/// A little inside the reader's limits, so that rounding to single precision cannot cross them.
bool is_sendable(const RigidState& state) {
  constexpr double kInside = 1.0 - 1e-6;
  return is_within(state.X.p, kInside * kMaxPositionM) && is_unit(state.X.q) &&
         is_within(state.V.v, kInside * kMaxSpeedMPerS) && is_within(state.V.w, kInside * kMaxTurnRadPerS);
}

// The arithmetic of keep_last_if_it_fits(): a one-byte tag before the length of each item.
static_assert(wire::ServerUpdate::kBodiesFieldNumber < 16 && wire::ServerUpdate::kUsersFieldNumber < 16);
constexpr std::size_t kTagBytes = 1;
/// A resting body with a one-byte id: when less is left, nothing fits any more.
constexpr std::size_t kSmallestItemBytes = 34;

using WireItems = google::protobuf::RepeatedPtrField<wire::CompactState>;

/// Keeps the last of `items` when it fits into `left` bytes, which then shrinks; else takes it out again.
bool keep_last_if_it_fits(WireItems& items, std::size_t& left) {
  const std::size_t size = items.rbegin()->ByteSizeLong();
  const std::size_t bytes =
      kTagBytes + google::protobuf::io::CodedOutputStream::VarintSize32(static_cast<std::uint32_t>(size)) + size;
  if (bytes > left) {
    items.RemoveLast();
    return false;
  }
  left -= bytes;
  return true;
}

void write_body(const BodyState& body, wire::CompactState& out) {
  write_compact(body.id.value, body.state, out);
  out.set_held_by_user(body.held_by.value);
}

void write_user(const OtherUserState& user, wire::CompactState& out) {
  write_compact(user.id.value, user.tool, out);
  out.set_holds_body(user.holds.value);
}

}  // namespace

void append_client_update(const ClientUpdate& update, Bytes& out) {
  auto& message = scratch().fresh<wire::ClientUpdate>();
  message.set_input_tick(update.input_tick.value);
  write_rigid(update.handle, *message.mutable_handle());
  message.set_buttons(update.buttons);
  message.set_handle_valid(update.handle_valid);
  message.set_sent_local_ns(nanoseconds_of(update.sent.time_since_epoch()));
  message.set_acknowledged_step(update.acknowledged_step.value);
  message.set_acknowledged_server_ns(nanoseconds_of(update.acknowledged_sent.time_since_epoch()));
  message.set_acknowledged_held_ns(nanoseconds_of(update.acknowledged_held));
  message.set_energy_to_hand_j(update.energy_to_hand_j);
  message.set_energy_from_hand_j(update.energy_from_hand_j);
  append_bytes(message, message.ByteSizeLong(), out);
}

DropReason parse_client_update(std::span<const std::byte> payload, ClientUpdate& out) {
  auto& in = scratch().fresh<wire::ClientUpdate>();
  if (!parse_payload(payload, in) || !in.has_handle()) return DropReason::kMalformed;
  out.input_tick.value = in.input_tick();
  out.handle_valid = in.handle_valid();
  out.buttons = in.buttons();
  out.acknowledged_step.value = in.acknowledged_step();
  out.energy_to_hand_j = in.energy_to_hand_j();
  out.energy_from_hand_j = in.energy_from_hand_j();
  const bool has_times = read_time(in.sent_local_ns(), out.sent) &&
                         read_time(in.acknowledged_server_ns(), out.acknowledged_sent) &&
                         read_time(in.acknowledged_held_ns(), out.acknowledged_held);
  if (!has_times || !is_cumulative_energy(out.energy_to_hand_j) || !is_cumulative_energy(out.energy_from_hand_j)) {
    return DropReason::kNotFinite;
  }
  return read_rigid(in.handle(), out.handle);
}

void ServerUpdateEncoder::follow_membership(const ServerUpdate& update) {
  body_turns_ = turns_following(update.bodies, body_turns_);
  user_turns_ = turns_following(update.users, user_turns_);
}

void ServerUpdateEncoder::promote_overdue(Candidates& candidates) const {
  for (std::size_t promoted = 0; promoted < kOverduePerMessage; ++promoted) {
    Candidate* longest_waiting = nullptr;
    for (Candidate& candidate : candidates) {
      const bool is_overdue = candidate.rank > kRankOverdue && message_ - candidate.sent >= kOverdueMessages;
      if (!is_overdue) continue;
      if (longest_waiting == nullptr || candidate.turn() < longest_waiting->turn()) longest_waiting = &candidate;
    }
    if (longest_waiting == nullptr) return;
    longest_waiting->rank = kRankOverdue;
  }
}

ServerUpdateEncoder::Candidates ServerUpdateEncoder::candidates_in_order(const ServerUpdate& update) const {
  Candidates candidates;
  for (std::size_t i = 0; i < update.bodies.size(); ++i) {
    const BodyState& body = update.bodies[i];
    if (!is_sendable(body.state)) continue;
    const Turn& turn = body_turns_[i];
    const int rank = rank_of(body, turn.was_moving, update.held_body);
    candidates.push_back({.is_user = false, .index = i, .rank = rank, .sent = turn.sent, .place = turn.place});
  }
  for (std::size_t i = 0; i < update.users.size(); ++i) {
    if (!is_sendable(update.users[i].tool)) continue;
    const Turn& turn = user_turns_[i];
    candidates.push_back({.is_user = true, .index = i, .rank = kRankUser, .sent = turn.sent, .place = turn.place});
  }
  promote_overdue(candidates);
  std::ranges::sort(candidates, {}, [](const Candidate& c) { return std::tuple(c.rank, c.turn()); });
  return candidates;
}

void ServerUpdateEncoder::append(const ServerUpdate& update, Bytes& out) {
  ++message_;
  follow_membership(update);
  auto& message = scratch().fresh<wire::ServerUpdate>();
  write_own_part(update, message);
  std::size_t left = kMaxPayloadBytes - message.ByteSizeLong();
  std::size_t sent = 0;
  for (const Candidate& candidate : candidates_in_order(update)) {
    if (left < kSmallestItemBytes) break;
    Turn& turn = candidate.is_user ? user_turns_[candidate.index] : body_turns_[candidate.index];
    if (candidate.is_user) {
      write_user(update.users[candidate.index], *message.add_users());
      if (!keep_last_if_it_fits(*message.mutable_users(), left)) continue;
    } else {
      write_body(update.bodies[candidate.index], *message.add_bodies());
      if (!keep_last_if_it_fits(*message.mutable_bodies(), left)) continue;
      turn.was_moving = !is_at_rest(update.bodies[candidate.index].state.V);
    }
    turn.sent = message_;
    turn.place = sent++;
  }
  thinned_ = update.bodies.size() + update.users.size() - sent;
  append_bytes(message, message.ByteSizeLong(), out);
}

DropReason parse_server_update(std::span<const std::byte> payload, ServerUpdate& out) {
  auto& in = scratch().fresh<wire::ServerUpdate>();
  if (!parse_payload(payload, in)) return DropReason::kMalformed;
  if (const DropReason drop = read_own_part(in, out); drop != DropReason::kNone) return drop;
  if (const DropReason drop = read_bodies(in, out); drop != DropReason::kNone) return drop;
  return read_users(in, out);
}

}  // namespace tandem
