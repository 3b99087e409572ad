// Tests the live server with real sockets and threads: addresses, assignment of rooms to threads, source addresses of
// datagrams, floods, and stops.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "common/realtime/realtime.hpp"
#include "server/app/server_report.hpp"
#include "server/assets/scene_library.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/running_server.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using testing::AllOf;
using testing::HasSubstr;

std::string failure_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// A client of the control channel that sends and receives with blocking calls.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port) : socket_(io_) {
    socket_.connect({asio::ip::make_address("127.0.0.1"), port});
  }
  void send(const wire::ClientControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    asio::write(socket_, asio::buffer(frame));
  }
  /// Returns the next message; nothing at the end of the stream.
  std::optional<wire::ServerControl> receive() {
    std::array<unsigned char, proto::kFrameLengthBytes> length{};
    boost::system::error_code error;
    asio::read(socket_, asio::buffer(length), error);
    if (error) return std::nullopt;
    proto::Bytes payload((length[0] << 24U) | (length[1] << 16U) | (length[2] << 8U) | length[3]);
    asio::read(socket_, asio::buffer(payload), error);
    wire::ServerControl message;
    if (error || !proto::parse_control(payload, message)) return std::nullopt;
    return message;
  }
  test::BenchClient join() {
    wire::ClientControl hello;
    hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
    hello.mutable_hello()->add_capabilities("state-udp");
    send(hello);
    test::BenchClient client;
    const auto welcome = receive();
    client.connection = ConnectionId{welcome->welcome().connection_id()};
    client.epoch = static_cast<std::uint8_t>(welcome->welcome().epoch());
    EXPECT_EQ(welcome->welcome().datagram_port(), 0U) << "as TCP, whatever it was mapped to on the way";
    send(test::HubBench::join_message("raw"));
    client.joined = receive()->joined();
    return client;
  }

 private:
  asio::io_context io_;
  tcp::socket socket_;
};

proto::Bytes state_datagram(test::BenchClient& client) {
  proto::Bytes datagram;
  proto::append_header({proto::DatagramType::kClientUpdate, client.epoch, client.connection, ++client.sequence},
                       datagram);
  proto::ClientUpdate update;
  update.input_tick = Tick{client.sequence};
  proto::append_client_update(update, datagram);
  return datagram;
}

TEST(LiveServer, RefusesEveryAddressThatIsNotLoopback) {
  for (const char* address : {"0.0.0.0", "192.0.2.7", "::", "example.org"}) {
    const std::string why = failure_of([address] { LiveServer({.bind_address = address, .port = 0}, {}); });
    EXPECT_THAT(why, AllOf(HasSubstr(address), HasSubstr("127.0.0.1")));
  }
}

TEST(LiveServer, NamesThePortInUseAndTheRemedy) {
  LiveServer first({.port = 0}, {});
  const std::string why = failure_of([&first] { LiveServer({.port = first.port()}, {}); });
  EXPECT_THAT(why, AllOf(HasSubstr(std::to_string(first.port())), HasSubstr("in use"), HasSubstr("--port")));
}

TEST(LiveServer, ConnectionIdsOfNoTwoServersAgree) {
  std::set<std::uint64_t> ids;
  for (int i = 0; i < 3; ++i) {
    test::RunningServer running(test::two_hands_scene());
    RawClient raw(running.server->port());
    ids.insert(raw.join().connection.value);
    running.stop();
  }
  EXPECT_EQ(ids.size(), 3U) << "by chance once in 10^19 runs";
}

TEST(LiveServer, StepsItsRoomsAndReportsItsOwnTiming) {
  test::RunningServer running(test::two_hands_scene());
  RawClient raw(running.server->port());
  raw.join();
  running.stop();
  const std::vector<RoomTiming> timings = running.server->room_timings();
  ASSERT_EQ(timings.size(), 1U);
  EXPECT_GT(timings[0].steps, 0U);
  EXPECT_EQ(timings[0].step_time.count(), timings[0].steps);
  EXPECT_EQ(running.server->counters().joins, 1U);
  const boost::json::object json = report_json(*running.server);
  EXPECT_EQ(json.at("rooms").at(0).at("name"), "bench");
  EXPECT_EQ(json.at("joins"), 1);
}

