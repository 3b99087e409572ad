// What of a run is recorded, where, and what is said of it.
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
/// Of a recording that is begun at the window: tandem-TIME.mcap, in UTC, beside the file of --record, or else in the
/// working folder. Absolute.
std::filesystem::path next_recording_file(const ClientOptions& options,
                                          std::chrono::system_clock::time_point since_1970);
LinkFigures link_figures(const ClientIoSnapshot& io, LocalTime now);
/// For a person, of one that runs or has ended: file, seconds, size, what is left out, and why.
std::string recording_line(const ClientRecorder& recorder, Duration length);
/// In      recorder  finished
boost::json::object recording_json(const ClientRecorder& recorder);

}  // namespace tandem::client
