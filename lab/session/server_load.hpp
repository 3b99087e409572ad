// Generates load for a server on the same machine: many lightweight users over real sockets.
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

/// Returns a scene for `users` hands. Below each tool is a cube, on which the hand presses. If a user has more bodies,
/// these are further cubes around the first one.
/// In      users            1..16
///         bodies_per_user  1..4, and at most 63 bodies in total
///         rate_hz          step rate of the room
std::string crowded_scene(const std::string& name, std::size_t users, std::size_t bodies_per_user, double rate_hz);

/// Authentication of the server (`trust`) and of the users (`token`).
struct LoadSecurity {
  secure::Trust trust;
  std::function<secure::Bytes()> token;
};

/// Measurements that the users of one server made.
struct LoadResult {
  std::uint64_t inputs_sent = 0;
  std::uint64_t states_received = 0;
  Histogram added_latency;    ///< time from the deadline of a step until its state is sent, by the server's clock
  Histogram input_age;        ///< time from sending an input to the deadline of the step that used it
  Histogram answer;           ///< time from sending an input to receiving the first state that used it
  Histogram longest_silence;  ///< longest time without a state; one entry for each user
};

/// Simulates many users on the calling thread. The constructor joins all of them. In each tick, every user sends an
/// input and reads the received states. The hand of a user presses on the cube below the user's tool.
class ServerLoad {
 public:
  /// Connects and joins all users.
  /// In      security  authentication; none: no TLS
  ///         deadline  returns the deadline of a step (0, 1, …) of a room. It is called when the state of this step is
  ///         received, so the deadline must be known before
  /// Fails   std::runtime_error: a user could not connect or join
  ServerLoad(std::uint16_t port, std::size_t users, std::size_t rooms, const std::optional<LoadSecurity>& security,
             const std::function<LocalTime(std::size_t room, Step step)>& deadline);
  ~ServerLoad();
  /// Runs at `rate_hz` for `duration`. May be called several times.
  LoadResult run(Duration duration, double rate_hz);
  /// Returns the time to seal or open one datagram of usual size on this machine: the minimum of several measurements.
  static Duration seal_cost();

 private:
  struct User;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
