// Tests the Inverse3 driver over a real local WebSocket. A simulated service uses the protocol of the manufacturer's
// service.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/buttons.hpp"
#include "devices/device_reader.hpp"
#include "devices/inverse3/inverse3_driver.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::asio::ip::tcp;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

/// A service that answers each command with a state, and sends nothing else.
class FakeService {
 public:
  explicit FakeService(std::uint16_t port = 0) : acceptor_(io_, {asio::ip::address_v4::loopback(), port}) {
    accept();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~FakeService() {
    asio::post(io_, [this] { io_.stop(); });
    thread_.join();
  }
  FakeService(const FakeService&) = delete;
  FakeService& operator=(const FakeService&) = delete;

  tcp::endpoint endpoint() const { return acceptor_.local_endpoint(); }
  std::string last_command() {
    const std::lock_guard lock(mutex_);
    return last_command_;
  }
  void set_state(const std::string& text) {
    const std::lock_guard lock(mutex_);
    state_ = text;
  }

  std::atomic<int> commands{0};
  std::atomic<int> states{0};
  std::atomic<int> connections{0};
  std::atomic<int> delay_ms{0};
  std::atomic<bool> is_mute{false};
  std::atomic<bool> hangs_up{false};  ///< true: closes the connection at the next command

 private:
  struct Connection {
    explicit Connection(tcp::socket socket) : stream(std::move(socket)), timer(stream.get_executor()) {}
    beast::websocket::stream<beast::tcp_stream> stream;
    beast::flat_buffer buffer;
    asio::steady_timer timer;
    std::string text;
  };

  void accept() {
    acceptor_.async_accept([this](const boost::system::error_code& error, tcp::socket socket) {
      if (error) return;
      ++connections;
      const auto connection = std::make_shared<Connection>(std::move(socket));
      connection->stream.async_accept([this, connection](const boost::system::error_code& refused) {
        if (!refused) send_state(connection);
      });
      accept();
    });
  }
  void send_state(const std::shared_ptr<Connection>& connection) {
    if (is_mute) return listen(connection);
    connection->timer.expires_after(milliseconds(delay_ms));
    connection->timer.async_wait([this, connection](const boost::system::error_code&) {
      {
        const std::lock_guard lock(mutex_);
        connection->text = state_;
      }
      connection->stream.async_write(asio::buffer(connection->text),
                                     [this, connection](const boost::system::error_code& error, std::size_t) {
                                       if (error) return;
                                       ++states;
                                       listen(connection);
                                     });
    });
  }
  void listen(const std::shared_ptr<Connection>& connection) {
    connection->stream.async_read(connection->buffer,
                                  [this, connection](const boost::system::error_code& error, std::size_t) {
                                    if (error) return;
                                    receive(beast::buffers_to_string(connection->buffer.data()));
                                    connection->buffer.clear();
                                    if (hangs_up.exchange(false))
                                      return beast::get_lowest_layer(connection->stream).close();
                                    send_state(connection);
                                  });
  }
  void receive(std::string command) {
    ++commands;
    const std::lock_guard lock(mutex_);
    last_command_ = std::move(command);
  }

  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::mutex mutex_;
  std::string last_command_;
  std::string state_ =
      R"({"inverse3":[{"device_id":"0417","state":{"cursor_position":{"x":0.1,"y":-0.05,"z":0.2},)"
      R"("cursor_velocity":{"x":0.01,"y":0,"z":0}}}],"wireless_verse_grip":[{"device_id":"7",)"
      R"("state":{"orientation":{"x":0,"y":0,"z":1,"w":0},"buttons":{"a":true,"b":false,"c":false}}}]})";
  std::thread thread_;
};

std::string moved_state(double x_m) {
  return R"({"inverse3":[{"device_id":"0417","state":{"cursor_position":{"x":)" + std::to_string(x_m) +
         R"(,"y":-0.05,"z":0.2},"cursor_velocity":{"x":0,"y":0,"z":0}}}]})";
}

struct Rig {
  explicit Rig(tcp::endpoint service) : driver(DeviceSpec{}, std::move(service)) {}
  DeviceSample step(const Wrench& wrench = {}) { return driver.step(clock.now(), wrench); }
  /// Runs steps until the device is in `state`, for at most 20 s. Returns the last sample.
  DeviceSample until(DeviceState state, const Wrench& wrench = {}) {
    const LocalTime give_up = clock.now() + seconds(20);
    DeviceSample sample = step(wrench);
    while (sample.state != state && clock.now() < give_up) {
      sample = step(wrench);
      if (sample.state != DeviceState::kReady) std::this_thread::sleep_for(milliseconds(2));
    }
    EXPECT_EQ(sample.state, state) << describe(sample);
    return sample;
  }

