// A room's recording, played back: the same steps with the same inputs in a new room. The same build on the same machine
// must come to the same state after each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/room/room.hpp"
#include "tandem/recording.pb.h"

namespace tandem::lab {

struct ReplayResult {
  std::uint64_t steps = 0, commands = 0, inputs = 0;
  std::optional<std::uint64_t> differs_at_step;  ///< the first after which the two rooms are not the same
  std::string differing_thing;                   ///< of the scene: the first that differs then
  std::optional<std::uint64_t> missing_step;     ///< played to there: this one is not in the recording
  bool is_whole = true;                          ///< of the recording's files: each had its end
  std::string program;                           ///< that recorded
  std::string note;                              ///< why the states may differ, as far as that is known
};

/// The scene that a room's recording names.
/// In      instead  of the file that it names; empty: that
/// Fails   std::invalid_argument: none is named, or it is another than then; SceneError
std::shared_ptr<const server::LoadedScene> recorded_scene(const wire::RecordedRoom& recorded,
                                                          const std::filesystem::path& instead);

/// In      scene  instead of the file that the recording names; empty: that
///         on_step  called after each step
/// Fails   std::invalid_argument: no recording of a room, one that does not begin at its start, or another scene than it names
ReplayResult replay_session(const std::filesystem::path& recording, const std::filesystem::path& scene = {},
                            const std::function<void(const server::Room&)>& on_step = {});

}  // namespace tandem::lab
