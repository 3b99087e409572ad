#include <algorithm>
#include <cmath>
#include <map>

#include "common/net/token_bucket.hpp"
#include "proto/signals.hpp"
#include "server/goals/game_plan.hpp"
#include "server/session/limits.hpp"
#include "server/session/services/services.hpp"

namespace tandem::server {
namespace {

class Signals final : public SessionService {
 public:
  explicit Signals(ServiceHost& host) : host_(host) {}
  std::vector<Case> cases() const override { return {Case::kSignal}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override;
  void on_left(SessionUser& user) override { of_sources_.erase(&user); }

 private:
  ServiceHost& host_;
  std::map<const SessionUser*, net::TokenBucket> of_sources_;
  std::map<const Room*, net::TokenBucket> of_rooms_;
};

bool is_in_range(const wire::Signal& signal) {
  return proto::is_signal_value(signal.value()) && proto::is_confidence(signal.confidence()) &&
         proto::is_signal_age(signal.age_s());
}

std::string names_of(const wire::Game& game) {
  std::string names;
  for (const wire::GameSignal& signal : game.signals()) names += (names.empty() ? "" : ", ") + signal.name();
  return names;
}

/// Passes a value to the room, which applies it in its next step. A valid value is not answered.
void Signals::handle(SessionUser& user, const wire::ClientControl& message) {
  const wire::Signal& signal = message.signal();
  const auto refuse = [&](wire::ErrorCode code, const std::string& text) {
    host_.refuse_request(user, message.request(), code, text);
  };
  if (!user.is_source()) {
    return refuse(wire::ERROR_NOT_ALLOWED, "only sources of signals send them; join with the role signal");
  }
  const wire::Game& game = user.room().scene().description.game();
  const std::size_t index = signal_index(game, signal.name());
  if (index == static_cast<std::size_t>(game.signals_size())) {
    refuse(wire::ERROR_UNKNOWN_PARAMETER, "the game has no signal of that name; it has " + names_of(game));
  } else if (!is_in_range(signal)) {
    refuse(wire::ERROR_BAD_VALUE,
           "signal " + signal.name() + ": value must be -1e6 to 1e6, confidence 0 to 1, age 0 to 600 s");
  } else if (!of_sources_.try_emplace(&user, kSourceSignalRate).first->second.try_consume(1, host_.now())) {
    refuse(wire::ERROR_NOT_ALLOWED, "too many signals: at most 50 a second, and 100 at once; send fewer");
  } else if (!of_rooms_.try_emplace(&user.room(), kSignalRate).first->second.try_consume(1, host_.now())) {
    refuse(wire::ERROR_NOT_ALLOWED, kRoomBusy);
  } else {
    const double steps = std::round(signal.age_s() * user.room().scene().description.step_rate_hz());
    const SignalValue value{signal.value(), signal.confidence(), static_cast<std::uint32_t>(steps)};
    if (!user.seats->set_signal(user.seat, static_cast<std::uint8_t>(index), value)) {
      refuse(wire::ERROR_NOT_ALLOWED, kRoomBusy);
    }
  }
}

}  // namespace

std::unique_ptr<SessionService> make_signals(ServiceHost& host) {
  return std::make_unique<Signals>(host);
}

}  // namespace tandem::server
