// Settings of a run's recording, its file name, and its description for users and programs.
#pragma once

#include <boost/json.hpp>
#include <chrono>
#include <filesystem>
#include <string>

#include "client/app/options.hpp"
#include "client/net/client_io.hpp"
#include "client/recording/client_recorder.hpp"

namespace tandem::client {

ClientRecording recording_settings(const ClientOptions& options, const std::filesystem::path& file);
/// File of a recording that is started in the window: tandem-TIME.mcap, in UTC, in the folder of --record's file, or
/// else in the working folder. Absolute.
std::filesystem::path next_recording_file(const ClientOptions& options,
                                          std::chrono::system_clock::time_point since_1970);
LinkFigures link_figures(const ClientIoSnapshot& io, LocalTime now);
/// Line shown to the user about a current or finished recording: file, seconds, size, excluded data, and the reason.
std::string recording_line(const ClientRecorder& recorder, Duration length);
/// In      recorder  finished
boost::json::object recording_json(const ClientRecorder& recorder);

}  // namespace tandem::client
