// Derives the settings of a client run from its options.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/haptics/coupling_check.hpp"
#include "client/start/start_choice.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device.hpp"

namespace tandem::client {

ClientIoSettings io_settings(const ClientOptions& options, const haptics::SafetySettings& safety);
/// Returns the options of a session that joins `target`. Server, room, authentication and token of an earlier session
/// are not kept.
/// In      user           name of the user; empty: the name in `options` is kept
///         is_own_server  true: the server was started for this user. The user may then reset its room
ClientOptions options_to_join(ClientOptions options, const JoinTarget& target, const std::string& user,
                              bool is_own_server);
/// Returns the options of a later session in the same window. The files of --trace and --record belong to the first
/// session and are not used again.
ClientOptions options_of_next(ClientOptions options);
/// Adds a pointer if the device is "mouse", and if a window or commands can move it.
ClientOptions with_pointer(ClientOptions options);
/// Opens a SpaceMouse with which the user moves the camera. Returns null if no SpaceMouse is usable, or if it is the
/// device of the hand.
std::shared_ptr<devices::Device> cap_for_camera(const std::string& device_of_hand);
/// Checks that the screenshot can be written, so that an error is reported before the run.
/// Fails   std::invalid_argument if the file cannot be written
void check_screenshot(const std::filesystem::path& file);
/// Returns the stage settings as text: "stage local-model, predictor ar, passivity on".
std::string stage_line(const StageSettings& stage);
/// Joins lines into one: "a; b; c".
std::string joined_lines(const std::vector<std::string>& lines);
/// Returns the findings of a coupling check as text for the terminal, one line each.
std::string coupling_lines(const std::vector<haptics::StabilityFinding>& findings);

}  // namespace tandem::client
