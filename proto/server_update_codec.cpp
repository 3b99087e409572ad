// The server update, both ways.
#include <google/protobuf/io/coded_stream.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <bit>
#include <functional>

#include "proto/state_fields.hpp"

namespace tandem::proto {
namespace {

/// A stiffness that is negative in some direction would give a tool energy out of nothing.
bool is_never_negative(const decltype(SoftContact::stiffness)& stiffness) {
  const Eigen::SelfAdjointEigenSolver<decltype(SoftContact::stiffness)> solver(stiffness, Eigen::EigenvaluesOnly);
  const auto& values = solver.eigenvalues();  // in rising order
  return values(0) >= -kMaxNegativeStiffness * std::max(values(5), 0.0);
}

bool is_in_range(const SoftContact& contact) {
  const bool has_lengths = contact.trust_radius_m > 0 && contact.trust_radius_m <= kMaxPositionM &&
                           contact.lever_m >= 0 && contact.lever_m <= kMaxPositionM;
  const bool has_pose = is_within(contact.X_WT0.p, kMaxPositionM) && is_unit(contact.X_WT0.q);
  return has_lengths && is_wrench(contact.wrench_W) && has_pose && contact.stiffness.allFinite() &&
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

/// What a client with a local model, or with wave variables, needs besides.
void write_bridge_part(const OwnUpdate& update, wire::ServerUpdate& out) {
  if (update.held_body.is_valid()) write_pose(update.X_BT, *out.mutable_tool_in_held_body());
  out.set_playout_ns(nanoseconds_of_delay(update.playout));
  // One that is out of range would make the whole message unreadable.
  if (is_in_range(update.soft_contact)) write_soft_contact(update.soft_contact, *out.mutable_soft_contact());
  if (!is_zero(update.wave)) write_six(update.wave, *out.mutable_wave());
}

DropReason read_bridge_part(const wire::ServerUpdate& in, ServerUpdate& out) {
  if (!read_delay(in.playout_ns(), out.playout)) return DropReason::kNotFinite;
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

/// Everything but bodies and users is always sent: this before them, write_bridge_part() after.
void write_own_part(const OwnUpdate& update, wire::ServerUpdate& out) {
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
    BodyState body{BodyId{compact.id()}, {}, UserId{compact.held_by_user()}};
    if (const DropReason drop = read_compact(compact, body.state); drop != DropReason::kNone) return drop;
    if (has_id(out.bodies, compact.id())) return DropReason::kMalformed;
    out.bodies.push_back(body);
  }
  return DropReason::kNone;
}

DropReason read_user(const wire::CompactState& in, OtherUserState& out) {
  out.id = UserId{in.id()};
  out.holds = BodyId{in.holds_body()};
  out.tool_index = in.tool();
  if (const DropReason drop = read_compact(in, out.tool); drop != DropReason::kNone) return drop;
  out.has_handle = in.has_handle();
  if (!out.has_handle) return DropReason::kNone;
  const wire::PartnerHandle& handle = in.handle();
  if (handle.pose_size() != 7 || handle.twist_size() != kTwistNumbers || handle.on_hand_size() != kWrenchNumbers) {
    return DropReason::kMalformed;
  }
  if (const DropReason drop = read_pose(handle.pose(), out.handle.X); drop != DropReason::kNone) return drop;
  const Wrench numbers = six_of(handle.twist());
  out.handle.V = {numbers.f, numbers.t};
  out.on_hand_W = six_of(handle.on_hand());
  if (!is_wrench(out.on_hand_W) || !read_delay(handle.age_ns(), out.handle_age)) return DropReason::kNotFinite;
  return accept_rigid(out.handle);
}

DropReason read_users(const wire::ServerUpdate& in, ServerUpdate& out) {
  out.users.clear();
  if (in.users_size() > static_cast<int>(kMaxUsers)) return DropReason::kMalformed;
  for (const wire::CompactState& compact : in.users()) {
    OtherUserState user;
    if (const DropReason drop = read_user(compact, user); drop != DropReason::kNone) return drop;
    if (has_id(out.users, compact.id())) return DropReason::kMalformed;
    out.users.push_back(user);
  }
  return DropReason::kNone;
}

/// Then `turns` has the same items as `items`, in their order, each with what it knew of it.
template <class Items, class Turns>
void follow(const Items& items, Turns& turns) {
  using Turn = typename Turns::value_type;
  const auto has_id_of = [](const Turn& turn, const auto& item) { return turn.id == item.id.value; };
  // Nearly always nobody came or went, and everything is where it was.
  if (std::ranges::equal(turns, items, has_id_of)) return;
  Turns followed;
  for (const auto& item : items) {
    const std::uint32_t id = item.id.value;
    const auto known = std::ranges::find(turns, id, [](const Turn& turn) { return turn.id; });
    followed.push_back(known != turns.end() ? *known : Turn{.id = id, .sent = 0, .place = 0, .was_moving = false});
  }
  turns = followed;
}

/// The written priority after the own part; lower goes first.
enum Rank : std::uint8_t { kRankHeld, kRankOverdue, kRankUser, kRankHeldByOther, kRankMoving, kRankResting };

Rank rank_of(const BodyState& body, bool was_moving, BodyId held_body) {
  if (body.id == held_body) return kRankHeld;
  if (body.held_by.is_valid()) return kRankHeldByOther;
  return was_moving || !is_at_rest(body.state.V) ? kRankMoving : kRankResting;
}

/// A resting body with a one-byte id: when less is left, nothing fits any more.
constexpr std::size_t kMinItemBytes = 34;
/// A user with the largest numbers has 179.
constexpr std::size_t kMaxItemBytes = 192;

void write_item(const BodyState& body, wire::CompactState& out) {
  write_compact(body.id.value, body.state, out);
  out.set_held_by_user(body.held_by.value);
}

void write_item(const OtherUserState& user, wire::CompactState& out) {
  write_compact(user.id.value, user.tool, out);
  out.set_holds_body(user.holds.value);
  out.set_tool(user.tool_index);
  // One that is out of range would make the whole message unreadable.
  if (!user.has_handle || !is_sendable(user.handle) || !is_wrench(user.on_hand_W)) return out.clear_handle();
  wire::PartnerHandle& handle = *out.mutable_handle();
  write_pose(user.handle.X, *handle.mutable_pose());
  write_six({user.handle.V.v, user.handle.V.w}, *handle.mutable_twist());
  write_six(user.on_hand_W, *handle.mutable_on_hand());
  handle.set_age_ns(nanoseconds_of_delay(user.handle_age));
}

bool is_same(const BodyState& a, const BodyState& b) {
  return a.id == b.id && a.held_by == b.held_by && is_same(a.state, b.state);
}
bool is_same(const OtherUserState& a, const OtherUserState& b) {
  return a.id == b.id && a.holds == b.holds && a.tool_index == b.tool_index && a.has_handle == b.has_handle &&
         a.handle_age == b.handle_age && is_same(a.tool, b.tool) && is_same(a.handle, b.handle) &&
         a.on_hand_W.f == b.on_hand_W.f && a.on_hand_W.t == b.on_hand_W.t;
}

std::uint8_t tag_of(const BodyState&) {
  return wire::ServerUpdate::kBodiesFieldNumber << 3U | 2U;
}
std::uint8_t tag_of(const OtherUserState&) {
  return wire::ServerUpdate::kUsersFieldNumber << 3U | 2U;
}
static_assert(wire::ServerUpdate::kBodiesFieldNumber < 16 && wire::ServerUpdate::kUsersFieldNumber < 16);

/// Any, but the same for the same state.
std::size_t hash_of(std::uint32_t id, const RigidState& state) {
  std::uint64_t hash = id;
  for (const double number : state.X.p) hash = std::rotl(hash, 21) ^ std::bit_cast<std::uint64_t>(number);
  return hash * 0x9e3779b97f4a7c15U >> 32U;
}

/// A body or user as a field of wire::ServerUpdate, tag and length in front; good until the next call. All users of a room
/// are told of the same things: what this thread has encoded lately, and has not changed, it does not encode again.
template <class Item>
std::span<const std::byte> encoded(const Item& item, const RigidState& state) {
  struct Encoded {
    Encoded() { bytes.reserve(kMaxItemBytes); }
    Item item;
    Bytes bytes;
  };
  constexpr std::size_t kKept = 256;
  thread_local std::vector<Encoded> kept(kKept);
  Encoded& known = kept[hash_of(item.id.value, state) % kKept];
  if (!known.bytes.empty() && is_same(known.item, item)) return known.bytes;
  auto& message = *google::protobuf::Arena::CreateMessage<wire::CompactState>(&fresh_arena());
  write_item(item, message);
  const std::size_t size = message.ByteSizeLong();
  std::array<std::uint8_t, 1 + 5> front{tag_of(item)};
  const std::uint8_t* const end =
      google::protobuf::io::CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(size), front.data() + 1);
  const auto bytes = std::as_bytes(std::span<const std::uint8_t>(front.data(), end));
  known.item = item;
  known.bytes.assign(bytes.begin(), bytes.end());
  append_bytes(message, size, known.bytes);
  return known.bytes;
}

/// One body or user that could go into the message, as a number: lower goes first. From the high bits down its rank; the
/// message in which it was last sent, and its place there; whether it is a user; its index.
class Candidate {
 public:
  Candidate(Rank rank, std::uint64_t sent, std::size_t place, bool is_user, std::size_t index)
      : order_(std::uint64_t{rank} << kRankBit | sent << kSentBit | place << kPlaceBit |
               std::uint64_t{is_user} << kUserBit | index) {}

