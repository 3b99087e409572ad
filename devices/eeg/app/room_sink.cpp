#include "devices/eeg/app/room_sink.hpp"

#include <algorithm>
#include <stdexcept>

namespace tandem::eeg {
namespace {

constexpr const char* kSignalName = "valence";

}  // namespace

RoomSink::RoomSink(SignalSink& next, client::SignalConnectionSettings settings)
    : next_(next), connection_(std::move(settings)) {
  try {
    connection_.wait_until_joined();
  } catch (const std::runtime_error& refused) {
    throw std::invalid_argument(refused.what());
  }
  const std::vector<std::string> names = connection_.status().names;
  if (std::ranges::find(names, kSignalName) == names.end()) {
    throw std::invalid_argument(std::string("the game of the room has no signal '") + kSignalName +
                                "'; add it to game.signals of its scene");
  }
}

void RoomSink::require_session() const {
  const client::SessionStatus session = connection_.status().session;
  if (session.state == client::SessionState::kEnded) {
    throw std::runtime_error("the room was lost: " + session.why);
  }
}

void RoomSink::send(const SignalReport& report) {
  require_session();
  if (report.value) connection_.send({report.name, *report.value, report.confidence}, report.age);
  next_.send(report);
}

void RoomSink::finish() {
  const bool is_confirmed = connection_.flush(std::chrono::seconds(1));
  require_session();
  connection_.stop();
  if (!is_confirmed) {
    throw std::runtime_error("the room has not confirmed the last value within 1 s; check the connection");
  }
}

}  // namespace tandem::eeg
