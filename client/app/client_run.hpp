// One headless run of tandem-client: everything that main() puts together, in the order in which it lives and dies.
//
//   main thread (this file)            haptic thread (haptic_loop.hpp)     io thread (net/client_io.hpp)
//   join, then every 10 ms:            1 kHz: read, compute, write         sockets, session, simulated links
//   take tick records ◀──── ring ───── record
//   trace, report, status line         outbox ─────────── mailbox ───────▶ send
//                                      ◀───────────────── mailboxes ────── state, scene
//                                      ◀─ request_stop() ── signal thread (stop_signals.hpp)
//
// Main may hang in a write to its terminal, so nothing that ends the force depends on it: the signal thread stops
// the haptic thread, which knows its duration and shows the hand out by itself.
//
// The haptic thread starts when the room is joined, so that the hand's path and the session share their zero, and
// stops first, so that the hand is let go while the session still stands.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/app/run_report.hpp"
#include "client/app/stop_signals.hpp"
#include "client/app/summary.hpp"
#include "client/app/trace.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::client {

/// Thread  main; block_stop_signals() must come before construction
class ClientRun {
 public:
  /// Fails   std::invalid_argument or std::system_error: bad set-up
  explicit ClientRun(const ClientOptions& options);

  /// Runs until the duration is over, a signal comes, or the session ends. Returns the exit code.
  /// Fails   std::invalid_argument or std::runtime_error: bad set-up, found before anything was displayed
  int run();

 private:
  bool join();
  void start_loop();
  void keep_going();
  void drain_records();
  void take_record(const TickRecord& record);
  void follow_device(const devices::DeviceSample& sample);
  void follow_session(const ClientIoSnapshot& io);
  void explain_coupling(const CouplingCheck& check);
  void print_status(const ClientIoSnapshot& io);
  RunSummary summary(ClientIoSnapshot io) const;
  int finish();

  ClientOptions options_;
  haptics::SafetySettings safety_;
  std::unique_ptr<devices::Device> device_;
  devices::HandPath hand_path_;  ///< names the phases of the run
  ClientMailboxes mailboxes_;
  HapticCore core_;
  ClientIo io_;
  std::optional<TraceWriter> trace_;
  RunReport report_;
  std::optional<WatchedBody> watched_;
  std::vector<std::string> realtime_not_granted_;
  std::string last_why_;
  std::uint64_t explained_check_ = 0;
  std::vector<haptics::StabilityFinding> coupling_findings_;
  std::string last_coupling_lines_;
  LocalTime next_status_{};
  std::optional<LocalTime> first_tick_;
  TickRecord newest_;
  bool is_over_ = false;
  std::optional<HapticLoop> loop_;  ///< gone before what it uses
  StopSignals stop_signals_;        ///< last: it stops the loop
};

}  // namespace tandem::client
