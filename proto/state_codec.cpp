#include "proto/state_codec.hpp"

#include <google/protobuf/arena.h>
#include <google/protobuf/io/coded_stream.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "tandem/state.pb.h"

namespace tandem::proto {
namespace {

constexpr int kPoseNumbers = 7;
constexpr int kTwistNumbers = 6;
constexpr int kWrenchNumbers = 6;
constexpr int kTriangleNumbers = 21;

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

/// A number each of the vector and of the quaternion (w x y z), and so on for the others below.
template <class Number>
void write_pose(const Pose& X, google::protobuf::RepeatedField<Number>& out) {
  out.Reserve(kPoseNumbers);
  for (const double number : X.p) out.Add(static_cast<Number>(number));
  for (const double number : {X.q.w(), X.q.x(), X.q.y(), X.q.z()}) out.Add(static_cast<Number>(number));
}

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

bool is_wave(const Wrench& wave) {
  return is_within(wave.f, kMaxWaveSum) && is_within(wave.t, kMaxWaveSum);
}
bool is_zero(const Wrench& wrench) {
  return wrench.f.isZero(0) && wrench.t.isZero(0);
}

/// Absent: zeros.
DropReason read_wave(const google::protobuf::RepeatedField<double>& in, Wrench& out) {
  out = {};
  if (in.empty()) return DropReason::kNone;
  if (in.size() != kWrenchNumbers) return DropReason::kMalformed;
  out = six_of(in);
  return is_wave(out) ? DropReason::kNone : DropReason::kNotFinite;
}

bool read_delay(std::uint64_t nanoseconds, Duration& out) {
  return read_time(nanoseconds, out) && out <= kMaxDelay;
}
std::uint64_t nanoseconds_of_delay(Duration delay) {
  return nanoseconds_of(std::min(delay, kMaxDelay));
}

/// A stiffness that is negative in some direction would give a tool energy out of nothing.
bool is_never_negative(const decltype(SoftContact::stiffness)& stiffness) {
  const Eigen::SelfAdjointEigenSolver<decltype(SoftContact::stiffness)> solver(stiffness, Eigen::EigenvaluesOnly);
  const auto& values = solver.eigenvalues();  // in rising order
  return values(0) >= -kMaxNegativeStiffness * std::max(values(5), 0.0);
}

bool is_in_range(const SoftContact& contact) {
  const bool has_lengths = contact.trust_radius_m > 0 && contact.trust_radius_m <= kMaxPositionM &&
                           contact.lever_m >= 0 && contact.lever_m <= kMaxPositionM;
  const bool has_wrench = is_within(contact.wrench_W.f, kMaxForceN) && is_within(contact.wrench_W.t, kMaxTorqueNM);
  const bool has_pose = is_within(contact.X_WT0.p, kMaxPositionM) && is_unit(contact.X_WT0.q);
  return has_lengths && has_wrench && has_pose && contact.stiffness.allFinite() &&
         contact.stiffness.cwiseAbs().maxCoeff() <= kMaxContactStiffness && is_never_negative(contact.stiffness);
}

void write_soft_contact(const SoftContact& contact, wire::SoftContact& out) {
  write_six(contact.wrench_W, *out.mutable_wrench());
  out.mutable_stiffness()->Reserve(kTriangleNumbers);
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) out.add_stiffness(static_cast<float>(contact.stiffness(row, column)));
  }
  write_pose(contact.X_WT0, *out.mutable_pose());
  out.set_trust_radius_m(contact.trust_radius_m);
  out.set_lever_m(contact.lever_m);
}

DropReason read_soft_contact(const wire::SoftContact& in, SoftContact& out) {
  if (in.wrench_size() != kWrenchNumbers || in.stiffness_size() != kTriangleNumbers) return DropReason::kMalformed;
  if (const DropReason drop = read_pose(in.pose(), out.X_WT0); drop != DropReason::kNone) return drop;
  out.wrench_W = six_of(in.wrench());
  for (int row = 0, next = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      out.stiffness(row, column) = out.stiffness(column, row) = in.stiffness(next++);
    }
  }
  out.trust_radius_m = in.trust_radius_m();
  out.lever_m = in.lever_m();
  return is_in_range(out) ? DropReason::kNone : DropReason::kNotFinite;
}

