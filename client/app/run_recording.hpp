// Recordings of a run: settings, file names, start and end, and their description for users and programs.
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
/// File of a recording that is started in the window: tandem-TIME.mcap, in UTC, in the folder of --record's file, or
/// else in the working folder. Absolute.
std::filesystem::path next_recording_file(const ClientOptions& options,
                                          std::chrono::system_clock::time_point since_1970);
LinkFigures link_figures(const ClientIoSnapshot& io, LocalTime now);
/// Line shown to the user about a current or finished recording: file, seconds, size, excluded data, and the reason.
std::string recording_line(const ClientRecorder& recorder, Duration length);
/// In      recorder  finished
boost::json::object recording_json(const ClientRecorder& recorder);

/// The recordings of one run, one after the other: by --record from the start, and by the window's button.
///
/// Thread  main
class RunRecordings {
 public:
  /// In      options  must outlive this; its present stage is noted in each recording
  ///         on_news  receives text for the user, on the recorder's thread
  RunRecordings(const ClientOptions& options, std::function<void(const std::string&)> on_news);

  /// Begins a recording.
  /// Fails   std::invalid_argument: the file cannot be created
  void begin(const std::filesystem::path& file);
  /// Ends the current recording, if any. Blocks until it is written; no other thread waits for main.
  void end();
  /// Begins a recording in the next file, or ends the current one. Returns a line for the user.
  std::string toggle();

  bool is_recording() const { return is_recording_; }
  /// State of the newest recording, or why it could not begin, as text; empty: there was none.
  std::string state() const;
  void add(const TickRecord& record, int phase);
  /// Adds the state of the link, at most once a second.
  void add_link(const ClientIoSnapshot& io, LocalTime now);
  /// Messages that are missing in the finished recordings.
  std::uint64_t lost() const { return lost_; }
  /// Adds the recordings to a run's summary; after end().
  void add_to(boost::json::object& summary) const;

 private:
  const ClientOptions& options_;
  std::function<void(const std::string&)> on_news_;
  std::unique_ptr<ClientRecorder> recorder_;  ///< newest recording, which may have ended; null: none yet
  bool is_recording_ = false;
  std::string problem_;  ///< why the last recording could not begin
  LocalTime since_{};
  Duration length_{0};  ///< of the finished recording
  LocalTime next_link_{};
  std::uint64_t lost_ = 0;
  boost::json::array earlier_;  ///< recordings before the newest
};

}  // namespace tandem::client
