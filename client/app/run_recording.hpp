// Recordings of a run: settings, file names, start and end, and their description as text and as JSON.
#pragma once

#include <boost/json.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "client/app/options.hpp"
#include "client/net/client_io.hpp"
#include "client/recording/client_recorder.hpp"

namespace tandem::client {

ClientRecording recording_settings(const ClientOptions& options, const std::filesystem::path& file);
/// Returns the absolute path of the file for a recording that is started in the window: tandem-TIME.mcap, with the time
/// in UTC. The folder is that of the --record file; without the option --record it is the working directory.
std::filesystem::path next_recording_file(const ClientOptions& options,
                                          std::chrono::system_clock::time_point since_1970);
LinkFigures link_figures(const ClientIoSnapshot& io, LocalTime now);
/// Returns a line of text for the user about a recording: file, length [s], size, number of lost messages, and the
/// recorder's last message.
std::string recording_line(const ClientRecorder& recorder, Duration length);
/// In      recorder  has finished
boost::json::object recording_json(const ClientRecorder& recorder);

/// Manages the recordings of one run. At most one recording is active at a time. With the option --record, a recording
/// starts at the beginning. The window's button starts and stops further recordings.
///
/// Thread  main
class RunRecordings {
 public:
  /// In      options  must outlive this object; its current stage is written to each recording
  ///         on_news  called with text for the user, on the recorder's thread
  RunRecordings(const ClientOptions& options, std::function<void(const std::string&)> on_news);

  /// Begins a recording.
  /// Fails   std::invalid_argument if the file cannot be created
  void begin(const std::filesystem::path& file);
  /// Ends the current recording, if any. Blocks until the file is written; no other thread is blocked.
  void end();
  /// If a recording is active, ends it. Otherwise begins a recording in the file next_recording_file(). Returns a line
  /// of text for the user.
  std::string toggle();

  bool is_recording() const { return is_recording_; }
  /// Returns the state of the newest recording as text, or the reason why it could not begin; empty without a
  /// recording.
  std::string state() const;
  void add(const TickRecord& record, int phase);
  /// Adds the state of the link, at most once a second.
  void add_link(const ClientIoSnapshot& io, LocalTime now);
  /// Returns the number of messages that are missing from the finished recordings.
  std::uint64_t lost() const { return lost_; }
  /// Adds the recordings to the summary of a run. Call it after end().
  void add_to(boost::json::object& summary) const;

 private:
  const ClientOptions& options_;
  std::function<void(const std::string&)> on_news_;
  std::unique_ptr<ClientRecorder> recorder_;  ///< recorder of the newest recording, active or finished; may be null
  bool is_recording_ = false;
  std::string problem_;  ///< reason why the newest recording could not begin; empty if it could
  LocalTime since_{};
  Duration length_{0};  ///< length of the finished recording
  LocalTime next_link_{};
  std::uint64_t lost_ = 0;
  boost::json::array earlier_;  ///< JSON of all recordings before the newest one
};

}  // namespace tandem::client
