// A sink that sends the signal of a model to a room.
#pragma once

#include "client/signals/signal_connection.hpp"
#include "devices/eeg/classifier/signal.hpp"

namespace tandem::eeg {

/// Sends each report that has a value to a room. Passes all reports on to a second sink.
class RoomSink final : public SignalSink {
 public:
  /// Waits until the room has admitted this source.
  /// Fails   std::invalid_argument: the room refuses the source, or its game has no signal `valence`
  RoomSink(SignalSink& next, client::SignalConnectionSettings settings);

  /// Fails   std::runtime_error: the session has ended, so that no more values can be sent
  void send(const SignalReport& report) override;
  /// Waits until the room has confirmed the last value, and leaves the room.
  /// Fails   std::runtime_error: the room has not confirmed the value within a second
  void finish();

 private:
  void require_session() const;

  SignalSink& next_;
  client::SignalConnection connection_;
};

}  // namespace tandem::eeg
