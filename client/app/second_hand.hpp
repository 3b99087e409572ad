// Second hand of a user with two devices. For the server it is another user of the room. It joins after the first hand
// and therefore gets the next tool, for example left and right, or receptor and ligand.
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
  /// Derives the options of the second hand: its own device, the user name followed by " 2", no window and no trace.
  static ClientOptions options_of(const ClientOptions& first);

  /// Opens the device.
  /// In      options  options from options_of()
  ///         io       settings derived from these options (io_settings())
  ///         log      called with a line of text for the user
  /// Fails   same cases as devices::open_device() and ClientIo
  SecondHand(ClientOptions options, ClientIoSettings io, std::function<void(const std::string&)> log);

  /// Begins to join the room that `first` has joined. poll() continues the join.
  void start(const ClientIoSnapshot& first);
  /// Reads the loop's records, starts the loop after the join, and follows the first hand to another room.
  /// Fails   std::runtime_error if the room cannot be joined
  void poll(const ClientIoSnapshot& first);
  /// Ramps the force down and ends the loop. Does not wait.
  /// Thread  any
  void request_stop() noexcept;
  void stop();
  /// Summary of the second hand's run (summary.hpp). Must be called after stop().
  boost::json::object summary() const;
  /// Result of problem_at_end() for the second hand's session. Must be called after stop().
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
  HapticLoop loop_;  ///< destroyed before the objects that it uses
  bool has_started_ = false;
};

}  // namespace tandem::client
