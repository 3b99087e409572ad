// tandem-watchdog: says zero to one device when the program that owns it is silent or gone. Started by it: see watchdog.hpp.
#include "devices/watchdog_program.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string_view>
#include <thread>

#include "common/realtime/realtime.hpp"
#include "devices/watchdog.hpp"

using namespace tandem;
using namespace tandem::devices;
using namespace tandem::devices::watchdog_program;

namespace {

constexpr int kLook_ms = 5;
// Some may be lost with what is on its way; more would be answers that nobody reads.
constexpr int kMaxZeros = 5;

ZeroCommand zero_from(std::string_view endpoint, std::string_view hex) {
  ZeroCommand zero{.descriptor = kDevice, .bytes = {}};
  if (endpoint != "-") zero.usb_endpoint = static_cast<std::uint8_t>(std::atoi(endpoint.data()));
  for (std::size_t i = 0; i + 1 < hex.size() && zero.bytes.size() < kMaxZeroBytes; i += 2)
    zero.bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  return zero;
}

/// What has become of the owner.
class Watch {
 public:
  Watch(ZeroCommand zero, WatchdogBeat& beat) : zero_(std::move(zero)), beat_(beat) {}

  void look(LocalTime now) {
    const bool is_force_on = beat_.is_force_on.load(std::memory_order_acquire);
    const LocalTime heard{Duration(beat_.at_ns.load(std::memory_order_relaxed))};
    if (now - heard <= Watchdog::kMaxSilence) {
      // What it was about to say when it was stopped, it may have said by now.
      if (said_ > 0) say_zero(zero_);
      said_ = 0;
    } else if (is_force_on || said_ > 0) {
      say();
    }
  }
  void owner_is_gone() {
    if (!beat_.is_force_on.load(std::memory_order_acquire)) return;
    for (said_ = 0; said_ < kMaxZeros;) {
      say();
      std::this_thread::sleep_for(std::chrono::milliseconds(kLook_ms));
    }
  }

 private:
  void say() {
    if (said_ >= kMaxZeros) return;
    if (++said_ == 1) beat_.let_go.fetch_add(1, std::memory_order_release);
    say_zero(zero_);
  }

  ZeroCommand zero_;
  WatchdogBeat& beat_;
  int said_ = 0;
};

}  // namespace

int main(int count, char** arguments) {
  void* const shared = mmap(nullptr, sizeof(WatchdogBeat), PROT_READ | PROT_WRITE, MAP_SHARED, kMemory, 0);
  if (count != 4 || shared == MAP_FAILED) {
    std::cerr << "tandem-watchdog is started by a program that opens a haptic device; there is no other use of it\n";
    return 2;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGHUP, SIGPIPE, SIGTSTP}) std::signal(signal, SIG_IGN);
  static_cast<void>(realtime::request_realtime(std::atoi(arguments[1])));
  Watch watch(zero_from(arguments[2], arguments[3]), *static_cast<WatchdogBeat*>(shared));
  pollfd lifeline{kLifeline, POLLIN, 0};
  while (poll(&lifeline, 1, kLook_ms) == 0) watch.look(SteadyClock().now());
  watch.owner_is_gone();
}
