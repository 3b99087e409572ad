// Selects the sounds of a frame of the session: contact, grasp, release and goals. No display is needed.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <optional>

#include "client/session/game_book.hpp"
#include "client/view/sound/tones.hpp"
#include "common/base/ids.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// A sound to play, with its loudness from 0 to 1.
struct SoundCue {
  Sound sound = Sound::kContact;
  double gain = 1;
};
using SoundCues = boost::container::static_vector<SoundCue, 3>;

/// State of the session in one frame, from which the sounds are selected.
struct SoundState {
  double force_n = 0;               ///< largest displayed force since the previous frame [N]
  std::optional<bool> is_touching;  ///< whether the tool has contacts in the local model; empty: not known
  bool is_ramping = false;          ///< true: the force is being ramped up after a start or a fault
  BodyId held_body{};
  const GameReport* game = nullptr;  ///< state of the room's game; null: no game
};

/// Selects sounds. A contact has a sound if the tool begins to touch, or if the force rises suddenly.
///
/// Thread  the one that runs the window
class SoundEvents {
 public:
  /// Rise of the force above its mean that counts as sudden. The mean is a low-pass filter with the time constant
  /// kForceMean_s.
  static constexpr double kJolt_n = 0.5;
  static constexpr double kForceMean_s = 0.05;
  /// Time without a touch after which the next touch has a sound. It is needed because contacts of a sliding tool are
  /// lost and regained.
  static constexpr Duration kApart{std::chrono::milliseconds(150)};
  /// Shortest time between two sounds of contact.
  static constexpr Duration kBetweenContacts{std::chrono::milliseconds(80)};

  /// Returns the sounds since the last call.
  SoundCues follow(const SoundState& state, LocalTime now);

 private:
  bool is_new_contact(const SoundState& state, LocalTime now);
  void add_contact(const SoundState& state, LocalTime now, SoundCues& cues);
  void add_grasp(const SoundState& state, SoundCues& cues);
  void add_game(const SoundState& state, SoundCues& cues);

  bool has_state_ = false;
  LocalTime last_{};
  double mean_force_n_ = 0;
  bool is_jolted_ = false;  ///< true: a sudden rise had a sound and has not ended yet
  std::optional<LocalTime> touched_at_, heard_at_;
  BodyId held_body_;
  std::optional<std::uint64_t> game_step_;  ///< step of the last event of the game; empty: there is no game
};

}  // namespace tandem::client
