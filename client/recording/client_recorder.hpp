// Records the ticks and the link of one client.
//
//   main thread                   recorder thread
//   add(tick), add(link) ──ring──▶ to messages ▶ RecordingFile
//
// Records that do not fit into the ring are discarded and counted.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "client/haptics/tick_record.hpp"
#include "common/realtime/ring.hpp"
#include "common/recording/recorder_thread.hpp"
#include "common/recording/recording_file.hpp"
#include "tandem/recording.pb.h"

namespace tandem::client {

struct ClientRecording {
  std::filesystem::path file;
  std::uint64_t every = 1;        ///< interval of recorded ticks: 1 records each tick, 10 every tenth tick
  Duration unix_offset{0};        ///< time of the Unix clock minus time of this machine's monotonic clock
  wire::RecordedSession about{};  ///< description of the session; the recorder sets its fields `part` and `every`
  recording::RotationSettings rotation{};
};

/// State of the link and the session at one time.
struct LinkFigures {
  LocalTime at{};
  std::string_view state;  ///< name of the session's state; must be a string literal
  bool has_clock = false;
  Duration clock_offset{0}, round_trip{0}, minimum_round_trip{0};
  std::uint64_t sent = 0, received = 0, dropped = 0, reconnects = 0;
};

class ClientRecorder {
 public:
  /// Creates the file and starts the thread.
  /// In      on_news  called with each message for the user, on the recorder's thread
  /// Fails   std::invalid_argument: the file cannot be created
  ClientRecorder(ClientRecording settings, std::function<void(const std::string&)> on_news);
  /// Calls finish().
  ~ClientRecorder();
  ClientRecorder(const ClientRecorder&) = delete;
  ClientRecorder& operator=(const ClientRecorder&) = delete;

  /// Adds a record to the ring. If the ring is full, counts the record as lost.
  /// Thread  always the same thread, for example the main thread; neither blocks nor allocates
  void add(const TickRecord& tick, int phase) noexcept;
  void add(const LinkFigures& figures) noexcept;
  /// Writes the queued records and the end of the file. Repeated calls have no effect.
  void finish();

  /// Returns the first file of the recording.
  const std::filesystem::path& name() const { return settings_.file; }
  // Any thread may call the functions below.
  /// Returns the number of ticks and figures that are missing from the recording.
  std::uint64_t lost() const;
  std::uint64_t bytes_written() const { return file_.bytes_written(); }
  /// Returns the last message that was passed to on_news; empty if there is none.
  std::string newest_news() const;
  /// Returns the written file. Call it after finish().
  const recording::RecordingFile& file() const { return file_; }

 private:
  /// a tick with its phase, or figures of the link
  using Record = std::variant<std::pair<TickRecord, int>, LinkFigures>;

  void push(const Record& record) noexcept;
  void drain();
  void write(const Record& record);
  void report(const std::string& news);
  std::uint64_t unix_ns(LocalTime time) const;

  ClientRecording settings_;
  std::function<void(const std::string&)> on_news_;
  std::uint64_t seen_ = 0;
  realtime::Ring<Record> ring_;
  std::atomic<std::uint64_t> overflows_{0};
  // Members for the recorder thread only.
  recording::RecordingFile file_;
  Record record_;
  std::uint64_t newest_ns_ = 0, flushed_ns_ = 0;
  bool has_reported_overflow_ = false;
  mutable std::mutex news_mutex_;  ///< protects newest_news_
  std::string newest_news_;
  std::optional<recording::RecorderThread> thread_;
};

}  // namespace tandem::client
