// What a run of the client is set up with, from its options.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/haptics/coupling_check.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device.hpp"

namespace tandem::client {

ClientIoSettings io_settings(const ClientOptions& options, const haptics::SafetySettings& safety);
/// The device "mouse" needs a pointer: of a window, or of commands.
ClientOptions with_pointer(ClientOptions options);
/// Where one is plugged in and is not the hand's device; null: none.
std::shared_ptr<devices::Device> cap_for_camera(const std::string& device_of_hand);
/// So that nobody waits in vain.
/// Fails   std::invalid_argument: it cannot be written
void check_screenshot(const std::filesystem::path& file);
/// "stage local-model, predictor ar, passivity on".
std::string stage_line(const StageSettings& stage);
/// "a; b; c".
std::string joined_lines(const std::vector<std::string>& lines);
/// What a check of the coupling found, for the terminal: a line each.
std::string coupling_lines(const std::vector<haptics::StabilityFinding>& findings);

}  // namespace tandem::client
