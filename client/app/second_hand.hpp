// The other hand of a user with two devices: a second user of the room in the same program. It joins after the first
// and therefore gets the next tool: left and right, or receptor and ligand.
//
//   haptic thread of its own      io thread of its own      main thread: poll()
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

/// Thread  main
class SecondHand {
 public:
  /// Derives the options of the second hand: its device, " 2" after the user name, no window, no trace.
  static ClientOptions options_of(const ClientOptions& first);

  /// Opens the device.
  /// In      options  from options_of()
  ///         io       made from these options
  ///         log      receives a line for the user
  /// Fails   see devices::open_device() and ClientIo
  SecondHand(ClientOptions options, ClientIoSettings io, std::function<void(const std::string&)> log);

  /// Starts to join the room of `first`, which has joined; poll() continues the join.
  void start(const ClientIoSnapshot& first);
  /// Takes the loop's records, starts the loop after the join, and follows the first hand to another room.
  /// Fails   std::runtime_error: it cannot join
  void poll(const ClientIoSnapshot& first);
  /// Ramps the force down and ends the loop. Does not wait.
  /// Thread  any
  void request_stop() noexcept;
  void stop();
  /// Summary of the second hand's run (summary.hpp); after stop().
  boost::json::object summary() const;
  /// problem_at_end() of its session; after stop().
  std::string problem() const;

 private:
  void follow(const std::string& room);
  void start_loop();
  void pop_news();

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