void write_compact(std::uint32_t id, const RigidState& state, wire::CompactState& out) {
  out.set_id(id);
  write_pose(state.X, *out.mutable_pose());
  if (!is_at_rest(state.V)) write_six({state.V.v, state.V.w}, *out.mutable_twist());
}

DropReason read_compact(const wire::CompactState& in, RigidState& out) {
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

/// What a client with a local model, or with wave variables, needs besides.
void write_bridge_part(const ServerUpdate& update, wire::ServerUpdate& out) {
  if (update.held_body.is_valid()) write_pose(update.X_BT, *out.mutable_tool_in_held_body());
  out.set_joint_share(update.joint_share);
  out.set_playout_ns(nanoseconds_of_delay(update.playout));
  out.set_slowest_loop_ns(nanoseconds_of_delay(update.slowest_loop));
  // One that is out of range would make the whole message unreadable.
  if (is_in_range(update.soft_contact)) write_soft_contact(update.soft_contact, *out.mutable_soft_contact());
  if (!is_zero(update.wave)) write_six(update.wave, *out.mutable_wave());
}

DropReason read_bridge_part(const wire::ServerUpdate& in, ServerUpdate& out) {
  out.joint_share = in.joint_share();
  const bool is_share = out.joint_share >= 0 && out.joint_share <= 1;
  const bool has_delays =
      read_delay(in.playout_ns(), out.playout) && read_delay(in.slowest_loop_ns(), out.slowest_loop);
  if (!is_share || !has_delays) return DropReason::kNotFinite;
  out.X_BT = {};
  if (out.held_body.is_valid() != !in.tool_in_held_body().empty()) return DropReason::kMalformed;
  if (out.held_body.is_valid()) {
    if (const DropReason drop = read_pose(in.tool_in_held_body(), out.X_BT); drop != DropReason::kNone) return drop;
  }
  out.soft_contact = {};
  if (in.has_soft_contact()) {
    const DropReason drop = read_soft_contact(in.soft_contact(), out.soft_contact);
    if (drop != DropReason::kNone) return drop;
  }
  return read_wave(in.wave(), out.wave);
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
  write_bridge_part(update, out);
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
  if (const DropReason drop = read_wrench(in.wrench_on_hand(), out.wrench_on_hand_W); drop != DropReason::kNone) {
    return drop;
  }
  return read_bridge_part(in, out);
}

template <class Items>
bool has_id(const Items& items, std::uint32_t id) {
  return std::ranges::any_of(items, [id](const auto& item) { return item.id.value == id; });
}

DropReason read_bodies(const wire::ServerUpdate& in, ServerUpdate& out) {
  out.bodies.clear();
  if (in.bodies_size() > static_cast<int>(kMaxBodies)) return DropReason::kMalformed;
  for (const wire::CompactState& compact : in.bodies()) {
    BodyState body{BodyId{compact.id()}, {}, UserId{compact.held_by_user()}, compact.hands()};
    if (body.hands > kMaxUsers) return DropReason::kNotFinite;
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
constexpr std::size_t kMinItemBytes = 34;

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
  out.set_hands(body.hands);
}

void write_user(const OtherUserState& user, wire::CompactState& out) {
  write_compact(user.id.value, user.tool, out);
  out.set_holds_body(user.holds.value);
}

bool is_direction_or_none(const Vec3& a) {
  return a.isZero(0) || std::abs(a.norm() - 1) <= kMaxQuaternionError;
}
bool is_sendable(const CopyTarget& copy) {
  return copy.body.is_valid() && is_sendable(copy.state) && is_within(copy.p_BJ, 0.999 * kMaxPositionM) &&
         is_direction_or_none(copy.pressing_B);
}

void write_copy(const CopyTarget& copy, wire::BodyCopy& out) {
  write_compact(copy.body.value, copy.state, *out.mutable_state());
  for (const double number : copy.p_BJ) out.add_point(static_cast<float>(number));
  if (copy.pressing_B.isZero(0)) return;
  for (const double number : copy.pressing_B) out.add_pressing(static_cast<float>(number));
}

DropReason read_copy(const wire::BodyCopy& in, CopyTarget& out) {
  const bool has_direction = in.pressing_size() == 3;
  if (!in.has_state() || in.point_size() != 3 || (!has_direction && !in.pressing().empty())) {
    return DropReason::kMalformed;
  }
  if (const DropReason drop = read_compact(in.state(), out.state); drop != DropReason::kNone) return drop;
  out.body = BodyId{in.state().id()};
  out.p_BJ = {in.point(0), in.point(1), in.point(2)};
  out.pressing_B = Vec3::Zero();
  if (!is_within(out.p_BJ, kMaxPositionM)) return DropReason::kNotFinite;
  if (!has_direction) return DropReason::kNone;
  out.pressing_B = {in.pressing(0), in.pressing(1), in.pressing(2)};
  if (!(std::abs(out.pressing_B.norm() - 1) <= kMaxQuaternionError)) return DropReason::kNotFinite;
  out.pressing_B.normalize();
  return DropReason::kNone;
}

DropReason read_copies(const wire::ClientUpdate& in, ClientUpdate& out) {
  out.copies.clear();
  const bool may_have = out.mode == ClientMode::kLocalModel;
  if (in.copies_size() > (may_have ? static_cast<int>(kMaxCopies) : 0)) return DropReason::kMalformed;
  for (const wire::BodyCopy& message : in.copies()) {
    CopyTarget copy;
    if (const DropReason drop = read_copy(message, copy); drop != DropReason::kNone) return drop;
    const auto is_same = [&copy](const CopyTarget& other) { return other.body == copy.body; };
    if (std::ranges::any_of(out.copies, is_same)) return DropReason::kMalformed;
    out.copies.push_back(copy);
  }
  return DropReason::kNone;
}

/// What belongs to the mode; absent in the others.
void write_mode_part(const ClientUpdate& update, wire::ClientUpdate& out) {
  out.set_mode(static_cast<std::uint32_t>(update.mode));
  out.set_round_trip_ns(nanoseconds_of_delay(update.round_trip));
  if (update.mode == ClientMode::kLocalModel) {
    write_rigid(update.tool, *out.mutable_tool());
    for (const CopyTarget& copy : update.copies) {
      if (is_sendable(copy)) write_copy(copy, *out.add_copies());
    }
  }
  if (update.mode == ClientMode::kWave) write_six(update.wave, *out.mutable_wave());
}

DropReason read_mode_part(const wire::ClientUpdate& in, ClientUpdate& out) {
  out.tool = {};
  if (in.mode() > static_cast<std::uint32_t>(ClientMode::kWave)) return DropReason::kNotFinite;
  out.mode = static_cast<ClientMode>(in.mode());
  if (!read_delay(in.round_trip_ns(), out.round_trip)) return DropReason::kNotFinite;
  if (in.has_tool() != (out.mode == ClientMode::kLocalModel)) return DropReason::kMalformed;
  if (in.wave().empty() != (out.mode != ClientMode::kWave)) return DropReason::kMalformed;
  if (in.has_tool()) {
    if (const DropReason drop = read_rigid(in.tool(), out.tool); drop != DropReason::kNone) return drop;
  }
  if (const DropReason drop = read_copies(in, out); drop != DropReason::kNone) return drop;
  return read_wave(in.wave(), out.wave);
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
  write_mode_part(update, message);
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
  if (const DropReason drop = read_rigid(in.handle(), out.handle); drop != DropReason::kNone) return drop;
  return read_mode_part(in, out);
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
    if (left < kMinItemBytes) break;
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

}  // namespace tandem::proto
