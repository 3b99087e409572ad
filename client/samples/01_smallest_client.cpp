// The smallest client: a simulated hand joins the room of a server on this machine and touches its scene for two
// seconds. To use the client in another program, start from this sample. The program tandem-client is the same client
// with options and reports.
//   tandem-server --insecure --scene peg_in_hole     in one terminal; prints a line when it listens
//   01_smallest_client [PORT]                        in another
//
// --insecure means no encryption, and is permitted only on one machine. For a server with TLS, set
// ClientIoSettings::trust.
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "client/app/stop_signals.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "devices/sim/sim_device.hpp"

namespace {

using namespace std::chrono_literals;
namespace client = tandem::client;
namespace devices = tandem::devices;

std::uint16_t port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error == std::errc() && next == text.data() + text.size() && port != 0) return port;
  throw std::invalid_argument("port '" + std::string(text) + "' must be a whole number from 1 to 65535");
}

bool run(std::uint16_t port) {
  // Any implementation of devices/device.hpp may be used. SimDevice includes a simulated hand that follows a path. A
  // real device must be opened here as well: opening may block, so it must precede the start of real-time threads.
  devices::SimDevice device(devices::SimDevice::default_spec(), devices::HandParameters{},
                            devices::named_hand_path("peg-left"), /*seed=*/1);

  // ClientIo is the client (client/client.hpp) with its sockets and io thread. It joins the server's only room as a
  // manipulator, and rejoins automatically after a lost connection. Other programs may set session.room and
  // session.role. This sample uses the stage "late-pose", because it needs no assets. Force limits come from the
  // device's spec, and a server cannot raise them.
  client::ClientIoSettings settings;
  settings.port = port;
  settings.client.session.user_name = "smallest";
  settings.client.haptics.stage.name = "late-pose";
  client::ClientIo io(settings, device);
  io.start();

  // Joining takes one or two round trips. The sample waits for it, so that the hand's path begins with the session. A
  // program with a window would display the status instead of blocking.
  while (io.snapshot().status.state != client::SessionState::kActive) {
    const client::SessionStatus status = io.snapshot().status;
    if (status.state == client::SessionState::kEnded) throw std::runtime_error(status.why);
    std::this_thread::sleep_for(10ms);
  }

  // HapticLoop runs the haptic thread at 1 kHz. Priority 70 is above that of the io thread and below that of kernel
  // threads. If the machine refuses real-time rights, start() returns the names of the refused rights, and the ticks of
  // the loop may be late.
  client::HapticLoop loop({.realtime_priority = 70}, io.haptics(), [&io] { io.notify(); });
  for (const std::string& missing : loop.start()) std::fprintf(stderr, "%s\n", missing.c_str());

  // Ctrl-C ends the loop, which ramps the force down. A separate thread handles the signal, because this thread may
  // block while it writes to the terminal.
  client::StopSignals signals;
  signals.when_requested([&loop] { loop.request_stop(); });

  // From here on, the device displays the force of the scene. This thread may draw, write a log or wait for user input.
  // A ring stores the tick records of four seconds. Records that are not read in time are lost and counted.
  client::TickRecord newest;
  for (int second = 1; second <= 2 && !loop.is_over(); ++second) {
    std::this_thread::sleep_for(1s);
    while (loop.pop(newest)) continue;
    std::printf("after %d s: force %.2f N, state %.1f ms old\n", second, newest.displayed_on_hand_D.f.norm(),
                tandem::to_seconds(newest.state_age) * 1e3);
  }

  // The order matters: the loop must ramp the force to zero before the session leaves the room.
  loop.stop();
  const bool has_state = io.snapshot().has_state;
  io.stop();
  std::printf("latest tick %.3f ms late\n", tandem::to_seconds(loop.report().lateness.max()) * 1e3);
  if (!has_state) std::fprintf(stderr, "01_smallest_client: the server sent no state; is UDP blocked?\n");
  return has_state;
}

}  // namespace

int main(int argc, char** argv) {
  // Must be called before any thread starts, so that no signal ends the program while a force is displayed.
  client::block_stop_signals();
  try {  // set-up errors (no server, wrong version, full room) are exceptions; their messages name the remedy
    return run(argc > 1 ? port_of(argv[1]) : 47800) ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "01_smallest_client: %s\n", error.what());
    return 2;
  }
}
