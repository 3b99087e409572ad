// Second hand of a user with two devices. The server treats it as another user of the room. It joins after the first
// hand and therefore gets the next tool of the scene, for example the right one after the left one.
//
//   separate haptic thread      separate io thread      main thread: poll()
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/app/run_report.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "common/base/json.hpp"

namespace tandem::client {

/// Runs the second hand: its device, session and haptic loop.
///
/// Thread  main
class SecondHand {
 public:
  /// Derives the options of the second hand: the second device, the user name followed by " 2", no window and no trace.
  static ClientOptions options_of(const ClientOptions& first);

  /// Opens the device.
  /// In      options  options from options_of()
  ///         io       settings derived from these options (io_settings())
  ///         log      called with a line of text for the user
  /// Fails   the exceptions of devices::open_device() and of ClientIo
  SecondHand(ClientOptions options, ClientIoSettings io, std::function<void(const std::string&)> log);

  /// Begins to join the room that `first` has joined. poll() completes the join.
  void start(const ClientIoSnapshot& first);
  /// Reads the loop's records, starts the loop after the join, and moves to another room when the first hand does.
  /// Fails   std::runtime_error if the room cannot be joined
  void poll(const ClientIoSnapshot& first);
  /// Ramps the force down and ends the loop, without waiting for its end.
  /// Thread  any
  void request_stop() noexcept;
  void stop();
  /// Returns the summary of the second hand's run (summary.hpp). Call it after stop().
  boost::json::object summary() const;
  /// Returns problem_at_end() of the second hand's session. Call it after stop().
  std::string problem() const;

 private:
  void follow(const std::string& room);
  void start_loop();
  void pop_news();
  void take_events();

  ClientOptions options_;
  std::function<void(const std::string&)> log_;
  std::unique_ptr<devices::Device> device_;
  ClientIo io_;
  RunReport report_;
  ClientIoSnapshot last_;
  std::string last_why_;
  std::string followed_to_;
  std::vector<std::string> realtime_not_granted_;
  HapticLoop loop_;  ///< destroyed before the members above, which it uses
  bool has_started_ = false;
};

}  // namespace tandem::client