TEST(LiveServer, AnEmptyRoomSleeps) {
  test::RunningServer running(test::two_hands_scene());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  running.stop();
  EXPECT_EQ(running.server->room_timings()[0].steps, 0U);
}

/// Counts the steps in which the room reports to its users that it is slow (kFaultRoomSlow).
class SlowReports final : public RoomWatcher {
 public:
  void on_command(const RoomCommand&) noexcept override {}
  void on_input(std::size_t, const proto::ClientUpdate&) noexcept override {}
  void on_step(const Room&, ServerTime, TickFaults faults) noexcept override {
    count += (faults & kFaultRoomSlow) != 0 ? 1 : 0;
  }
  int count = 0;
};

/// Runs two rooms. A step of the first room takes 4 ms in a period of 1 ms, which must not delay the second room.
TEST(LiveServer, ASlowRoomIsReportedAndDelaysNoOtherRoom) {
  std::vector<std::unique_ptr<Room>> rooms;
  for (const char* name : {"slow", "quick"})
    rooms.push_back(std::make_unique<Room>(RoomId{1}, name, test::scene_of(test::two_hands_scene(name))));
  for (const auto& room : rooms) ASSERT_TRUE(room->post({.seat = {0, UserId{1}, UserRole::kObserver}}));
  SlowReports reports;
  rooms[0]->watch(reports);
  LiveServer server({.port = 0}, std::move(rooms));
  std::vector<std::string> log;
  server.on_log = [&log](std::string_view, const std::string& line) { log.push_back(line); };
  std::atomic<int> slow_steps{0};
  server.on_step = [&](const Room& room, LocalTime) {
    if (room.name() != "slow") return;
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    if (++slow_steps == 200) server.stop();
  };
  server.run();
  EXPECT_GT(server.room_timings()[0].slow, 50U);
  EXPECT_GT(reports.count, 50);
  EXPECT_GT(server.room_timings()[1].steps, 2 * server.room_timings()[0].steps);
  EXPECT_THAT(log, testing::Contains(HasSubstr("room slow steps at less than 90 %")));
}

/// Returns `count` rooms with one observer in each, so that none of them sleeps.
std::vector<std::unique_ptr<Room>> busy_rooms(std::size_t count, double rate_hz, double rate_of_first_hz) {
  std::vector<std::unique_ptr<Room>> rooms;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = "room " + std::to_string(i);
    std::string scene = test::two_hands_scene(name);
    scene.insert(1, R"("step_rate_hz": )" + std::to_string(i == 0 ? rate_of_first_hz : rate_hz) + ", ");
    const RoomId id{static_cast<std::uint32_t>(i)};
    rooms.push_back(std::make_unique<Room>(id, name, test::scene_of(scene)));
    if (!rooms.back()->post({.seat = {0, UserId{1}, UserRole::kObserver}})) throw std::runtime_error("a room is full");
  }
  return rooms;
}

/// Small rooms must share threads, and the steps of two rooms of a thread must not be due at the same time. A stalled
/// machine may give a room a thread of its own for some time, so the test allows many steps.
TEST(LiveServer, SmallRoomsShareThreadsAndAreDueOneAfterTheOther) {
  const std::size_t threads = realtime::usable_cores();
  constexpr double kRate_hz = 100;
  constexpr int kSteps = 50, kMaxSteps = 3000;
  LiveServer server({.port = 0}, busy_rooms(2 * threads, kRate_hz, kRate_hz));
  const Duration period = server.rooms().front()->period();
  std::vector<std::atomic<std::thread::id>> thread(2 * threads);
  std::vector<std::atomic<Duration>> phase(2 * threads);
  const auto follows = [&](std::size_t i) {
    const Duration after = (phase[i + threads].load() - phase[i].load() + period) % period;
    return thread[i].load() == thread[i + threads].load() && after >= std::chrono::microseconds(200) &&
           after < period / 2;
  };
  std::atomic<int> steps{0};
  std::atomic<bool> all_follow{false};
  server.on_step = [&](const Room& room, LocalTime deadline) {
    thread[room.id().value] = std::this_thread::get_id();
    phase[room.id().value] = deadline.time_since_epoch() % period;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
    if (room.id().value != 0 || ++steps < kSteps) return;
    bool do_all = true;
    for (std::size_t i = 0; i < threads; ++i) do_all = do_all && follows(i);
    all_follow = do_all;
    if (all_follow || steps >= kMaxSteps) server.stop();
  };
  server.run();
  EXPECT_TRUE(all_follow);
}

