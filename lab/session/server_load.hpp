// Lightweight users over real sockets, to load a server that is measured on the same machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/histogram.hpp"
#include "common/base/ids.hpp"
#include "common/base/time.hpp"
#include "common/secure/tls.hpp"

namespace tandem::lab {

/// A scene for `users` hands: each tool is above its own cube, with more cubes around it.
/// In      users            1..16
///         bodies_per_user  1..4, and at most 63 in all
///         rate_hz          of the room's steps
std::string crowded_scene(const std::string& name, std::size_t users, std::size_t bodies_per_user, double rate_hz);

/// Authentication of the server and of the users.
struct LoadSecurity {
  secure::Trust trust;
  std::function<secure::Bytes()> token;
};

/// Measurements by the users of one server.
struct LoadResult {
  std::uint64_t inputs_sent = 0;
  std::uint64_t states_received = 0;
  Histogram added_latency;    ///< from the deadline of a step to the sending of its state, by the server's clock
  Histogram input_age;        ///< from the sending of an input to the deadline of the step that used it
  Histogram answer;           ///< from the sending of an input to the arrival of the first state that used it
  Histogram longest_silence;  ///< one entry per user
};

/// Joins all users, and then once a tick sends each user's input and reads the received states, all on the calling
/// thread. Each hand presses on its cube.
class ServerLoad {
 public:
  /// In      security  none: no TLS
  ///         deadline  of a step of a room (0, 1, …), available as soon as its state is sent
  /// Fails   std::runtime_error: a user could not connect or join
  ServerLoad(std::uint16_t port, std::size_t users, std::size_t rooms, const std::optional<LoadSecurity>& security,
             const std::function<LocalTime(std::size_t room, Step step)>& deadline);
  ~ServerLoad();
  /// Runs at `rate_hz` for `duration`; may be called again.
  LoadResult run(Duration duration, double rate_hz);
  /// Time to seal or open one datagram of usual size on this machine: the minimum of several measurements.
  static Duration seal_cost();

 private:
  struct User;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