  SteadyClock clock;
  Inverse3Driver driver;
};

TEST(Inverse3Messages, ReadsAStateAndWritesACommandAsTheServiceHasThem) {
  const auto state = read_inverse3_state(
      R"({"inverse3":[{"device_id":"0417","state":{"cursor_position":{"x":1,"y":2.5,"z":-3e-1}}}]})");
  ASSERT_TRUE(state);
  EXPECT_EQ(state->cursor_m, Vec3(1, 2.5, -0.3));
  EXPECT_EQ(state->cursor_m_per_s, Vec3::Zero());
  EXPECT_FALSE(state->grip);
  EXPECT_EQ(
      inverse3_command(state->device_id, Vec3(1, 0, -2)),
      R"({"inverse3":[{"device_id":"0417","commands":{"set_cursor_force":{"values":{"x":1E0,"y":0E0,"z":-2E0}}}}]})");
}

TEST(Inverse3Messages, AnythingElseIsNoState) {
  for (const char* text :
       {"", "{", "[]", "null", "{}", R"({"inverse3":[]})", R"({"inverse3":{}})", R"({"inverse3":[7]})",
        R"({"inverse3":[{"state":{}}]})", R"({"inverse3":[{"device_id":[]}]})",
        R"({"inverse3":[{"device_id":{"a":1},"state":{"cursor_position":{"x":1,"y":2,"z":3}}}]})"}) {
    EXPECT_FALSE(read_inverse3_state(text)) << text;
  }
  EXPECT_FALSE(read_inverse3_state(std::string(100'000, '[')));
  const auto half =
      read_inverse3_state(R"({"inverse3":[{"device_id":3,"state":{"cursor_position":{"x":"1","y":2,"z":3}}}]})");
  ASSERT_TRUE(half);
  EXPECT_FALSE(half->cursor_m);
}

TEST(Inverse3Service, MustBeOfThisMachine) {
  EXPECT_EQ(inverse3_endpoint("127.0.0.1:10001").port(), 10001);
  for (const char* bad : {"", ":", "10001", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000",
                          "192.0.2.1:10001", "127.0.0.1:10001x", "example.org:10001"}) {
    EXPECT_THROW(inverse3_endpoint(bad), std::invalid_argument) << bad;
  }
}

TEST(Inverse3, IsReadyWhereItWasFirstSeenAndMovesWithTheCursor) {
  FakeService service;
  Rig rig(service.endpoint());
  DeviceSample sample = rig.until(DeviceState::kReady);
  EXPECT_TRUE(sample.is_valid);
  EXPECT_EQ(sample.X_DH.p, Vec3::Zero());
  EXPECT_EQ(sample.V_DH.v, Vec3(0.01, 0, 0));
  EXPECT_NEAR(sample.X_DH.q.z(), 1, 1e-12);
  EXPECT_EQ(sample.buttons, kButtonGrab);
  service.set_state(moved_state(0.13));
  for (int i = 0; i < 20; ++i) sample = rig.step();
  EXPECT_NEAR((sample.X_DH.p - Vec3(0.03, 0, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR(sample.X_DH.q.z(), 1, 1e-12) << "the last reported orientation of the grip";
}

TEST(Inverse3, GivesOneCommandForEachState) {
  FakeService service;
  service.delay_ms = 3;
  Rig rig(service.endpoint());
  rig.until(DeviceState::kReady);
  for (int i = 0; i < 100; ++i) rig.step({Vec3(0, 0, 1.5), Vec3::Zero()});
  EXPECT_LE(service.commands, service.states);
  EXPECT_GE(service.commands, service.states - 2);
  EXPECT_THAT(service.last_command(), HasSubstr(R"("z":1.5E0)"));
  for (int i = 0; i < 5; ++i) rig.step();
  EXPECT_THAT(service.last_command(), HasSubstr(R"("z":0E0)"));
}

TEST(Inverse3, ZeroWaitsForNoStateOfAServiceThatHasFallenSilent) {
  FakeService service;
  Rig rig(service.endpoint());
  rig.until(DeviceState::kReady);
  const LocalTime give_up = rig.clock.now() + seconds(1);  // well before missing states count as a fault
  const auto is_shown = [&service](const char* z) { return service.last_command().find(z) != std::string::npos; };
  while (!is_shown(R"("z":1.5E0)") && rig.clock.now() < give_up) rig.step({Vec3(0, 0, 1.5), Vec3::Zero()});
  service.is_mute = true;
  for (int i = 0; i < 20; ++i) rig.step({Vec3(0, 0, 1.5), Vec3::Zero()});
  ASSERT_TRUE(is_shown(R"("z":1.5E0)"));
  while (!is_shown(R"("z":0E0)") && rig.clock.now() < give_up) rig.step();
  EXPECT_TRUE(is_shown(R"("z":0E0)"));
}

TEST(Inverse3, ASlowServiceGivesOldSamplesWhichTheReaderDoesNotBelieve) {
  FakeService service;
  service.delay_ms = 60;
  Rig rig(service.endpoint());
  rig.until(DeviceState::kReady);
  bool was_old = false;
  for (int i = 0; i < 30; ++i) {
    const DeviceSample sample = rig.step();
    EXPECT_EQ(sample.state, DeviceState::kReady);
    was_old = was_old || rig.clock.now() - sample.taken > milliseconds(25);
  }
  EXPECT_TRUE(was_old);
  EXPECT_LE(service.commands, service.states) << "and is not pressed for more";
}

TEST(Inverse3, AServiceThatEndsIsLostAndOneThatComesBackIsFound) {
  auto service = std::make_unique<FakeService>();
  const tcp::endpoint endpoint = service->endpoint();
  Rig rig(endpoint);
  rig.until(DeviceState::kReady);
  service.reset();
  const DeviceSample lost = rig.until(DeviceState::kLost);
  EXPECT_THAT(std::string(lost.reason), HasSubstr("start it"));
  service = std::make_unique<FakeService>(endpoint.port());
  service->set_state(moved_state(0.12));
  const DeviceSample back = rig.until(DeviceState::kReady);
  EXPECT_NEAR(back.X_DH.p.x(), 0.02, 1e-9) << "its origin stays";
}

TEST(Inverse3, AConnectionThatIsCutIsMadeAnew) {
  FakeService service;
  Rig rig(service.endpoint());
  rig.until(DeviceState::kReady);
  service.hangs_up = true;
  std::this_thread::sleep_for(seconds(1));  // simulates a long connection
  rig.until(DeviceState::kLost, {Vec3(1, 0, 0), Vec3::Zero()});
  const LocalTime lost = rig.clock.now();
  rig.until(DeviceState::kReady);
  EXPECT_EQ(service.connections, 2);
  EXPECT_GT(rig.clock.now() - lost, milliseconds(500)) << "long enough to be reported";
}

TEST(Inverse3, SilenceAndNonsenseAreSaid) {
  FakeService nonsense;
  nonsense.set_state("{\"hello\":1}");
  Rig rig(nonsense.endpoint());
  DeviceSample sample;
  const LocalTime give_up = rig.clock.now() + seconds(20);
  while (sample.reason.empty() && rig.clock.now() < give_up) sample = rig.step();
  EXPECT_EQ(sample.state, DeviceState::kOpening);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("reports no Inverse3"));
  FakeService later;
  Rig other(later.endpoint());
  other.until(DeviceState::kReady);
  later.is_mute = true;
  sample = other.until(DeviceState::kLost);
  EXPECT_THAT(std::string(sample.reason), HasSubstr("sends nothing"));
}

TEST(Inverse3, WithoutAServiceItNamesTheProgramToStart) {
  DeviceOptions options;
  options.name = "inverse3";
  options.profile = find_device_profile("inverse3");
  {
    const FakeService absent;
    options.service = "127.0.0.1:" + std::to_string(absent.endpoint().port());
  }
  try {
    open_device(options);
    FAIL() << "opened";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("haply-inverse-service"));
  }
}

/// Kills all child processes of this process.
void kill_children() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream children(task.path() / "children");
    for (pid_t process = 0; children >> process;) kill(process, SIGKILL);
  }
}

TEST(Inverse3, AWatchdogThatIsKilledCostsTheForceAndIsReplaced) {
  FakeService service;
  DeviceOptions options;
  options.name = "inverse3";
  options.profile = find_device_profile("inverse3");
  options.service = "127.0.0.1:" + std::to_string(service.endpoint().port());
  const auto device = open_device(options);
  const SteadyClock clock;
  const auto ticks_until = [&](auto is_so) {
    const LocalTime give_up = clock.now() + seconds(20);
    while (!is_so() && clock.now() < give_up) {
      device->write(clock.now(), {Vec3(0, 1, 0), Vec3::Zero()});
      std::this_thread::sleep_for(milliseconds(1));
    }
    return is_so();
  };
  const auto is_shown = [&service] { return service.last_command().find(R"("y":1E0)") != std::string::npos; };
  ASSERT_TRUE(ticks_until(is_shown));
  kill_children();
  DeviceSample sample;
  EXPECT_TRUE(ticks_until([&] { return (sample = device->read(clock.now())).state == DeviceState::kLost; }));
  EXPECT_THAT(std::string(sample.reason), HasSubstr("watchdog"));
  EXPECT_TRUE(ticks_until([&] { return service.last_command().find(R"("y":0E0)") != std::string::npos; }));
  EXPECT_TRUE(ticks_until([&] { return service.connections >= 2 && is_shown(); })) << "with another one";
}

TEST(Inverse3, AnotherDeviceOfTheServiceHasAConnectionOfItsOwn) {
  FakeService service;
  const auto watchdog = std::make_shared<Watchdog>(0);
  const SteadyClock clock;
  Inverse3Driver driver(DeviceSpec{}, service.endpoint(), watchdog);
  const auto steps_until = [&](auto is_so) {
    const LocalTime give_up = clock.now() + seconds(20);
    while (!is_so() && clock.now() < give_up) {
      watchdog->begin_command();
      watchdog->beat(clock.now(), true);
      driver.step(clock.now(), {Vec3(0, 1, 0), Vec3::Zero()});
      std::this_thread::sleep_for(milliseconds(1));
    }
    return is_so();
  };
  const auto is_shown_by = [&](const char* id) {
    return service.last_command().find(id) != std::string::npos &&
           service.last_command().find(R"("y":1E0)") != std::string::npos;
  };
  ASSERT_TRUE(steps_until([&] { return is_shown_by("0417"); }));
  EXPECT_TRUE(driver.may_be_on());
  service.set_state(R"({"inverse3":[{"device_id":"0500","state":{"cursor_position":{"x":0.1,"y":-0.05,"z":0.2}}}]})");
  EXPECT_TRUE(steps_until([&] { return is_shown_by("0500"); }));
  EXPECT_EQ(service.connections, 2);
}

TEST(Inverse3, FromTheRegistryItRunsOnItsThread) {
  FakeService service;
  DeviceOptions options;
  options.name = "inverse3";
  options.profile = find_device_profile("inverse3");
  options.service = "127.0.0.1:" + std::to_string(service.endpoint().port());
  {
    const auto device = open_device(options);
    DeviceReader reader(*device);
    const SteadyClock clock;
    const LocalTime give_up = clock.now() + seconds(20);
    int ready = 0;
    while (ready < 100 && clock.now() < give_up) {
      ready += reader.read(clock.now()).is_valid ? 1 : 0;
      device->write(clock.now(), {Vec3(0, 1, 0), Vec3::Zero()});
      std::this_thread::sleep_for(milliseconds(1));
    }
    EXPECT_EQ(ready, 100);
  }
  EXPECT_THAT(service.last_command(), HasSubstr(R"("y":0E0)")) << "its end is zero";
}

}  // namespace
}  // namespace tandem::devices
