#include "server/room/room_seats.hpp"

#include <algorithm>

namespace tandem::server {
namespace {

/// Number of commands waiting in RoomSeats above which a room accepts no new users, so that the queue stays bounded.
constexpr std::size_t kMaxNewUsers = 4 * proto::kMaxUsers;

}  // namespace

RoomSeats::RoomSeats(Room& room)
    : room_(room), start_(room.start_settings()), coupling_(room.scene().world.coupling), of_level_(coupling_) {}

std::size_t RoomSeats::count(UserRole role) const {
  return static_cast<std::size_t>(std::count_if(seats_.begin(), seats_.end(), [role](const auto& seat) {
    return seat && has_tool(seat->role) == has_tool(role);
  }));
}

bool RoomSeats::has_operator() const {
  return std::ranges::any_of(seats_, [](const auto& seat) { return seat && seat->role == UserRole::kOperator; });
}

std::optional<std::uint8_t> RoomSeats::free_tool(std::optional<std::uint8_t> wanted) const {
  const std::size_t tools = std::min(room_.scene().world.tools.size(), proto::kMaxUsers);
  const auto is_free = [&](std::size_t tool) {
    return tool < tools && std::ranges::none_of(seats_, [tool](const auto& seat) {
             return seat && has_tool(seat->role) && seat->tool == tool;
           });
  };
  if (wanted && is_free(*wanted)) return wanted;
  for (std::size_t tool = 0; tool < tools; ++tool) {
    if (is_free(tool)) return static_cast<std::uint8_t>(tool);
  }
  return std::nullopt;
}

bool RoomSeats::has_place(UserRole role) const {
  if (role == UserRole::kSignal) return sources_ < kMaxSignalSources;
  const auto& limits = room_.scene().description.limits();
  const std::size_t limit = has_tool(role) ? limits.manipulators() : limits.observers();
  const bool has_seat = std::find(seats_.begin(), seats_.end(), std::nullopt) != seats_.end();
  return has_seat && count(role) < limit && waiting_.size() < kMaxNewUsers && (!has_tool(role) || free_tool({}));
}

std::optional<Seat> RoomSeats::allocate(UserRole role, bool leaves_gaps,
                                        const haptics::CouplingParameters& device_bounds, std::string_view user_name,
                                        std::optional<std::uint8_t> wanted_tool) {
  if (!has_place(role)) return std::nullopt;
  const auto free = std::find(seats_.begin(), seats_.end(), std::nullopt);
  Seat seat{static_cast<std::uint8_t>(free - seats_.begin()), UserId{}, role, 0, leaves_gaps};
  if (has_tool(role)) {
    seat.tool = *free_tool(wanted_tool);
    seat.coupling_bounds = haptics::coupling_bounds_in_world(device_bounds, room_.scene().workspaces[seat.tool]);
  }
  set_name(seat, user_name);
  seat.user = UserId{++last_user_};
  *free = seat;
  requested_[seat.index] = served_[seat.index] = 0;
  held_[seat.index] = BodyId{};
  if (has_tool(role)) {
    const auto holds = room_.scene().world.tools[seat.tool].holds_body;
    if (holds) held_[seat.index] = body_id_at(*holds);
  }
  post_surely({.kind = RoomCommand::Kind::kJoin, .seat = seat});
  return seat;
}

void RoomSeats::set_name(Seat& seat, std::string_view name) {
  std::ranges::copy(name.substr(0, seat.user_name.size() - 1), seat.user_name.begin());
}

std::optional<Seat> RoomSeats::add_source(std::string_view name) {
  if (sources_ >= kMaxSignalSources) return std::nullopt;
  ++sources_;
  Seat source{.user = UserId{++last_user_}, .role = UserRole::kSignal};
  set_name(source, name);
  return source;
}

bool RoomSeats::set_signal(const Seat& source, std::uint8_t signal, const SignalValue& value) {
  flush();
  return waiting_.empty() && room_.post({.kind = RoomCommand::Kind::kSetSignal,
                                         .seat = {.user = source.user, .role = UserRole::kSignal},
                                         .signal = signal,
                                         .signal_value = value});
}

void RoomSeats::leave(const Seat& seat) {
  if (seat.role == UserRole::kSignal) {
    --sources_;
    return;
  }
  const bool is_as_in_scene = coupling_.law == of_level_.law && coupling_.parameters == of_level_.parameters;
  if (seat.role == UserRole::kOperator && !is_as_in_scene) {
    coupling_ = of_level_;
    post_coupling(seat);
  }
  seats_[seat.index].reset();
  post_surely({.kind = RoomCommand::Kind::kLeave, .seat = seat});
}

void RoomSeats::set_coupling(const Seat& seat, const haptics::CouplingParameters& parameters) {
  coupling_.parameters = parameters;
  post_coupling(seat);
}

void RoomSeats::set_law(const Seat& seat, const haptics::CouplingLawInfo& law) {
  coupling_.law = law.name;
  post_coupling(seat);
}

void RoomSeats::follow_level(const physics::SceneCoupling& coupling, std::uint32_t entries) {
  std::erase_if(waiting_, [](const RoomCommand& older) { return older.kind == RoomCommand::Kind::kSetCoupling; });
  coupling_ = of_level_ = coupling;
  entries_ = entries;
}

void RoomSeats::post_coupling(const Seat& seat) {
  // Only the newest coupling matters. Older ones in waiting_ are removed, so that the queue stays short.
  std::erase_if(waiting_, [](const RoomCommand& older) { return older.kind == RoomCommand::Kind::kSetCoupling; });
  post_surely({.kind = RoomCommand::Kind::kSetCoupling,
               .seat = seat,
               .coupling = coupling_.parameters,
               .law = haptics::find_coupling_law(coupling_.law),
               .entries = entries_});
}

bool RoomSeats::reset(const Seat& seat, LocalTime now) {
  flush();
  if (!waiting_.empty() || !resets_.has_some(now)) return false;
  if (!room_.post({.kind = RoomCommand::Kind::kReset, .seat = seat})) return false;
  resets_.consume(1, now);
  return true;
}

bool RoomSeats::place(const Seat& seat, RoomCommand placing) {
  flush();
  placing.seat = seat;
  return waiting_.empty() && room_.post(placing);
}

haptics::CouplingParameters RoomSeats::coupling_in_force(const Seat& seat) const {
  if (!has_tool(seat.role)) return coupling_.parameters;
  const BodyId held = held_[seat.index];
  const auto body = held.is_valid() ? std::optional<std::size_t>(held.value - 1) : std::nullopt;
  return physics::coupling_in_force(coupling_, moved_mass(room_.scene(), seat.tool, body));
}

void RoomSeats::on_update(const Seat& seat, const RoomUpdate& update) {
  served_[seat.index] = update.requests_served[seat.index];
  held_[seat.index] = update.own[seat.index].held_body;
}

bool RoomSeats::grab(const Seat& seat, BodyId body, std::uint32_t request) {
  return post_request({.kind = RoomCommand::Kind::kGrab, .seat = seat, .body = body, .request = request});
}

bool RoomSeats::release(const Seat& seat, std::uint32_t request) {
  return post_request({.kind = RoomCommand::Kind::kRelease, .seat = seat, .request = request});
}

void RoomSeats::flush() {
  while (!waiting_.empty() && room_.post(waiting_.front())) waiting_.pop_front();
}

void RoomSeats::post_surely(const RoomCommand& command) {
  flush();
  if (!waiting_.empty() || !room_.post(command)) waiting_.push_back(command);
}

bool RoomSeats::post_request(const RoomCommand& command) {
  flush();
  if (requested_[command.seat.index] != served_[command.seat.index]) return false;
  if (!waiting_.empty() || !room_.post(command)) return false;
  ++requested_[command.seat.index];
  return true;
}

}  // namespace tandem::server
