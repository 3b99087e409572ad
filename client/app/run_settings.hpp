// Derives the settings of a client run from its options.
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
