// Runs a program with an emulated USB device: fake_device falcon|spacemouse PROGRAM ARGUMENT...
//
// The program must run under umockdev-wrapper. Lines on stdin are commands that move the device or inject faults. The
// command `report_state` prints a line on stderr, and `stop` sends SIGTERM to the program. fake_device ends when the
// program ends, and returns its exit code.
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <thread>

#include "tests/devices/falcon_usb_bus.hpp"
#include "tests/devices/hid_node.hpp"

namespace tandem::devices {
namespace {

constexpr std::size_t kFirmwareSize = 7914;

/// Handler of each command, by the first word of a line.
using Commands = std::map<std::string, std::function<void(std::istream&)>>;

void write_line(const std::string& line) {
  std::cerr << "fake: " + line + "\n" << std::flush;
}

struct FakeFalcon {
  FalconSimulator falcon{kFirmwareSize};
  UsbBus bus{falcon};
  Vec3 at_m = Vec3(0, 0, 0.125);  ///< position of the grip; guarded by the lock of the bus

  FakeFalcon() {
    std::thread([this] { tremble(); }).detach();
  }
  /// Moves the grip slightly and continually, like a hand. The driver regards encoders that do not change under a force
  /// as frozen.
  [[noreturn]] void tremble() {
    for (int i = 0;; ++i) {
      bus.with_falcon([&](FalconSimulator& f) { f.grip_m = at_m + Vec3(2e-4 * (i % 2), 0, 0); });
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  Commands commands() {
    return {{"grip", [this](std::istream& in) { grip(in); }},
            {"fault", [this](std::istream& in) { fault(in); }},
            {"unplug", [this](std::istream&) { bus.unplug(); }},
            {"plug", [this](std::istream&) { bus.plug_in(); }},
            {"power", [this](std::istream&) { bus.with_falcon([](FalconSimulator& f) { f.cycle_power(); }); }},
            {"tell", [this](std::istream&) { report_state(); }}};
  }
  void grip(std::istream& in) {
    Vec3 p;
    in >> p.x() >> p.y() >> p.z();
    bus.with_falcon([&](FalconSimulator&) { at_m = p; });
  }
  void fault(std::istream& in) {
    std::string name;
    int value = 0;
    in >> name >> value;
    bus.with_falcon([&](FalconSimulator& f) {
      FalconFaults& faults = f.faults;
      if (name == "corrupt") faults.uploads_corrupted = value;
      if (name == "garbage") faults.sends_garbage = value != 0;
      if (name == "split") faults.splits_replies = value != 0;
      if (name == "delay") faults.replies_delayed_by = value;
      if (name == "frozen") faults.has_frozen_encoders = value != 0;
      if (name == "mute") faults.is_mute = value != 0;
    });
  }
  void report_state() {
    std::ostringstream line;
    bus.with_falcon([&line](FalconSimulator& f) {
      line << "motors " << f.motors.cwiseAbs().maxCoeff() << " light " << int{f.lights_and_home} << " uploads "
           << f.uploads_begun;
    });
    write_line(line.str());
  }
};

struct FakeSpaceMouse {
  HidNode node;

  Commands commands() {
    return {{"report", [this](std::istream& in) { report(in); }},
            {"unplug", [this](std::istream&) { node.unplug(); }},
            {"plug", [this](std::istream&) { node.plug_in(); }},
            {"tell", [this](std::istream&) { write_line("light " + std::to_string(node.light())); }}};
  }
  /// Sets the report that the device sends repeatedly. A SpaceMouse repeats its report in this way while the cap is
  /// deflected. The input contains the bytes of the report in hexadecimal.
  void report(std::istream& in) {
    std::vector<std::uint8_t> bytes;
    for (unsigned byte = 0; in >> std::hex >> byte;) bytes.push_back(static_cast<std::uint8_t>(byte));
    node.hold(bytes);
  }
};

void obey(const Commands& commands, pid_t program) {
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "stop") kill(program, SIGTERM);
    if (const auto found = commands.find(first); found != commands.end()) found->second(words);
  }
}

int run(const Commands& commands, char** program_and_arguments) {
  pid_t program = 0;
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSCHEDULER);
  posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
  if (posix_spawnp(&program, program_and_arguments[0], nullptr, &attributes, program_and_arguments, environ) != 0)
    return 127;
  std::thread([commands, program] { obey(commands, program); }).detach();
  int status = 0;
  waitpid(program, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

template <class Fake>
int run_with(char** program_and_arguments) {
  // Requests real-time priority, if permitted, so that the emulated device responds as fast as a kernel. Threads that
  // are started later inherit the priority.
  const sched_param priority{.sched_priority = 75};
  sched_setscheduler(0, SCHED_FIFO, &priority);
  Fake fake;
  std::_Exit(run(fake.commands(), program_and_arguments));  // exit() would wait for the command thread
}

}  // namespace
}  // namespace tandem::devices

int main(int argument_count, char** arguments) {
  using namespace tandem::devices;
  if (argument_count < 3) return 2;
  return arguments[1] == std::string("falcon") ? run_with<FakeFalcon>(arguments + 2)
                                               : run_with<FakeSpaceMouse>(arguments + 2);
}
