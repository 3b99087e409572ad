#include <algorithm>
#include <cmath>
#include <map>

#include "server/goals/game_codec.hpp"
#include "server/session/limits.hpp"
#include "server/session/services/games.hpp"
#include "server/session/services/services.hpp"

namespace tandem::server {
namespace {

/// Key of the notification of a game's state. Couplings have lower keys, so their notifications are sent first.
constexpr std::size_t kGameNews = 100;

class Games final : public SessionService {
 public:
  using OnCall = std::function<void(const std::string& room, const std::string& reason)>;

  Games(ServiceHost& host, OnCall on_call) : host_(host), on_call_(std::move(on_call)) {}
  void on_joined(SessionUser& user, const wire::JoinRoom& granted) override;
  void on_poll() override;

 private:
  /// Newest status of a room's game. `second` and `entries` are the time of the game and the number of level entries
  /// when the users were last notified.
  struct Known {
    GameStatus status;
    std::uint64_t second = 0;
    std::uint32_t entries = 0;
  };

  static wire::ServerControl state_of(const Room& room, const GameStatus& status) {
    wire::ServerControl message;
    *message.mutable_game_state() = state_message(status, room.scene());
    return message;
  }
  void receive(RoomSeats& seats, const GameStatus& status);

  void call(const Room& room, const GameEvent& event);

  ServiceHost& host_;
  OnCall on_call_;
  std::map<const Room*, Known> rooms_;
};

void Games::on_joined(SessionUser& user, const wire::JoinRoom& /*granted*/) {
  const auto known = rooms_.find(&user.room());
  if (known != rooms_.end()) host_.send(user, state_of(user.room(), known->second.status));
}

void Games::on_poll() {
  for (const auto& seats : host_.rooms()) {
    Room& room = seats->room();
    Game* const game = room.game();
    if (game == nullptr) continue;
    GameEvent event;
    while (game->next_event(event)) {
      wire::ServerControl message;
      *message.mutable_game_event() = event_message(event);
      host_.send_to_room(room, message);
      if (event.kind == GameEvent::Kind::kCalled) call(room, event);
    }
    if (game->status_mailbox().poll()) receive(*seats, game->status_mailbox().front());
  }
}

void Games::call(const Room& room, const GameEvent& event) {
  const std::string reason = event.by_state ? "state-limit" : "time-limit";
  host_.log("call", "the game of room " + room.name() + " calls a person: " + reason +
                        (on_call_ ? "" : "; no program is run (--on-call)"));
  if (on_call_) on_call_(room.name(), reason);
}

/// Notifies the users when the state of the game changes, and of the game's time once a second.
void Games::receive(RoomSeats& seats, const GameStatus& status) {
  const Room& room = seats.room();
  Known& known = rooms_[&room];
  const std::uint64_t second = status.steps / room.scene().description.step_rate_hz();
  const bool is_news = known.second != second || !is_same_but_time(known.status, status);
  known.status = status;
  known.second = second;
  if (std::exchange(known.entries, status.entries) != status.entries && room.game()->plan().sets_coupling) {
    seats.follow_level(coupling_of_level(room.scene(), status.level), status.entries);
  }
  if (!is_news) return;
  for (SessionUser* user : host_.users_of(room)) {
    host_.announce(*user, kGameNews, [this, &room] { return state_of(room, rooms_[&room].status); });
  }
}

}  // namespace

bool is_game_parameter(const std::string& name) {
  return name == kLevelParameter || name == kGravityParameter;
}

std::optional<GameRefusal> game_parameter_problem(const SessionUser& user, const wire::SetParameter& wanted) {
  if (!user.room().scene().description.has_game()) return GameRefusal{.text = "this room has no game"};
  const wire::Game& game = user.room().scene().description.game();
  if (!has_tool(user.seat.role)) return GameRefusal{.text = "observers do not play; join as a manipulator"};
  if (!game.users_choose() && !user.is_operator()) {
    return GameRefusal{.text =
                           "only the operator of this room may set " + wanted.name() + "; join with --role operator"};
  }
  const double value = wanted.value();
  if (wanted.name() == kLevelParameter) {
    if (value >= 1 && value <= game.levels_size() && value == std::floor(value)) return std::nullopt;
    return GameRefusal{wire::ERROR_BAD_VALUE,
                       wanted.name() + " must be a whole number from 1 to " + std::to_string(game.levels_size())};
  }
  if (value == 0 || value == 1) return std::nullopt;
  return GameRefusal{wire::ERROR_BAD_VALUE, wanted.name() + " must be 0 (off) or 1 (on)"};
}

bool post_game_parameter(SessionUser& user, const wire::SetParameter& wanted) {
  RoomCommand command{.kind = RoomCommand::Kind::kSetWeight, .is_weightless = wanted.value() == 0};
  if (wanted.name() == kLevelParameter) {
    command.kind = RoomCommand::Kind::kStartLevel;
    command.level = static_cast<std::uint8_t>(wanted.value() - 1);
  }
  return user.seats->play(user.seat, command);
}

std::unique_ptr<SessionService> make_games(ServiceHost& host,
                                           std::function<void(const std::string&, const std::string&)> on_call) {
  return std::make_unique<Games>(host, std::move(on_call));
}

}  // namespace tandem::server
