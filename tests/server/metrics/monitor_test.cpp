// Tests the health reports of a server: a hung loop must be named, and the port must not be open to other machines.
#include "server/metrics/monitor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <thread>

#include "server/metrics/health.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/running_server.hpp"

namespace tandem::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::StartsWith;

ServerPulse serving(LocalTime io, std::vector<LocalTime> rooms) {
  return {.is_serving = true, .io = io, .rooms = std::move(rooms)};
}

TEST(Health, FollowsIoAndEveryRoom) {
  const LocalTime now{seconds(100)};
  const std::vector<std::string> rooms{"attic", "cellar"};
  EXPECT_EQ(standstill(serving(now, {now, now}), rooms, now), "");
  EXPECT_EQ(standstill(serving(now, {now - kGoesRoundWithin, now}), rooms, now), "") << "not longer than that";
  EXPECT_EQ(standstill(serving(now, {now, now - milliseconds(1300)}), rooms, now),
            "room cellar has stood still for 1.3 s");
  EXPECT_EQ(standstill(serving(now - seconds(2), {now - seconds(3), now}), rooms, now),
            "io has stood still for 2.0 s; room attic has stood still for 3.0 s");
}

TEST(Health, IsReadyWhileItServesAndDoesNotStop) {
  const LocalTime now{seconds(100)};
  ServerPulse pulse = serving(now, {now});
  EXPECT_EQ(why_not_ready(pulse, {"attic"}, now), "");
  EXPECT_THAT(why_not_ready(pulse, {"attic"}, now + seconds(2)), HasSubstr("attic")) << "users cannot join the room";
  pulse.is_stopping = true;
  EXPECT_THAT(why_not_ready(pulse, {"attic"}, now), HasSubstr("stopping"));
  pulse = {};
  EXPECT_THAT(why_not_ready(pulse, {}, now), HasSubstr("listen"));
  EXPECT_EQ(standstill(pulse, {}, now), "") << "a server that has not started is not stalled";
}

/// Sends a GET request for `path` and returns the complete response.
std::string get(const Monitor& monitor, const std::string& path) {
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io);
  const std::string address = monitor.address();
  const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  socket.connect({boost::asio::ip::make_address("127.0.0.1"), port});
  boost::asio::write(socket, boost::asio::buffer("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  std::string answer;
  boost::system::error_code end;
  boost::asio::read(socket, boost::asio::dynamic_buffer(answer), end);
  return answer;
}

TEST(Monitor, ReportsTheRoomThatDoesNotStep) {
  std::vector<std::unique_ptr<Room>> rooms;
  for (const char* name : {"stuck", "good"})
    rooms.push_back(std::make_unique<Room>(RoomId{1}, name, test::scene_of(test::two_hands_scene(name))));
  for (const auto& room : rooms) ASSERT_TRUE(room->post({.seat = {0, UserId{1}, UserRole::kObserver}}));
  Monitor monitor("0", std::nullopt, [](const std::string&) {});
  EXPECT_THAT(get(monitor, "/healthz"), StartsWith("HTTP/1.1 200")) << "while rooms are loaded";
  EXPECT_THAT(get(monitor, "/readyz"), AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("loaded")));
  LiveServer server({.port = 0}, std::move(rooms));
  std::atomic<bool> is_held{false};
  server.on_step = [&is_held](const Room& room, LocalTime) {
    while (room.name() == "stuck" && is_held) std::this_thread::sleep_for(milliseconds(1));
  };
  monitor.watch(server);
  std::thread thread([&server] { server.run(); });
  const auto answers = [&monitor](const std::string& path, const std::string& status, const std::string& words) {
    return test::eventually([&] {
      const std::string answer = get(monitor, path);
      return answer.starts_with("HTTP/1.1 " + status) && answer.find(words) != std::string::npos;
    });
  };
  EXPECT_TRUE(answers("/readyz", "200", "ok"));
  EXPECT_TRUE(answers("/metrics", "200", "tandem_room_awake{room=\"stuck\"} 1"));
  is_held = true;
  EXPECT_TRUE(answers("/healthz", "503", "room stuck has stood still"));
  EXPECT_THAT(get(monitor, "/healthz"), testing::Not(HasSubstr("good")));
  EXPECT_TRUE(answers("/readyz", "503", "room stuck"));
  EXPECT_TRUE(answers("/metrics", "200", "tandem_healthy 0")) << "metrics must be available while a room is stalled";
  is_held = false;
  EXPECT_TRUE(answers("/healthz", "200", "ok"));
  server.stop();
  thread.join();
  EXPECT_THAT(get(monitor, "/readyz"), AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("ended")));
}

TEST(Monitor, OpensNoPortForOthers) {
  for (const char* address : {"0.0.0.0:9464", "192.0.2.7:9464", "[::]:9464"}) {
    try {
      Monitor monitor(address, std::nullopt, [](const std::string&) {});
      FAIL() << address << " was opened";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("--metrics"), HasSubstr(address), HasSubstr("127.0.0.1:9464")));
    }
  }
  for (const char* address : {"", "x", "65536", "-1", "9464x", "localhost", "example.org:9464", "127.0.0.1:"})
    EXPECT_THROW(Monitor(address, std::nullopt, [](const std::string&) {}), std::invalid_argument) << address;
}

}  // namespace
}  // namespace tandem::server
