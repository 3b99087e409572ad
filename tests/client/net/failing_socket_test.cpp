// Tests that a datagram socket which fails persistently does not keep the io thread busy. This program replaces
// recvmsg().
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>

#include "client/net/client_io.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/running_server.hpp"

namespace {

std::atomic<bool> is_failing{false};
std::atomic<std::uint64_t> failures{0};

}  // namespace

/// Fails with ENOBUFS while `is_failing`; otherwise calls the function of the C library. The datagram stays queued, so
/// the socket stays readable.
extern "C" ssize_t recvmsg(int socket, msghdr* message, int flags) {
  static const auto next = reinterpret_cast<ssize_t (*)(int, msghdr*, int)>(::dlsym(RTLD_NEXT, "recvmsg"));
  if (!is_failing) return next(socket, message, flags);
  ++failures;
  errno = ENOBUFS;
  return -1;
}

namespace tandem::client {
namespace {

TEST(FailingSocket, IsReadAgainAfterPausesAndRecovers) {
  test::RunningServer running(test::two_hands_scene());
  ScriptedDevice device;
  ClientIoSettings settings;
  settings.port = running.server->port();
  settings.client.session.user_name = "ada";
  ClientIo io(settings, device);
  io.start();
  const auto received = [&io] { return io.snapshot().counters.datagrams_received; };
  ASSERT_TRUE(test::eventually([&] { return received() > 10; })) << io.snapshot().status.why;
  const auto began = std::chrono::steady_clock::now();
  is_failing = true;
  ASSERT_TRUE(test::eventually([&] { return failures > 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  is_failing = false;
  const auto lasted = std::chrono::steady_clock::now() - began;
  // At most 16 attempts are permitted in each 10 ms. A busy loop makes some hundred thousand.
  const auto pauses = static_cast<std::uint64_t>(lasted / std::chrono::milliseconds(10));
  EXPECT_LE(failures, 16 * (pauses + 2));
  const std::uint64_t before = received();
  EXPECT_TRUE(test::eventually([&] { return received() > before + 10; })) << "the socket works again";
}

}  // namespace
}  // namespace tandem::client