/// Runs rooms while every step of the first room takes 3 ms longer than usual. Returns the thread on which each room
/// has run last.
std::vector<std::thread::id> threads_beside_long_steps(double rate_hz, double rate_of_first_hz, int steps_of_first) {
  LiveServer server({.port = 0}, busy_rooms(2 * realtime::usable_cores(), rate_hz, rate_of_first_hz));
  std::vector<std::thread::id> thread(server.rooms().size());
  std::atomic<int> steps{0};
  server.on_step = [&](const Room& room, LocalTime) {
    thread[room.id().value] = std::this_thread::get_id();
    if (room.id().value != 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    if (++steps == steps_of_first) server.stop();
  };
  server.run();
  return thread;
}

TEST(LiveServer, ARoomSlowerThanItsPeriodGetsASeparateThread) {
  const auto thread = threads_beside_long_steps(1000, 1000, 200);
  EXPECT_EQ(std::ranges::count(thread, thread[0]), 1);
}

TEST(LiveServer, ASlowRateIsNoReasonToHoldUpAFastOne) {
  const auto thread = threads_beside_long_steps(1000, 60, 60);
  EXPECT_EQ(std::ranges::count(thread, thread[0]), 1) << "3 ms of its 16.7 are little, but not of the others' 1";
}

TEST(LiveServer, SendsStateToWhereTheUsersDatagramsComeFrom) {
  test::RunningServer running(test::two_hands_scene());
  RawClient raw(running.server->port());
  test::BenchClient client = raw.join();
  asio::io_context io;
  udp::socket socket(io, udp::endpoint(asio::ip::make_address("127.0.0.1"), 0));
  const udp::endpoint server(asio::ip::make_address("127.0.0.1"), running.server->port());
  socket.send_to(asio::buffer(state_datagram(client)), server);
  for (std::uint64_t expected = 1; expected <= 20; ++expected) {
    std::array<std::byte, 2048> buffer{};
    udp::endpoint from;
    const std::size_t size = socket.receive_from(asio::buffer(buffer), from);
    proto::DatagramHeader header;
    ASSERT_EQ(proto::parse_header(std::span(buffer).first(size), header), proto::DropReason::kNone);
    EXPECT_EQ(header.connection, client.connection);
    EXPECT_EQ(from, server);
  }
}

TEST(LiveServer, IgnoresAUsersDatagramsFromAnotherAddress) {
  test::RunningServer running(test::two_hands_scene());
  RawClient raw(running.server->port());
  test::BenchClient client = raw.join();
  asio::io_context io;
  udp::socket elsewhere(io, udp::endpoint(asio::ip::make_address("127.0.0.2"), 0));
  udp::socket home(io, udp::endpoint(asio::ip::make_address("127.0.0.1"), 0));
  const udp::endpoint server(asio::ip::make_address("127.0.0.1"), running.server->port());
  elsewhere.send_to(asio::buffer(state_datagram(client)), server);
  home.send_to(asio::buffer(state_datagram(client)), server);
  std::array<std::byte, 2048> buffer{};
  udp::endpoint from;
  // Waits for the answer. One socket of the server preserves the order, so both datagrams have then arrived.
  home.receive_from(asio::buffer(buffer), from);
  elsewhere.non_blocking(true);
  boost::system::error_code error;
  elsewhere.receive_from(asio::buffer(buffer), from, 0, error);
  EXPECT_EQ(error, asio::error::would_block);
  running.stop();
  EXPECT_EQ(running.server->counters().received_drops.count(proto::DropReason::kNotAllowed), 1U);
}

TEST(LiveServer, AFloodAtItsPortDoesNotDiscardDatagramsOfUsers) {
  test::RunningServer running(test::two_hands_scene());
  RawClient raw(running.server->port());
  test::BenchClient client = raw.join();
  asio::io_context io;
  const udp::endpoint any(asio::ip::make_address("127.0.0.1"), 0);
  const udp::endpoint server(any.address(), running.server->port());
  udp::socket home(io, any), elsewhere(io, any);
  std::array<std::byte, 2048> buffer{};
  udp::endpoint from;
  home.send_to(asio::buffer(state_datagram(client)), server);
  home.receive_from(asio::buffer(buffer), from);  // from this answer on, the server has a confirmed address of the user
  {
    const auto held = running.hold_io();
    { const RawClient passing(running.server->port()); }  // makes the server log a line
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const std::vector<std::byte> garbage(100, std::byte{0xFF});
    for (int i = 0; i < 20'000; ++i) elsewhere.send_to(asio::buffer(garbage), server);
    for (int i = 0; i < 10; ++i) home.send_to(asio::buffer(state_datagram(client)), server);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  running.stop();
  EXPECT_TRUE(running.has_logged("; 11 inputs taken"));
}

TEST(LiveServer, SilentConnectionsDoNotBlockOtherUsers) {
  test::RunningServer running(test::two_hands_scene());
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 100; ++i) silent.push_back(std::make_unique<RawClient>(running.server->port()));
  RawClient raw(running.server->port());
  wire::ClientControl hello;
  hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
  raw.send(hello);
  const auto answer = raw.receive();
  ASSERT_TRUE(answer.has_value());
  EXPECT_TRUE(answer->has_welcome()) << answer->ShortDebugString();
}

TEST(LiveServer, SendsGoodbyeWhenItStops) {
  test::RunningServer running(test::two_hands_scene());
  RawClient raw(running.server->port());
  raw.join();
  running.server->stop();
  std::optional<wire::ServerControl> last;
  while (const auto message = raw.receive()) last = message;
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->goodbye().reason(), wire::DISCONNECT_SERVER_STOPPING);
}

TEST(LiveServer, DisconnectsAClientThatSendsRequestsButReadsNoAnswers) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "slow_reader";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "square.obj") << "# " << std::string(2 * proto::kAssetChunkBytes, 'x')
                                       << "\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  test::RunningServer running(R"({"name": "meshes", "tools": [{"name": "a"}], "bodies": [{"name": "floor", "shapes": [
                            {"mesh": {"file": ")" +
                              (folder / "square.obj").string() + R"("}}]}]})");
  RawClient raw(running.server->port());
  const test::BenchClient client = raw.join();
  wire::ClientControl request;
  request.mutable_get_asset()->set_sha256(client.joined.assets(0).sha256());
  // Each request causes an answer of 64 KiB that the client does not read. The answers soon exceed the socket buffers
  // and the server's limit. The server must then log the reason and close the connection, so that sending fails.
  failure_of([&] {
    for (int i = 0; i < 100'000 && !running.has_logged("piled up"); ++i) raw.send(request);
  });
  EXPECT_TRUE(test::eventually([&running] { return running.has_logged("piled up unread"); }));
}

TEST(SceneLibrary, FindsAFileOrANameOrListsTheAvailableScenes) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "scene_library";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "attic.json") << "{}";
  EXPECT_EQ(find_scene("attic", {folder / "nowhere", folder}), folder / "attic.json");
  EXPECT_EQ(find_scene((folder / "attic.json").string(), {}), folder / "attic.json");
  EXPECT_THAT(failure_of([&] { find_scene("cellar", {folder}); }), AllOf(HasSubstr("cellar"), HasSubstr("attic")));
}

}  // namespace
}  // namespace tandem::server
