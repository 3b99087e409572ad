// Agones, which starts and ends game servers in a Kubernetes cluster, is told how this server is: by calls of the sidecar
// that it puts beside each server (its SDK's REST interface).
//
//   rooms loaded ▶ POST /ready     first user ▶ GET /gameserver, and unless it is Allocated from outside POST /allocate
//   each 2 s while healthy ▶ POST /health     left for a minute ▶ POST /ready     ended ▶ POST /shutdown
//
// Source   Agones documentation, "Client SDKs", REST (agones.dev/site/docs/guides/client-sdks/rest)
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/time.hpp"
#include "common/recording/recorder_thread.hpp"

namespace tandem::server {

/// Of the sidecar: `text`; where that is "auto", what AGONES_SDK_HTTP_PORT says, else Agones' own.
/// Fails   std::invalid_argument: it is no port
std::uint16_t agones_port(const std::string& text);

/// Which call is due: no socket, no clock.
class AgonesPlan {
 public:
  enum class Call : std::uint8_t { kNone, kReady, kHealth, kLook, kAllocate, kShutdown };
  /// How the server is.
  struct Seen {
    bool is_ready = false;
    bool is_healthy = false;
    bool has_ended = false;
    std::size_t users = 0;
  };
  /// Agones takes a server for dead that it has not heard of three times in five seconds each, unless its manifest says
  /// otherwise.
  static constexpr Duration kHealthEvery{std::chrono::seconds(2)};
  static constexpr Duration kMinAgain{std::chrono::milliseconds(500)};
  static constexpr Duration kMaxAgain{std::chrono::seconds(4)};
  /// So long nobody is there before others may have the server. Who lost his connection has come back by then, or finds
  /// the scene as at its start.
  static constexpr Duration kReturnAfter{std::chrono::minutes(1)};

  Call due(const Seen& seen, LocalTime now);
  /// In      is_allocated  by the answer to kLook
  void note_answer(Call call, bool is_good, LocalTime now, bool is_allocated = false);

 private:
  bool is_told_ready_ = false, is_told_shutdown_ = false;
  bool has_looked_ = false, is_allocated_ = false;
  LocalTime next_health_{};
  LocalTime not_before_{};
  Duration again_{0};  ///< after the next failure
  std::optional<LocalTime> left_;
};

/// Thread  one of its own, of normal priority, which waits for the sidecar; the server does not need one
class Agones {
 public:
  /// In      port  of the sidecar, on this machine
  ///         look  called on the thread
  ///         on_news  for people: whether a sidecar answers, when that changes; likewise
  Agones(std::uint16_t port, std::function<AgonesPlan::Seen()> look, std::function<void(const std::string&)> on_news);
  ~Agones();
  /// Makes what `look` says last known, within about a second. Idempotent.
  void finish();

 private:
  struct Reply;
  void work();
  Reply call(const std::string& path, bool is_post) const;
  void tell(const Reply& reply);

  std::uint16_t port_;
  std::function<AgonesPlan::Seen()> look_;
  std::function<void(const std::string&)> on_news_;
  AgonesPlan plan_;
  std::optional<bool> is_there_;
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
