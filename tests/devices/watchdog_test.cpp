// Tests the watchdog on a line that accepts no bytes for some time. An owner process fills a pipe or a TCP connection
// and is killed, stopped or continued. Then the test reads the line. The variable TANDEM_WATCHDOG_TRIALS sets the
// number of trials of each case; the default is 1.
#include "devices/watchdog.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <thread>

#include "common/base/random.hpp"
#include "tests/devices/watchdog_line.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::devices {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kWithin = milliseconds(10);
constexpr int kTries = 5;

int trials() {
  const char* const given = std::getenv("TANDEM_WATCHDOG_TRIALS");
  return given != nullptr ? std::stoi(given) : 1;
}

/// Closes all files but one in a child process. The reader sees the end of a line only when every process has closed
/// the line, so an inherited descriptor would keep the line open.
void keep_only(int descriptor) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int other = 3; other < 512; ++other) {
    if (other != descriptor) close(other);
  }
}

/// Memory shared by the test and an owner process.
struct Shared {
  std::atomic<bool> is_busy{false};  ///< true: the line accepts no more bytes
  std::atomic<std::uint32_t> releases{0};
  std::atomic<bool> zero_requested{false};  ///< true: the test has requested that the owner releases the force
  std::atomic<bool> is_off{false};          ///< true: the owner has released the force
  std::atomic<bool> should_end{false};
};

/// A process that writes forces to a line.
class Owner {
 public:
  Owner(LineKind kind, int line) : kind_(kind), line_(line) {
    void* const memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    shared = new (memory) Shared;
    process_ = fork();
    if (process_ != 0) return;
    keep_only(line_);
    try {
      run();
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
    }
    _exit(0);
  }
  ~Owner() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    munmap(shared, sizeof(Shared));
  }
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;
  void send_signal(int number) const { kill(process_, number); }

  Shared* shared = nullptr;

 private:
  void run() {
    Watchdog watchdog(0);
    if (!watchdog.watch_over({.descriptor = line_, .usb_endpoint = std::nullopt, .bytes = frame_of(kZero)})) return;
    const SteadyClock clock;
    std::uint32_t releases = 0;
    bool may_be_on = true, was_zero = false;
    for (int failed = 0; !shared->should_end; std::this_thread::sleep_for(milliseconds(2))) {
      if (watchdog.has_released_force()) shared->releases = ++releases;
      watchdog.begin_command();
      const bool is_zero = shared->zero_requested;
      watchdog.beat(clock.now(), may_be_on);
      const auto frame = frame_of(is_zero ? kOwnZero : kForce, releases);
      bool is_out = false;
      if (kind_ == LineKind::kPipe) {
        is_out = !watchdog.is_command_obsolete() && write(line_, frame.data(), frame.size()) == kFrame;
      } else {
        is_out = was_zero == is_zero && watchdog.is_written();
        watchdog.send(frame, !is_zero);
        watchdog.send_reply(frame_of(kReply, releases));
      }
      was_zero = is_zero;
      failed = is_out ? 0 : failed + 1;
      if (failed > 10) shared->is_busy = true;
      if (is_zero && is_out) shared->is_off = true, may_be_on = false;
    }
    watchdog.beat(clock.now(), may_be_on);
  }

  LineKind kind_;
  int line_;
  pid_t process_ = -1;
};

