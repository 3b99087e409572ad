// The game of the joined room as received from the server: its state, its events, and text of the events for the user.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// State and events of a game.
struct GameReport {
  wire::GameState state;
  std::vector<wire::GameEvent> events;  ///< the last kMaxGameEvents events, in order of occurrence

  /// Returns the newest event and those events before it that are of the same game step; at most kMaxEventsTogether
  /// events. The window shows these events together.
  std::span<const wire::GameEvent> last_events() const;
};
inline constexpr std::size_t kMaxEventsTogether = 4;
inline constexpr std::size_t kMaxGameEvents = 256;

/// Returns the text of an event: the text given in the scene, or one composed of the names.
/// In      event  its indices refer to levels and goals of `game`
std::string text_of(const wire::GameEvent& event, const wire::Game& game);
/// Returns the colour of an event's text: the colour given in the scene, or otherwise light grey.
Vec3 color_of(const wire::GameEvent& event, const wire::Game& game);

/// Stores the messages of a game. Messages that contradict the scene (e.g. an unknown goal) are ignored.
///
/// Thread  io
class GameBook {
 public:
  /// Discards all messages, for a new scene.
  void begin(const wire::Scene& scene);
  /// Stores a state of the game. Returns false and changes nothing if a value is out of range or does not fit the
  /// scene.
  bool receive(const wire::GameState& state);
  /// Stores an event. Returns its text for the user, or an empty text if the event does not fit the scene.
  std::string receive(const wire::GameEvent& event);

  /// Returns the state and events. Null if the scene has no game, or if no state has been received.
  const std::shared_ptr<const GameReport>& report() const { return report_; }
  /// Returns a bit mask. Bit i is set if the body with index i is currently absent from the scene.
  std::uint64_t absent_bodies() const { return absent_; }
  std::optional<Vec3> gravity_m_per_s2() const { return gravity_; }

 private:
  wire::Game game_;
  int bodies_ = 0;
  std::shared_ptr<const GameReport> report_;
  std::vector<wire::GameEvent> events_;
  std::uint64_t absent_ = 0;
  std::optional<Vec3> gravity_;
};

}  // namespace tandem::client