  Rank rank() const { return static_cast<Rank>(order_ >> kRankBit); }
  std::uint64_t sent() const { return turn() >> kSentBit; }
  /// Lower has waited longer.
  std::uint64_t turn() const { return order_ & ((std::uint64_t{1} << kRankBit) - 1); }
  bool is_user() const { return (order_ >> kUserBit & 1U) != 0; }
  std::size_t index() const { return order_ & ((std::uint64_t{1} << kUserBit) - 1); }
  void promote() { order_ = std::uint64_t{kRankOverdue} << kRankBit | turn(); }
  bool operator<(const Candidate& other) const { return order_ < other.order_; }

 private:
  static constexpr unsigned kUserBit = 6, kPlaceBit = 7, kSentBit = 14, kRankBit = 61;
  static_assert(kMaxBodies <= 1U << kUserBit && kMaxBodies + kMaxUsers <= 1U << (kSentBit - kPlaceBit));

  std::uint64_t order_;
};
using Candidates = boost::container::static_vector<Candidate, kMaxBodies + kMaxUsers>;

void promote_overdue(Candidates& candidates, std::uint64_t message) {
  for (std::size_t promoted = 0; promoted < ServerUpdateEncoder::kOverduePerMessage; ++promoted) {
    Candidate* longest_waiting = nullptr;
    for (Candidate& candidate : candidates) {
      const bool is_overdue =
          candidate.rank() > kRankOverdue && message - candidate.sent() >= ServerUpdateEncoder::kOverdueMessages;
      if (!is_overdue) continue;
      if (longest_waiting == nullptr || candidate.turn() < longest_waiting->turn()) longest_waiting = &candidate;
    }
    if (longest_waiting == nullptr) return;
    longest_waiting->promote();
  }
}

void append_part(void (*write)(const OwnUpdate&, wire::ServerUpdate&), const OwnUpdate& update, Bytes& out) {
  auto& message = fresh_message<wire::ServerUpdate>();
  write(update, message);
  append_bytes(message, message.ByteSizeLong(), out);
}

}  // namespace

void ServerUpdateEncoder::append(const OwnUpdate& own, std::span<const BodyState> bodies,
                                 std::span<const OtherUserState> users, UserId but, Bytes& out) {
  ++message_;
  follow(bodies, body_turns_);
  follow(users, user_turns_);
  // In the order of the fields: own part, bodies, users, bridge part.
  thread_local Bytes users_part, bridge;
  users_part.clear();
  bridge.clear();
  append_part(write_bridge_part, own, bridge);
  const std::size_t start = out.size();
  append_part(write_own_part, own, out);
  std::size_t left = kMaxPayloadBytes - (out.size() - start) - bridge.size();
  Candidates candidates;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!is_sendable(bodies[i].state)) continue;
    const Turn& turn = body_turns_[i];
    candidates.emplace_back(rank_of(bodies[i], turn.was_moving, own.held_body), turn.sent, turn.place, false, i);
  }
  for (std::size_t i = 0; i < users.size(); ++i) {
    if (users[i].id == but || !is_sendable(users[i].tool)) continue;
    candidates.emplace_back(kRankUser, user_turns_[i].sent, user_turns_[i].place, true, i);
  }
  promote_overdue(candidates, message_);
  std::ranges::sort(candidates, std::less<>{});
  std::size_t sent = 0;
  for (const Candidate& candidate : candidates) {
    if (left < kMinItemBytes) break;
    const std::size_t index = candidate.index();
    const std::span<const std::byte> item =
        candidate.is_user() ? encoded(users[index], users[index].tool) : encoded(bodies[index], bodies[index].state);
    if (item.size() > left) continue;
    left -= item.size();
    Bytes& items = candidate.is_user() ? users_part : out;
    items.insert(items.end(), item.begin(), item.end());
    Turn& turn = candidate.is_user() ? user_turns_[index] : body_turns_[index];
    if (!candidate.is_user()) turn.was_moving = !is_at_rest(bodies[index].state.V);
    turn.sent = message_;
    turn.place = sent++;
  }
  const bool is_among_them = but.is_valid() && has_id(users, but.value);
  thinned_ = bodies.size() + users.size() - (is_among_them ? 1 : 0) - sent;
  out.insert(out.end(), users_part.begin(), users_part.end());
  out.insert(out.end(), bridge.begin(), bridge.end());
}

DropReason parse_server_update(std::span<const std::byte> payload, ServerUpdate& out) {
  auto& in = fresh_message<wire::ServerUpdate>();
  if (!parse_payload(payload, in)) return DropReason::kMalformed;
  if (const DropReason drop = read_own_part(in, out); drop != DropReason::kNone) return drop;
  if (const DropReason drop = read_bodies(in, out); drop != DropReason::kNone) return drop;
  return read_users(in, out);
}

}  // namespace tandem::proto