template <class Is>
bool wait_for(Is is_so) {
  for (int i = 0; i < 20'000 && !is_so(); ++i) std::this_thread::sleep_for(milliseconds(1));
  return is_so();
}

/// A process that writes one byte as soon as its pipe accepts it. Its delay measures how soon this machine schedules a
/// process.
class Peer {
 public:
  Peer() : line_(LineKind::kPipe) {
    const std::array<std::uint8_t, 4096> much{};
    EXPECT_EQ(write(line_.writing, much.data(), much.size()), static_cast<ssize_t>(much.size()));
    process_ = fork();
    if (process_ != 0) return;
    keep_only(line_.writing);
    pollfd room{line_.writing, POLLOUT, 0};
    while (poll(&room, 1, 5) != 1) {
    }
    const std::uint8_t byte = 1;
    static_cast<void>(write(line_.writing, &byte, 1));
    _exit(0);
  }
  ~Peer() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  void open() {
    std::array<std::uint8_t, 4096> much;
    EXPECT_EQ(read(line_.reading, much.data(), much.size()), static_cast<ssize_t>(much.size()));
  }
  bool has_acted() {
    std::uint8_t byte = 0;
    return read(line_.reading, &byte, 1) == 1;
  }

 private:
  TestLine line_;
  pid_t process_ = -1;
};

enum class End : std::uint8_t { kKilled, kStopped, kContinued };

struct Case {
  LineKind line;
  End end;
  int busy_ms;
};

/// One trial: an owner process fills its line and is then killed, or stopped, or stopped and continued.
struct Trial {
  explicit Trial(const Case& what) : one(what), line(what.line), owner(what.line, line.writing), reader(line.reading) {}

  void meet_end() {
    EXPECT_TRUE(wait_for([this] { return owner.shared->is_busy.load(); }));
    releases_before = owner.shared->releases;
    owner.send_signal(one.end == End::kKilled ? SIGKILL : SIGSTOP);
    // The test reads nothing from the line until open(), so that the line stays full.
    ended = clock.now();
  }
  /// Starts to read. Measures the delays until a zero arrives and until the peer responds.
  void open(Peer& peer) {
    const LocalTime opened = clock.now();
    peer.open();
    bool has_peer = false;
    const LocalTime give_up = opened + seconds(20);
    while ((reader.zeros == 0 || !has_peer) && clock.now() < give_up) {
      while (reader.read_some()) {
      }
      if (reader.zeros > 0 && delay == Duration::max()) delay = clock.now() - opened;
      if (!has_peer && peer.has_acted()) {
        has_peer = true;
        peer_delay = clock.now() - opened;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }
  void check_end() {
    EXPECT_GT(reader.zeros, 0) << "no zero came";
    if (one.end == End::kKilled) {
      close(std::exchange(line.writing, -1));
      EXPECT_TRUE(reader.until([this] { return reader.has_ended; })) << "the watchdog has not ended";
    } else {
      EXPECT_TRUE(reader.until([this] { return reader.zeros >= 5; }));
    }
    if (one.end == End::kContinued) check_return();
    EXPECT_TRUE(reader.is_whole) << "the line contains a partial frame";
    if (one.end != End::kContinued) {
      EXPECT_EQ(reader.last, kZero);
    }
  }
  void check_return() {
    EXPECT_EQ(reader.last, kZero);
    owner.send_signal(SIGCONT);
    EXPECT_TRUE(
        reader.until([this] { return reader.last == kForce && reader.releases_at_last_force > releases_before; }));
  }

  Case one;
  SteadyClock clock;
  TestLine line;
  Owner owner;
  Reader reader;
  LocalTime ended{};
  std::uint32_t releases_before = 0;
  Duration delay = Duration::max(), peer_delay = Duration::max();
};

std::string describe(const Case& one) {
  constexpr std::array kEnds{"killed", "stopped", "continued"};
  return std::string(one.line == LineKind::kPipe ? "pipe" : "TCP") + ", owner " +
         kEnds[static_cast<std::size_t>(one.end)] + ", busy for " + std::to_string(one.busy_ms) + " ms";
}

/// Runs all cases concurrently.
std::vector<std::unique_ptr<Trial>> tried(std::vector<Case> cases) {
  std::ranges::stable_sort(cases, {}, &Case::busy_ms);
  std::vector<std::unique_ptr<Trial>> result;
  std::vector<std::unique_ptr<Peer>> peers;
  for (const Case& one : cases) {
    result.push_back(std::make_unique<Trial>(one));
    peers.push_back(std::make_unique<Peer>());
  }
  for (const auto& trial : result) trial->meet_end();
  for (std::size_t i = 0; i < result.size(); ++i) {
    Trial& trial = *result[i];
    const LocalTime due = trial.ended + milliseconds(trial.one.busy_ms);
    if (const Duration left = due - trial.clock.now(); left > Duration{0}) std::this_thread::sleep_for(left);
    trial.open(*peers[i]);
  }
  return result;
}

// After the line accepts bytes again, the watchdog must write zero within 10 ms. A busy machine may schedule the
// watchdog late, so late trials are repeated. A case fails if the zero is late in each trial although another process
// (Peer) was scheduled in time.
TEST(WatchdogLine, ZeroComesWithin10MsOfTheMomentThatTheLineTakesBytes) {
  std::vector<Case> cases;
  for (const LineKind line : {LineKind::kPipe, LineKind::kTcp}) {
    for (const End end : {End::kKilled, End::kStopped, End::kContinued}) {
      for (const int busy_ms : {300, 1000, 3000}) cases.push_back({line, end, busy_ms});
    }
  }
  Duration worst{0}, worst_of_peers{0};
  int late = 0;
  for (int i = 0; i < trials(); ++i) {
    std::vector<Case> left = cases;
    bool was_peer_in_time = false;
    for (int attempt = 0; attempt < kTries && !left.empty(); ++attempt) {
      std::vector<Case> again;
      for (const auto& trial : tried(left)) {
        SCOPED_TRACE(describe(trial->one));
        trial->check_end();
        worst = std::max(worst, trial->delay);
        worst_of_peers = std::max(worst_of_peers, trial->peer_delay);
        if (trial->delay <= kWithin) continue;
        ++late;
        was_peer_in_time = was_peer_in_time || trial->peer_delay <= kWithin;
        again.push_back(trial->one);
      }
      left = std::move(again);
    }
    if (!left.empty() && !was_peer_in_time) {
      return test::note_left_out("WatchdogLine", "no process of this machine acts within 10 ms");
    }
    for (const Case& one : left) ADD_FAILURE() << describe(one) << ": late each time";
  }
  std::cout << trials() << " times " << cases.size() << " cases: zero at the latest after "
            << std::chrono::duration<double, std::milli>(worst).count()
            << " ms (peers: " << std::chrono::duration<double, std::milli>(worst_of_peers).count() << " ms), " << late
            << " tried again\n";
}

/// Reads a few bytes at a time while the owner is stopped, continued and killed at random times. Fails if a part of a
/// frame remains in the line.
TEST(WatchdogLine, TheLineNeverContainsAPartialFrame) {
  const std::uint64_t seed = test::test_seed(59);
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    const LineKind kind = random.uniform(0, 1) < 0.2 ? LineKind::kPipe : LineKind::kTcp;
    TestLine line(kind);
    Owner owner(kind, line.writing);
    Reader reader(line.reading);
    const SteadyClock clock;
    const auto drip = [&](double for_ms) {
      const LocalTime end = clock.now() + from_seconds(for_ms / 1000);
      while (clock.now() < end) {
        reader.read_some(static_cast<std::size_t>(random.uniform(1, 700)));
        std::this_thread::sleep_for(from_seconds(random.uniform(0, 0.002)));
      }
    };
    drip(random.uniform(0, 60));
    std::this_thread::sleep_for(from_seconds(random.uniform(0, 0.1)));
    for (int stops = static_cast<int>(random.uniform(0, 3)); stops > 0; --stops) {
      owner.send_signal(SIGSTOP);
      drip(random.uniform(0, 150));
      owner.send_signal(SIGCONT);
      drip(random.uniform(0, 50));
    }
    owner.send_signal(SIGKILL);
    close(std::exchange(line.writing, -1));
    drip(random.uniform(0, 30));
    EXPECT_TRUE(reader.until([&reader] { return reader.has_ended; })) << "the watchdog has not ended";
    EXPECT_TRUE(reader.is_whole);
    EXPECT_TRUE(reader.is_between_frames()) << "the line ends with a partial frame";
    EXPECT_EQ(reader.last, kZero);
    EXPECT_GE(reader.zeros, 5);
  }
}

TEST(WatchdogLine, InputThatADeadOwnerLeftUnreadDoesNotDropTheZero) {
  TestLine line(LineKind::kTcp);
  Owner owner(LineKind::kTcp, line.writing);
  Reader reader(line.reading);
  const std::array<std::uint8_t, 1000> states{};
  ASSERT_EQ(write(line.reading, states.data(), states.size()), static_cast<ssize_t>(states.size()));
  ASSERT_TRUE(wait_for([&owner] { return owner.shared->is_busy.load(); }));
  owner.send_signal(SIGKILL);
  close(std::exchange(line.writing, -1));
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_TRUE(reader.until([&reader] { return reader.has_ended; }));
  EXPECT_EQ(reader.last, kZero);
  EXPECT_TRUE(reader.is_whole && reader.is_between_frames());
}

TEST(WatchdogLine, AZeroThatIsNotOutIsWithdrawnWhenTheOwnerGoesOnAndNotCounted) {
  TestLine line(LineKind::kPipe);
  Owner owner(LineKind::kPipe, line.writing);
  Reader reader(line.reading);
  ASSERT_TRUE(wait_for([&owner] { return owner.shared->is_busy.load(); }));
  owner.send_signal(SIGSTOP);
  std::this_thread::sleep_for(milliseconds(300));
  owner.send_signal(SIGCONT);
  std::this_thread::sleep_for(milliseconds(300));
  const auto counted = static_cast<int>(owner.shared->releases);
  EXPECT_TRUE(reader.until([&reader] { return reader.forces > 50; }));
  EXPECT_LE(counted, reader.silences) << "a release was counted, but zero was not written";
}

/// Tests a zero that the owner itself writes while the line is full. Returns false if the trial is inconclusive: the
/// machine stalled the owner for so long that the watchdog wrote a zero.
bool an_owners_zero_waits(LineKind kind) {
  TestLine line(kind);
  Owner owner(kind, line.writing);
  Reader reader(line.reading);
  EXPECT_TRUE(wait_for([&owner] { return owner.shared->is_busy.load(); }));
  owner.shared->zero_requested = true;
  std::this_thread::sleep_for(milliseconds(100));
  const bool was_off = owner.shared->is_off;
  const bool is_off_now = reader.until([&] { return owner.shared->is_off.load(); });
  EXPECT_TRUE(reader.is_whole);
  if (owner.shared->releases > 0) return false;
  EXPECT_FALSE(was_off);
  EXPECT_TRUE(is_off_now);
  EXPECT_EQ(reader.last, kOwnZero);
  return true;
}

TEST(WatchdogLine, AnOwnersZeroThatWaitsIsNotTheEndOfItsForce) {
  constexpr int kStalls = 10;
  for (const LineKind kind : {LineKind::kPipe, LineKind::kTcp}) {
    int tries = 1;
    while (!an_owners_zero_waits(kind) && tries < kStalls) ++tries;
    if (tries == kStalls) test::note_left_out("WatchdogLine", "this machine holds a process up in each of ten tries");
  }
}

TEST(WatchdogLine, AnOwnerThatEndsWithItsForceOnABusyLineLeavesAWatchdogThatLetsGo) {
  for (const LineKind kind : {LineKind::kPipe, LineKind::kTcp}) {
    TestLine line(kind);
    Owner owner(kind, line.writing);
    Reader reader(line.reading);
    ASSERT_TRUE(wait_for([&owner] { return owner.shared->is_busy.load(); }));
    owner.shared->should_end = true;
    std::this_thread::sleep_for(seconds(1));  // longer than the owner waits for its watchdog
    close(std::exchange(line.writing, -1));
    EXPECT_TRUE(reader.until([&reader] { return reader.has_ended; }));
    EXPECT_EQ(reader.last, kZero);
    EXPECT_TRUE(reader.is_whole && reader.is_between_frames());
  }
}

/// Returns the ids of the child processes of this process.
std::vector<pid_t> children() {
  std::vector<pid_t> result;
  const std::string path = "/proc/self/task/" + std::to_string(getpid()) + "/children";
  FILE* const file = fopen(path.c_str(), "r");
  for (int process = 0; file != nullptr && fscanf(file, "%d", &process) == 1;) result.push_back(process);
  if (file != nullptr) fclose(file);
  return result;
}

TEST(WatchdogLine, AWatchdogThatIsKilledIsNoticedAndItsOwnerWritesZero) {
  TestLine line(LineKind::kTcp);
  Reader reader(line.reading);
  const SteadyClock clock;
  Watchdog watchdog(0);
  ASSERT_TRUE(
      watchdog.watch_over({.descriptor = line.writing, .usb_endpoint = std::nullopt, .bytes = frame_of(kZero)}));
  watchdog.begin_command();
  watchdog.beat(clock.now(), true);
  ASSERT_TRUE(watchdog.send(frame_of(kForce), true));
  ASSERT_TRUE(reader.until([&] { return reader.forces == 1 && watchdog.is_written(); }));
  for (const pid_t process : children()) kill(process, SIGKILL);
  EXPECT_TRUE(wait_for([&] { return !watchdog.send(frame_of(kForce), true); }));
  watchdog.release();
  EXPECT_TRUE(reader.until([&reader] { return reader.zeros == 1; }));
}

TEST(WatchdogLine, RefusesFramesThatAreTooLongOrEmpty) {
  TestLine line(LineKind::kTcp);
  Watchdog watchdog(0);
  EXPECT_FALSE(watchdog.send(frame_of(kForce), true)) << "no frame is registered";
  ASSERT_TRUE(
      watchdog.watch_over({.descriptor = line.writing, .usb_endpoint = std::nullopt, .bytes = frame_of(kZero)}));
  EXPECT_FALSE(watchdog.send(std::vector<std::uint8_t>(kMaxFrameBytes + 1), true));
  EXPECT_FALSE(watchdog.send({}, true));
  EXPECT_TRUE(watchdog.send(std::vector<std::uint8_t>(kMaxFrameBytes), false));
}

}  // namespace
}  // namespace tandem::devices
