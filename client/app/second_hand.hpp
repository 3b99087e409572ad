// The other hand of a person with two devices: a second user of the room, in the same program. It joins after the first,
// and so has the next tool; left and right, or receptor and ligand.
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
  /// What the first hand's options make of the second's: its device, " 2" after the user's name, no window, no trace.
  static ClientOptions options_of(const ClientOptions& first);

  /// Opens the device.
  /// In      options  options_of(); io  made of them; say  one line for people
  /// Fails   as devices::open_device() and ClientIo
  SecondHand(ClientOptions options, ClientIoSettings io, std::function<void(const std::string&)> say);

  /// Begins to join beside the first, which has joined; poll() goes on.
  void start(const ClientIoSnapshot& first);
  /// Takes what its loop recorded; starts the loop once it has joined; goes to the room that the first has gone to.
  /// Fails   std::runtime_error: it cannot join
  void poll(const ClientIoSnapshot& first);
  /// Lets the hand go, now or in the end.
  /// Thread  any
  void request_stop() noexcept;
  void stop();
  /// As of a run (summary.hpp); after stop().
  boost::json::object summary() const;
  /// problem_at_end() of its session; after stop().
  std::string problem() const;

 private:
  void follow(const std::string& room);
  void start_loop();
  void take_news();

  ClientOptions options_;
  std::function<void(const std::string&)> say_;
  std::unique_ptr<devices::Device> device_;
  ClientIo io_;
  RunReport report_;
  ClientIoSnapshot last_;
  std::string last_why_;
  std::string followed_to_;
  std::vector<std::string> realtime_not_granted_;
  HapticLoop loop_;  ///< gone before what it uses
  bool has_started_ = false;
};

}  // namespace tandem::client
