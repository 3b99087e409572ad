// The server update, both ways.
#include <google/protobuf/io/coded_stream.h>

#include <Eigen/Eigenvalues>
#include <tuple>

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
void write_bridge_part(const ServerUpdate& update, wire::ServerUpdate& out) {
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
}

void write_user(const OtherUserState& user, wire::CompactState& out) {
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

/// One body or user that could go into the message.
struct Candidate {
  bool is_user = false;
  std::size_t index = 0;  ///< in update.bodies or update.users, and in the turns
  int rank = 0;           ///< lower goes first
  std::uint64_t sent = 0;
  std::size_t place = 0;

  auto turn() const { return std::tuple(sent, place, is_user, index); }
};
using Candidates = boost::container::static_vector<Candidate, kMaxBodies + kMaxUsers>;

void promote_overdue(Candidates& candidates, std::uint64_t message) {
  for (std::size_t promoted = 0; promoted < ServerUpdateEncoder::kOverduePerMessage; ++promoted) {
    Candidate* longest_waiting = nullptr;
    for (Candidate& candidate : candidates) {
      const bool is_overdue =
          candidate.rank > kRankOverdue && message - candidate.sent >= ServerUpdateEncoder::kOverdueMessages;
      if (!is_overdue) continue;
      if (longest_waiting == nullptr || candidate.turn() < longest_waiting->turn()) longest_waiting = &candidate;
    }
    if (longest_waiting == nullptr) return;
    longest_waiting->rank = kRankOverdue;
  }
}

/// In      body_turns, user_turns  in the order of the update's bodies and users
Candidates candidates_in_order(const ServerUpdate& update, std::uint64_t message, const auto& body_turns,
                               const auto& user_turns) {
  Candidates candidates;
  for (std::size_t i = 0; i < update.bodies.size(); ++i) {
    const BodyState& body = update.bodies[i];
    if (!is_sendable(body.state)) continue;
    const auto& turn = body_turns[i];
    const int rank = rank_of(body, turn.was_moving, update.held_body);
    candidates.push_back({.is_user = false, .index = i, .rank = rank, .sent = turn.sent, .place = turn.place});
  }
  for (std::size_t i = 0; i < update.users.size(); ++i) {
    if (!is_sendable(update.users[i].tool)) continue;
    const auto& turn = user_turns[i];
    candidates.push_back({.is_user = true, .index = i, .rank = kRankUser, .sent = turn.sent, .place = turn.place});
  }
  promote_overdue(candidates, message);
  std::ranges::sort(candidates, {}, [](const Candidate& c) { return std::tuple(c.rank, c.turn()); });
  return candidates;
}

}  // namespace

void ServerUpdateEncoder::append(const ServerUpdate& update, Bytes& out) {
  ++message_;
  body_turns_ = turns_following(update.bodies, body_turns_);
  user_turns_ = turns_following(update.users, user_turns_);
  auto& message = fresh_message<wire::ServerUpdate>();
  write_own_part(update, message);
  std::size_t left = kMaxPayloadBytes - message.ByteSizeLong();
  std::size_t sent = 0;
  for (const Candidate& candidate : candidates_in_order(update, message_, body_turns_, user_turns_)) {
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
  auto& in = fresh_message<wire::ServerUpdate>();
  if (!parse_payload(payload, in)) return DropReason::kMalformed;
  if (const DropReason drop = read_own_part(in, out); drop != DropReason::kNone) return drop;
  if (const DropReason drop = read_bodies(in, out); drop != DropReason::kNone) return drop;
  return read_users(in, out);
}

}  // namespace tandem::proto
