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
/// Options of a session that joins `target`. Server, room, authentication and token of an earlier session are removed.
/// In      user           name of the user; "": that of `options`
///         is_own_server  the server was started for this user, who may also reset its room
ClientOptions options_to_join(ClientOptions options, const JoinTarget& target, const std::string& user,
                              bool is_own_server);
/// Options of a later session in the same window: the files of --trace and --record are those of the session before.
ClientOptions options_of_next(ClientOptions options);
/// Adds a pointer if the device is "mouse" and a window or commands can move it.
ClientOptions with_pointer(ClientOptions options);
/// Opens a SpaceMouse for the camera if one is usable and is not the hand's device; otherwise null.
std::shared_ptr<devices::Device> cap_for_camera(const std::string& device_of_hand);
/// Checks that the screenshot can be written, so that an error is reported before the run and not at its end.
/// Fails   std::invalid_argument if the file cannot be written
void check_screenshot(const std::filesystem::path& file);
/// Stage settings as text: "stage local-model, predictor ar, passivity on".
std::string stage_line(const StageSettings& stage);
/// Lines as one line of text: "a; b; c".
std::string joined_lines(const std::vector<std::string>& lines);
/// Findings of a coupling check as text for the terminal, one per line.
std::string coupling_lines(const std::vector<haptics::StabilityFinding>& findings);

}  // namespace tandem::client
