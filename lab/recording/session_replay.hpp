// Replays a room's recording: a new room runs the same steps with the same inputs. With the same build on the same
// machine, it must reach the recorded state after each step.
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
  std::optional<std::uint64_t> differs_at_step;  ///< first step after which recorded and replayed state differ
  std::string differing_thing;  ///< name of the first body or tool of the scene whose state differs after that step
  /// first step that is missing in the recording; the replay ends before it
  std::optional<std::uint64_t> missing_step;
  bool is_whole = true;  ///< true: every file of the recording is complete, i.e. ends with an end record
  std::string program;   ///< program that wrote the recording
  std::string note;      ///< known reason why recorded and replayed states may differ; empty: none
};

/// Loads the scene that a room's recording names.
/// In      instead  scene file that replaces the recorded one; empty: the recorded one is used
/// Fails   std::invalid_argument: no scene file is named, or the scene differs from the recorded one; SceneError
std::shared_ptr<const server::LoadedScene> recorded_scene(const wire::RecordedRoom& recorded,
                                                          const std::filesystem::path& instead);

/// Replays a recording and compares the replayed states with the recorded ones.
/// In      scene    scene file that replaces the recorded one; empty: the recorded one is used
///         on_step  called after each step
/// Fails   std::invalid_argument: the file is not a recording of a room or not the first file of a recording, or the
///         scene differs from the recorded one
ReplayResult replay_session(const std::filesystem::path& recording, const std::filesystem::path& scene = {},
                            const std::function<void(const server::Room&)>& on_step = {});

}  // namespace tandem::lab
