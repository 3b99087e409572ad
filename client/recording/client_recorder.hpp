// The recording of one client.
//
//   main thread                   recorder thread
//   add(tick), add(link) ──ring──▶ to messages ▶ RecordingFile
//
// What does not find place in the ring is left out, and counted.
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
  std::uint64_t every = 1;        ///< n-th tick
  Duration unix_offset{0};        ///< from this machine's clock to the time since 1970
  wire::RecordedSession about{};  ///< `part` and `every` are filled in
  recording::RotationSettings rotation{};
};

/// The link and the session at an instant.
struct LinkFigures {
  LocalTime at{};
  std::string_view state;  ///< a literal
  bool has_clock = false;
  Duration clock_offset{0}, round_trip{0}, minimum_round_trip{0};
  std::uint64_t sent = 0, received = 0, dropped = 0, reconnects = 0;
};

class ClientRecorder {
 public:
  /// Makes the file and starts the thread.
  /// In      on_news  called on that thread: what a person should know
  /// Fails   std::invalid_argument: the file cannot be made
  ClientRecorder(ClientRecording settings, std::function<void(const std::string&)> on_news);
  /// As finish().
  ~ClientRecorder();
  ClientRecorder(const ClientRecorder&) = delete;
  ClientRecorder& operator=(const ClientRecorder&) = delete;

  /// Thread  one; neither blocks nor allocates
  void add(const TickRecord& tick, int phase) noexcept;
  void add(const LinkFigures& figures) noexcept;
  /// Writes what waits, and the end. Idempotent.
  void finish();

  /// Its first file.
  const std::filesystem::path& name() const { return settings_.file; }
  // Thread  any
  /// Ticks and figures that are not in the recording.
  std::uint64_t lost() const;
  std::uint64_t bytes_written() const { return file_.bytes_written(); }
  /// What on_news was told last; empty: nothing.
  std::string newest_news() const;
  /// After finish().
  const recording::RecordingFile& file() const { return file_; }

 private:
  using Record = std::variant<std::pair<TickRecord, int>, LinkFigures>;  ///< a tick with its phase

  void push(const Record& record) noexcept;
  void drain();
  void take(const Record& record);
  void tell(const std::string& news);
  std::uint64_t unix_ns(LocalTime time) const;

  ClientRecording settings_;
  std::function<void(const std::string&)> on_news_;
  std::uint64_t seen_ = 0;
  realtime::Ring<Record> ring_;
  std::atomic<std::uint64_t> overflows_{0};
  // The recorder's.
  recording::RecordingFile file_;
  Record record_;
  std::uint64_t newest_ns_ = 0, flushed_ns_ = 0;
  bool has_told_overflow_ = false;
  mutable std::mutex news_mutex_;  ///< of the recorder's thread and whoever shows news
  std::string newest_news_;
  std::optional<recording::RecorderThread> thread_;
};

}  // namespace tandem::client
