#include <map>
#include <utility>

#include "proto/coupling_fields.hpp"
#include "server/session/services/games.hpp"
#include "server/session/services/services.hpp"

namespace tandem::server {
namespace {

/// Keys of notifications. Notifications are sent in ascending order of keys, so users receive the law before its
/// coefficients.
constexpr std::size_t kLawNews = 0, kCoefficientNews = 1;

wire::ServerControl law_set(std::string_view law) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name(std::string(proto::kLawParameter));
  message.mutable_parameter_set()->set_text(std::string(law));
  return message;
}

/// Message with the effective value of a coefficient for the user's tool.
wire::ServerControl coefficient_set(const proto::CouplingField& field, const SessionUser& user) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name(std::string(field.name));
  message.mutable_parameter_set()->set_value(user.seats->coupling_in_force(user.seat).*field.value);
  return message;
}

class Coupling final : public SessionService {
 public:
  explicit Coupling(ServiceHost& host) : host_(host) {}
  std::vector<Case> cases() const override { return {Case::kSetParameter}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;
  void on_joined(SessionUser& user, const wire::JoinRoom& /*granted*/) override { known_[&user] = in_force(user); }
  void on_left(SessionUser& user) override;
  /// Notifies users of their effective coefficients, which change when a tool grasps or releases a body.
  void on_update(const Room& room) override { announce_changes(room); }

 private:
  /// Effective coupling of a user at the last announce_changes(). The user has been notified of it, or the notification
  /// is queued.
  struct Known {
    std::string_view law;
    haptics::CouplingParameters coefficients;
  };

  static Known in_force(const SessionUser& user) {
    return {user.seats->coupling().law, user.seats->coupling_in_force(user.seat)};
  }
  void set_coefficient(SessionUser& setter, const wire::ClientControl& message, const proto::CouplingField& field);
  void set_law(SessionUser& setter, const wire::ClientControl& message);
  void set_game_parameter(SessionUser& user, const wire::ClientControl& message);
  void announce(SessionUser& user, const proto::CouplingField& field);
  void announce_changes(const Room& room);
  void send_changes(const Room& room);

  ServiceHost& host_;
  std::map<const SessionUser*, Known> known_;
  std::map<const Room*, net::TokenBucket> game_rates_;
};

void Coupling::handle(SessionUser& user, const wire::ClientControl& message) {
  const wire::SetParameter& wanted = message.set_parameter();
  const proto::CouplingField* const field = proto::find_coupling_field(wanted.name());
  const auto refuse = [&](wire::ErrorCode code, const std::string& text) {
    host_.refuse_request(user, message.request(), code, text);
  };
  if (is_game_parameter(wanted.name())) {
    set_game_parameter(user, message);
  } else if (!user.is_operator()) {
    refuse(wire::ERROR_NOT_ALLOWED, "only the room's operator may set parameters; join with --role operator");
  } else if (wanted.name() == proto::kLawParameter) {
    set_law(user, message);
  } else if (field == nullptr) {
    std::string names(proto::kLawParameter);
    for (const proto::CouplingField& known : proto::kCouplingFields) names += ", " + std::string(known.name);
    refuse(wire::ERROR_UNKNOWN_PARAMETER, "settable parameters: " + names);
  } else if (!field->accepts(wanted.value())) {
    refuse(wire::ERROR_BAD_VALUE,
           std::string(field->name) + " must be " + std::to_string(field->low) + " to " + std::to_string(field->high));
  } else if (physics::is_chosen_by_law(user.seats->coupling(), field->value)) {
    refuse(wire::ERROR_NOT_ALLOWED, std::string(field->name) + " follows the moved mass: the law is adaptive");
  } else {
    set_coefficient(user, message, *field);
  }
}

/// Sets a parameter of the game. The other users receive the change with the next state of the game.
void Coupling::set_game_parameter(SessionUser& user, const wire::ClientControl& message) {
  const wire::SetParameter& wanted = message.set_parameter();
  const std::optional<GameRefusal> problem = game_parameter_problem(user, wanted);
  if (problem) return host_.refuse_request(user, message.request(), problem->code, problem->text);
  const net::Rate rate = kResetRate;
  net::TokenBucket& budget = game_rates_.try_emplace(&user.room(), rate).first->second;
  if (!budget.try_consume(1, host_.now()) || !post_game_parameter(user, wanted)) {
    return host_.refuse_request(user, message.request(), wire::ERROR_NOT_ALLOWED, kRoomBusy);
  }
  wire::ServerControl answer;
  answer.set_request(message.request());
  answer.mutable_parameter_set()->set_name(wanted.name());
  answer.mutable_parameter_set()->set_value(wanted.value());
  host_.send(user, answer);
}

/// Sets a coefficient. Every other user is notified of the effective value for their tool, even if the limits of their
/// device keep that value unchanged.
void Coupling::set_coefficient(SessionUser& setter, const wire::ClientControl& message,
                               const proto::CouplingField& field) {
  haptics::CouplingParameters parameters = setter.seats->coupling().parameters;
  parameters.*(field.value) = message.set_parameter().value();
  setter.seats->set_coupling(setter.seat, parameters);
  const std::vector<SessionUser*> users = host_.users_of(setter.room());
  for (SessionUser* user : users) known_[user] = in_force(*user);
  for (SessionUser* user : users) {
    if (user == &setter) continue;
    announce(*user, field);
    host_.send_news(*user);
  }
  wire::ServerControl answer = coefficient_set(field, setter);
  answer.set_request(message.request());
  host_.send(setter, answer);
}

/// Sets the coupling law. This is safe during contact, because client and server both blend from the old law to the new
/// law (haptics::LawFade).
void Coupling::set_law(SessionUser& setter, const wire::ClientControl& message) {
  RoomSeats& seats = *setter.seats;
  const physics::SceneCoupling& of_scene = seats.room().scene().world.coupling;
  const std::string& name = message.set_parameter().text();
  const haptics::CouplingLawInfo* const law = name.empty() ? nullptr : haptics::find_coupling_law(name);
  if (law == nullptr) {
    return host_.refuse_request(
        setter, message.request(), wire::ERROR_BAD_VALUE,
        std::string(proto::kLawParameter) + " must be one of: " + haptics::listed_coupling_law_names());
  }
  const std::string problem =
      haptics::law_change_problem(*haptics::find_coupling_law(of_scene.law), *law, of_scene.fit.has_value());
  if (!problem.empty()) return host_.refuse_request(setter, message.request(), wire::ERROR_NOT_ALLOWED, problem);
  wire::ServerControl answer = law_set(law->name);
  answer.set_request(message.request());
  host_.send(setter, answer);
  if (law->name == seats.coupling().law) return;
  host_.log("law", setter.label() + " set the law " + name + " in room " + seats.room().name());
  seats.set_law(setter.seat, *law);
  if (const auto known = known_.find(&setter); known != known_.end()) known->second.law = law->name;
  send_changes(seats.room());
}

/// Notifies the other users after the operator has left, because the coupling of the scene or level is then in force
/// again.
void Coupling::on_left(SessionUser& user) {
  known_.erase(&user);
  send_changes(user.room());
}

void Coupling::announce(SessionUser& user, const proto::CouplingField& field) {
  const auto index = static_cast<std::size_t>(&field - proto::kCouplingFields.data());
  host_.announce(user, kCoefficientNews + index, [&user, &field] { return coefficient_set(field, user); });
}

/// Queues notifications for each user: of the law if it has changed, and of the effective coefficients that have
/// changed.
void Coupling::announce_changes(const Room& room) {
  for (SessionUser* user : host_.users_of(room)) {
    const auto known = known_.find(user);
    if (known == known_.end()) continue;
    const Known before = std::exchange(known->second, in_force(*user));
    if (before.law != known->second.law) {
      host_.announce(*user, kLawNews, [user] { return law_set(user->seats->coupling().law); });
    }
    for (const proto::CouplingField& field : proto::kCouplingFields) {
      if (before.coefficients.*field.value != known->second.coefficients.*field.value) announce(*user, field);
    }
  }
}

void Coupling::send_changes(const Room& room) {
  announce_changes(room);
  for (SessionUser* user : host_.users_of(room)) host_.send_news(*user);
}

}  // namespace

std::unique_ptr<SessionService> make_coupling(ServiceHost& host) {
  return std::make_unique<Coupling>(host);
}

}  // namespace tandem::server
