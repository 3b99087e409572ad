// Tests the C interface against a server in this process.
#include "client/embed/c/tandem.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/embed/handle_table.hpp"
#include "tests/support/running_server.hpp"
#include "tests/support/test_seed.hpp"

namespace {

using namespace std::chrono_literals;
using tandem::test::eventually;
using tandem::test::RunningServer;

constexpr const char* kScene = R"({
  "name": "embedded",
  "bodies": [{"name": "block", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
              "placement": {"position_m": [0, 0, 0]}}],
  "tools": [{"name": "a", "placement": {"position_m": [0, 0, 0.04]}},
            {"name": "b", "placement": {"position_m": [0, 0, 0.2]}}],
  "gravity_m_per_s2": [0, 0, 0],
  "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 5}})";

/// The discard port of this machine, on which no program listens.
const std::string kNowhere = "127.0.0.1:9";

template <class Struct>
Struct sized() {
  Struct made{};
  made.struct_size = sizeof made;
  return made;
}

/// Returns settings for a client of `server`.
/// In      server  address of the server; it must outlive the settings, which store a pointer to its text
tandem_client_settings settings_for(const std::string& server) {
  auto settings = sized<tandem_client_settings>();
  settings.server = server.c_str();
  settings.is_insecure = 1;
  settings.realtime_priority = -1;
  settings.has_no_cache = 1;
  settings.stage = "late-pose";
  return settings;
}

std::string address_of(const RunningServer& server) {
  return "127.0.0.1:" + std::to_string(server.server->port());
}

/// A program with a hand at `height_m` above the origin. Once a millisecond it passes the pose to the client and reads
/// the force.
class FedHand {
 public:
  FedHand() {
    auto settings = sized<tandem_device_settings>();
    settings.abilities = TANDEM_SENSES_ROTATION;
    EXPECT_EQ(tandem_device_open(&settings, &device), TANDEM_OK) << tandem_last_error();
    thread_ = std::thread([this] { run(); });
  }
  ~FedHand() {
    should_end_ = true;
    thread_.join();
    tandem_device_close(device);
  }

  tandem_device device = 0;
  std::atomic<double> height_m{0};
  std::atomic<std::uint32_t> buttons{0};
  std::atomic<double> force_n{0};
  std::atomic<bool> is_fed{true};

 private:
  // The handle moves to height_m at 0.3 m/s at most, like a hand.
  void run() {
    double at_m = 0;
    while (!should_end_) {
      at_m += std::clamp(height_m - at_m, -0.0003, 0.0003);
      auto sample = sized<tandem_sample>();
      sample.handle_D.position_m[2] = at_m;
      sample.buttons = buttons;
      const tandem_status fed = is_fed ? tandem_device_feed(device, &sample) : TANDEM_OK;
      EXPECT_EQ(fed, TANDEM_OK) << tandem_last_error();
      auto force = sized<tandem_force>();
      EXPECT_EQ(tandem_device_force(device, &force), TANDEM_OK);
      const double* const f = force.on_hand_D.force_n;
      force_n = std::hypot(f[0], f[1], f[2]);
      std::this_thread::sleep_for(1ms);
    }
  }

  std::atomic<bool> should_end_{false};
  std::thread thread_;
};

/// A client that has joined and runs.
class Running {
 public:
  explicit Running(tandem_client_settings settings) {
    EXPECT_EQ(tandem_client_open(&settings, &client), TANDEM_OK) << tandem_last_error();
    EXPECT_EQ(tandem_client_join(client), TANDEM_OK) << tandem_last_error();
    EXPECT_EQ(tandem_client_wait_joined(client, 20), TANDEM_OK) << tandem_last_error();
    EXPECT_EQ(tandem_client_start(client), TANDEM_OK) << tandem_last_error();
  }
  ~Running() { tandem_client_close(client); }

  tandem_tick tick() const {
    auto tick = sized<tandem_tick>();
    tandem_client_snapshot(client, nullptr, &tick);
    return tick;
  }
  tandem_body body() const {
    std::array<tandem_body, 4> bodies{};
    bodies[0].struct_size = sizeof bodies[0];
    std::uint32_t count = 0;
    EXPECT_EQ(tandem_client_bodies(client, bodies.data(), bodies.size(), &count), TANDEM_OK);
    return count == 1 ? bodies[0] : tandem_body{};
  }
  std::vector<std::pair<tandem_event, std::string>> events() const {
    std::vector<std::pair<tandem_event, std::string>> found;
    auto event = sized<tandem_event>();
    char text[256];
    while (tandem_client_next_event(client, &event, text, sizeof text) == TANDEM_OK) found.emplace_back(event, text);
    return found;
  }

  tandem_client client = 0;
};

TEST(Abi, EveryStatusHasAText) {
  for (tandem_status status = TANDEM_FAULT; status <= TANDEM_EMPTY; ++status) {
    EXPECT_STRNE(tandem_status_text(status), tandem_status_text(99)) << status;
  }
  EXPECT_EQ(std::string(tandem_version()).find_first_not_of("0123456789."), std::string::npos);
  EXPECT_GE(tandem_protocol_version(), 3U);
  EXPECT_STREQ(tandem_server_fault_text(0), "none");
}

TEST(Abi, NullPointersAndBadSizesAreErrorsWithAText) {
  EXPECT_EQ(tandem_client_open(nullptr, nullptr), TANDEM_BAD_ARGUMENT);
  tandem_client client = 1;
  EXPECT_EQ(tandem_client_open(nullptr, &client), TANDEM_BAD_ARGUMENT);
  EXPECT_EQ(client, 0U);
  EXPECT_NE(std::string(tandem_last_error()).find("null"), std::string::npos);
  tandem_client_settings settings{};
  EXPECT_EQ(tandem_client_open(&settings, &client), TANDEM_BAD_ARGUMENT);
  EXPECT_NE(std::string(tandem_last_error()).find("struct_size is 0"), std::string::npos) << tandem_last_error();
  settings.struct_size = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(tandem_client_open(&settings, &client), TANDEM_BAD_ARGUMENT);
}

TEST(Abi, SettingsThatAreWrongNameTheFieldAndTheRemedy) {
  const std::vector<std::pair<std::function<void(tandem_client_settings&)>, std::string>> cases{
      {[](auto& s) { s.is_insecure = 0; }, "invitation"},
      {[](auto& s) { s.invitation = "no invitation", s.is_insecure = 0; }, "tandem-server --invite"},
      {[](auto& s) { s.pin = "x"; }, "exactly one"},
      {[](auto& s) { s.role = 9; }, "role is 9"},
      {[](auto& s) { s.user_name = "\xff"; }, "UTF-8"},
      {[](auto& s) { s.device = "no_such_device"; }, "sim"},
      {[](auto& s) { s.stage = "telepathy"; }, "late-pose"},
      {[](auto& s) { s.hand = "no_such_hand"; }, "no_such_hand"},
      {[](auto& s) { s.server = "1.2.3.4:x"; }, "1.2.3.4"},
      {[](auto& s) { s.realtime_priority = 100; }, "1 to 99"},
      {[](auto& s) { s.motor_counts_per_n_m = -1; }, "motor_counts_per_n_m"},
      {[](auto& s) { s.motor_counts_per_n_m = 99; }, "motor_counts_per_n_m is 99"},
      {[](auto& s) { s.motor_counts_per_n_m = 20001; }, "100 to 20000"},
  };
  for (const auto& [spoil, words] : cases) {
    auto settings = settings_for(kNowhere);
    spoil(settings);
    tandem_client client = 1;
    EXPECT_EQ(tandem_client_open(&settings, &client), TANDEM_BAD_ARGUMENT) << words;
    EXPECT_EQ(client, 0U);
    EXPECT_NE(std::string(tandem_last_error()).find(words), std::string::npos) << tandem_last_error();
  }
  auto device_settings = sized<tandem_device_settings>();
  device_settings.force_limit_n = 5;
  tandem_device device = 1;
  EXPECT_EQ(tandem_device_open(&device_settings, &device), TANDEM_BAD_ARGUMENT) << "5 N need a maximum with a source";
  device_settings.force_maximum_n = 8;
  EXPECT_EQ(tandem_device_open(&device_settings, &device), TANDEM_BAD_ARGUMENT);
  device_settings.maximum_source = "data sheet";
  EXPECT_EQ(tandem_device_open(&device_settings, &device), TANDEM_OK) << tandem_last_error();
  EXPECT_EQ(tandem_device_close(device), TANDEM_OK);
}

// A program cannot set command line options of tandem-client. An error of a device must therefore name a setting of the
// C interface.
TEST(Abi, ErrorsOfBuiltInDevicesNameSettingsInsteadOfOptions) {
  const std::vector<std::pair<std::function<void(tandem_client_settings&)>, std::string>> cases{
      {[](auto& s) { s.device = "forcedimension", s.library = "/nowhere/x.so"; }, "the setting library"},
      {[](auto& s) { s.device = "openhaptics", s.library = "/nowhere/x.so"; }, "the setting library"},
      {[](auto& s) { s.device = "falcon", s.firmware = "/nowhere/x.bin"; }, "the setting firmware"},
      {[](auto& s) { s.device = "inverse3", s.service = "192.0.2.1:1"; }, "the setting service"},
      {[](auto& s) { s.motors = "/nowhere/motors"; }, "the setting motors"},
  };
  for (const auto& [spoil, words] : cases) {
    auto settings = settings_for(kNowhere);
    spoil(settings);
    tandem_client client = 1;
    EXPECT_LT(tandem_client_open(&settings, &client), 0) << words;
    const std::string error = tandem_last_error();
    EXPECT_NE(error.find(words), std::string::npos) << error;
    EXPECT_EQ(error.find("--"), std::string::npos) << error;
  }
}

// An error of one thread must not be visible in another thread.
TEST(Abi, LastErrorBelongsToTheThread) {
  EXPECT_EQ(tandem_client_join(77), TANDEM_BAD_HANDLE);
  std::thread([] { EXPECT_STREQ(tandem_last_error(), ""); }).join();
  EXPECT_STRNE(tandem_last_error(), "");
}

TEST(Abi, JoinsTouchesGrabsAndMovesABodyWithADeviceOfTheProgram) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  FedHand hand;
  auto settings = settings_for(address);
  settings.own_device = hand.device;
  settings.user_name = "embedder";
  Running running(settings);
  auto session = sized<tandem_session>();
  ASSERT_EQ(tandem_client_session(running.client, &session), TANDEM_OK);
  EXPECT_EQ(session.state, std::uint32_t{TANDEM_JOINED});
  EXPECT_EQ(session.is_running, 1U);
  EXPECT_STREQ(session.room, "embedded");
  EXPECT_STREQ(session.device, "program");
  EXPECT_EQ(session.lost_events, 0U);
  EXPECT_EQ(session.role, std::uint32_t{TANDEM_MANIPULATOR});

  ASSERT_TRUE(eventually([&] { return running.body().id == 1; }));
  EXPECT_STREQ(running.body().name, "block");
  ASSERT_EQ(tandem_client_grab(running.client, 1), TANDEM_OK);
  ASSERT_TRUE(eventually([&] { return running.body().held_by == session.user; })) << running.events().back().second;
  EXPECT_EQ(running.tick().held_body, 1U);
  hand.height_m = 0.03;
  EXPECT_TRUE(eventually([&] { return running.body().pose_W.position_m[2] > 0.02; }));
  // The second client receives the id of the user who holds the body.
  FedHand other_hand;
  auto other_settings = settings_for(address);
  other_settings.own_device = other_hand.device;
  other_settings.user_name = "observer";
  Running other(other_settings);
  EXPECT_TRUE(eventually([&] { return other.body().held_by == session.user; }));
  std::array<tandem_user, 4> users{};
  users[0].struct_size = sizeof users[0];
  std::uint32_t count = 0;
  EXPECT_TRUE(eventually([&] {
    return tandem_client_users(other.client, users.data(), users.size(), &count) == TANDEM_OK && count == 1;
  }));
  EXPECT_STREQ(users[0].name, "embedder");
  EXPECT_EQ(users[0].holds, 1U);

  ASSERT_EQ(tandem_client_release(running.client), TANDEM_OK);
  EXPECT_TRUE(eventually([&] { return running.body().held_by == 0; }));
  std::vector<std::uint32_t> kinds;
  for (const auto& [event, text] : running.events()) kinds.push_back(event.kind);
  for (const std::uint32_t kind :
       {TANDEM_EVENT_JOINED, TANDEM_EVENT_GRABBED, TANDEM_EVENT_RELEASED, TANDEM_EVENT_USER_JOINED}) {
    EXPECT_NE(std::ranges::find(kinds, kind), kinds.end()) << kind;
  }
}

TEST(Abi, ForceIsZeroWhenCloseReturnsAndWhenTheFeedStalls) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  FedHand hand;
  auto settings = settings_for(address);
  settings.own_device = hand.device;
  Running running(settings);
  // The tool holds a block of 0.2 kg. Shaking the block must cause a force on the hand.
  ASSERT_TRUE(eventually([&] { return running.body().id == 1; }));
  const auto shake = [&] {
    hand.height_m = hand.height_m > 0.01 ? 0.0 : 0.02;
    double largest_n = 0;
    for (int i = 0; i < 60; ++i) {
      std::this_thread::sleep_for(1ms);
      largest_n = std::max(largest_n, hand.force_n.load());
    }
    return largest_n > 0.2;
  };
  ASSERT_EQ(tandem_client_grab(running.client, 1), TANDEM_OK);
  ASSERT_TRUE(eventually(shake));
  hand.is_fed = false;
  EXPECT_TRUE(eventually([&] { return hand.force_n == 0; }));
  EXPECT_TRUE(eventually([&] { return (running.tick().safety & TANDEM_SAFETY_BAD_SAMPLE) != 0; }));
  hand.is_fed = true;
  ASSERT_TRUE(eventually(shake));
  ASSERT_EQ(tandem_client_stop(running.client), TANDEM_OK);
  auto force = sized<tandem_force>();
  ASSERT_EQ(tandem_device_force(hand.device, &force), TANDEM_OK);
  EXPECT_EQ(force.on_hand_D.force_n[0] + force.on_hand_D.force_n[1] + force.on_hand_D.force_n[2], 0);
  EXPECT_EQ(tandem_client_start(running.client), TANDEM_BAD_STATE);
  EXPECT_EQ(tandem_client_grab(running.client, 1), TANDEM_BAD_STATE);
  EXPECT_EQ(tandem_client_wait_joined(running.client, 0), TANDEM_ENDED);
}

TEST(Abi, EveryTickIsReadOnceInOrder) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  FedHand hand;
  auto settings = settings_for(address);
  settings.own_device = hand.device;
  Running running(settings);
  std::this_thread::sleep_for(200ms);
  ASSERT_EQ(tandem_client_stop(running.client), TANDEM_OK);
  std::vector<tandem_tick> ticks(64, sized<tandem_tick>());
  std::uint64_t last = 0;
  std::uint32_t count = 0;
  while (tandem_client_read_ticks(running.client, ticks.data(), 64, &count) == TANDEM_OK) {
    for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(ticks[i].number, ++last);
  }
  EXPECT_GT(last, 0U);
  EXPECT_EQ(tandem_client_read_ticks(running.client, ticks.data(), 64, &count), TANDEM_EMPTY);
  EXPECT_EQ(count, 0U);
}

TEST(Abi, DescriptorIsReadableWhileThereAreEvents) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  Running running(settings_for(address));
  int descriptor = -1;
  ASSERT_EQ(tandem_client_event_descriptor(running.client, &descriptor), TANDEM_OK);
  const auto is_readable = [&] {
    pollfd ready{descriptor, POLLIN, 0};
    return ::poll(&ready, 1, 0) == 1;
  };
  ASSERT_TRUE(eventually(is_readable));
  ASSERT_TRUE(eventually([&] { return !running.events().empty() || !is_readable(); }));
  EXPECT_TRUE(eventually([&] { return running.events().empty() && !is_readable(); }));
  EXPECT_EQ(tandem_client_wait_event(running.client, 0.001), TANDEM_TIMED_OUT);
  ASSERT_EQ(tandem_client_reset_room(running.client), TANDEM_OK) << "refused, because this user is no operator";
  EXPECT_EQ(tandem_client_wait_event(running.client, 20), TANDEM_OK);
  const auto events = running.events();
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events[0].first.kind, std::uint32_t{TANDEM_EVENT_REFUSED});
  EXPECT_EQ(events[0].first.text_bytes, events[0].second.size());
}

// Settings must reach the built-in devices. The simulated device must write its commands to the given file. The error
// for a Falcon must name its missing firmware file.
TEST(Abi, SettingsOfBuiltInDevicesReachThem) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  const std::string file = testing::TempDir() + "tandem_abi_motors_" + std::to_string(::getpid());
  auto settings = settings_for(address);
  settings.motors = file.c_str();
  {
    Running running(settings);
    ASSERT_TRUE(eventually([&] { return running.tick().number > 0; }));
    auto session = sized<tandem_session>();
    ASSERT_EQ(tandem_client_session(running.client, &session), TANDEM_OK);
    EXPECT_STRNE(session.device, "");
    EXPECT_TRUE(eventually([&] { return std::filesystem::exists(file) && std::filesystem::file_size(file) > 0; }));
  }
  std::filesystem::remove(file);
  settings.motors = nullptr;
  settings.device = "falcon";
  settings.firmware = "/nowhere/firmware.bin";
  tandem_client client = 0;
  EXPECT_EQ(tandem_client_open(&settings, &client), TANDEM_SETUP_FAILED);
  EXPECT_NE(std::string(tandem_last_error()).find("/nowhere/firmware.bin"), std::string::npos) << tandem_last_error();
}

TEST(Abi, TextOfAnEventIsCutAtTheBuffer) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  Running running(settings_for(address));
  auto event = sized<tandem_event>();
  char text[5] = "abcd";
  ASSERT_TRUE(eventually([&] {
    return tandem_client_next_event(running.client, &event, text, sizeof text) == TANDEM_OK &&
           event.kind == TANDEM_EVENT_JOINED;
  }));
  EXPECT_STREQ(text, "embe");
  EXPECT_EQ(event.text_bytes, std::strlen("embedded"));
  EXPECT_EQ(tandem_client_next_event(running.client, &event, nullptr, 4), TANDEM_BAD_ARGUMENT);
}

TEST(Abi, ServerThatRefusesGivesItsReason) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  auto settings = settings_for(address);
  settings.room = "no_such_room";
  tandem_client client = 0;
  ASSERT_EQ(tandem_client_open(&settings, &client), TANDEM_OK);
  EXPECT_EQ(tandem_client_wait_joined(client, 1), TANDEM_BAD_STATE);
  ASSERT_EQ(tandem_client_join(client), TANDEM_OK);
  EXPECT_EQ(tandem_client_wait_joined(client, 20), TANDEM_ENDED);
  EXPECT_NE(std::string(tandem_last_error()).find("no_such_room"), std::string::npos) << tandem_last_error();
  EXPECT_EQ(tandem_client_close(client), TANDEM_OK);
  EXPECT_EQ(tandem_client_close(client), TANDEM_BAD_HANDLE);
}

TEST(Abi, DeviceServesOneClientAndAClosedDeviceGivesZero) {
  auto device_settings = sized<tandem_device_settings>();
  tandem_device device = 0;
  ASSERT_EQ(tandem_device_open(&device_settings, &device), TANDEM_OK);
  auto settings = settings_for(kNowhere);
  settings.own_device = device;
  tandem_client first = 0, second = 0;
  ASSERT_EQ(tandem_client_open(&settings, &first), TANDEM_OK) << tandem_last_error();
  EXPECT_EQ(tandem_client_open(&settings, &second), TANDEM_BAD_STATE);
  ASSERT_EQ(tandem_client_close(first), TANDEM_OK);
  ASSERT_EQ(tandem_client_open(&settings, &second), TANDEM_OK) << tandem_last_error();
  settings.own_device = second;
  EXPECT_EQ(tandem_client_open(&settings, &first), TANDEM_BAD_HANDLE) << "a client is no device";
  ASSERT_EQ(tandem_device_close(device), TANDEM_OK);
  auto force = sized<tandem_force>();
  force.on_hand_D.force_n[0] = 1;
  EXPECT_EQ(tandem_device_force(device, &force), TANDEM_BAD_HANDLE);
  EXPECT_EQ(force.on_hand_D.force_n[0], 0);
  EXPECT_EQ(tandem_client_close(second), TANDEM_OK);
}

// The layout of version 0 of the interface. It is frozen, because compiled programs use it. Fields may be added at the
// end of a struct, without padding before them.
#define EXPECT_LAYOUT(type, last_field, offset_of_last, size)         \
  EXPECT_EQ(offsetof(type, last_field), std::size_t{offset_of_last}); \
  EXPECT_GE(sizeof(type), std::size_t{size});                         \
  EXPECT_EQ(sizeof(type) % 8, 0U)

TEST(Abi, StructsKeepTheirLayout) {
  EXPECT_LAYOUT(tandem_device_settings, damping_maximum_n_s_per_m, 136, 144);
  EXPECT_LAYOUT(tandem_sample, velocity_D, 72, 120);
  EXPECT_LAYOUT(tandem_force, commands, 56, 64);
  EXPECT_LAYOUT(tandem_client_settings, has_no_cache, 132, 136);
  EXPECT_LAYOUT(tandem_session, note, 704, 1216);
  EXPECT_LAYOUT(tandem_tick, on_hand_D, 320, 368);
  EXPECT_LAYOUT(tandem_snapshot, field_energy_kj_per_mol, 32, 40);
  EXPECT_LAYOUT(tandem_body, name, 120, 192);
  EXPECT_LAYOUT(tandem_user, name, 72, 144);
  EXPECT_LAYOUT(tandem_event, reserved, 36, 40);
}

/// Settings of an older header, in which uses_tcp is the last field.
struct OlderClientSettings {
  std::uint32_t struct_size, role;
  const char *server, *room, *user_name, *invitation, *pin, *authorities, *token;
  std::uint32_t is_insecure, uses_tcp;
};
/// Tick struct of an older header.
struct OlderTick {
  std::uint32_t struct_size, safety;
  std::uint64_t number;
};
/// Structs of a newer header, with an additional field.
struct NewerClientSettings {
  tandem_client_settings known;
  std::uint64_t added;
};
struct NewerTick {
  tandem_tick known;
  double added[3];
};

TEST(Abi, ProgramBuiltWithAnOlderHeaderRuns) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  OlderClientSettings settings{};
  settings.struct_size = sizeof settings;
  settings.server = address.c_str();
  settings.is_insecure = 1;
  tandem_client client = 0;
  ASSERT_EQ(tandem_client_open(reinterpret_cast<const tandem_client_settings*>(&settings), &client), TANDEM_OK)
      << tandem_last_error();
  ASSERT_EQ(tandem_client_join(client), TANDEM_OK);
  ASSERT_EQ(tandem_client_wait_joined(client, 20), TANDEM_OK) << tandem_last_error();
  ASSERT_EQ(tandem_client_start(client), TANDEM_OK);
  std::array<OlderTick, 5> ticks{};
  ticks[0].struct_size = sizeof(OlderTick);
  ticks[4].number = 4711;
  std::uint32_t count = 0;
  ASSERT_TRUE(eventually([&] {
    return tandem_client_read_ticks(client, reinterpret_cast<tandem_tick*>(ticks.data()), 4, &count) == TANDEM_OK &&
           count == 4;
  }));
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(ticks[i].struct_size, sizeof(OlderTick));
    EXPECT_EQ(ticks[i].number, ticks[0].number + i);
  }
  EXPECT_EQ(ticks[4].number, 4711U) << "nothing is written beyond the caller's structs";
  EXPECT_EQ(tandem_client_close(client), TANDEM_OK);
}

TEST(Abi, ProgramBuiltWithANewerHeaderRunsUnlessItUsesANewSetting) {
  RunningServer server(kScene);
  const std::string address = address_of(server);
  NewerClientSettings settings{settings_for(address), 1};
  settings.known.struct_size = sizeof settings;
  tandem_client client = 0;
  EXPECT_EQ(tandem_client_open(&settings.known, &client), TANDEM_BAD_ARGUMENT);
  EXPECT_NE(std::string(tandem_last_error()).find("version"), std::string::npos);
  settings.added = 0;
  ASSERT_EQ(tandem_client_open(&settings.known, &client), TANDEM_OK) << tandem_last_error();
  ASSERT_EQ(tandem_client_join(client), TANDEM_OK);
  ASSERT_EQ(tandem_client_wait_joined(client, 20), TANDEM_OK) << tandem_last_error();
  ASSERT_EQ(tandem_client_start(client), TANDEM_OK);
  NewerTick tick{};
  tick.known.struct_size = sizeof tick;
  tick.added[2] = 7;
  ASSERT_TRUE(eventually([&] { return tandem_client_snapshot(client, nullptr, &tick.known) == TANDEM_OK; }));
  EXPECT_EQ(tick.known.struct_size, sizeof tick);
  EXPECT_GT(tick.known.number, 0U);
  EXPECT_EQ(tick.added[2], 0);
  EXPECT_EQ(tandem_client_close(client), TANDEM_OK);
}

/// Random calls of one thread. The handles may be closed by other threads, or be of another kind; pointers may be null
/// and sizes wrong.
class RandomCalls {
 public:
  static constexpr std::size_t kHandles = 4;
  using Handles = std::array<std::atomic<std::uint64_t>, kHandles>;

  RandomCalls(std::uint64_t seed, std::string address, Handles& clients, Handles& devices)
      : random_(seed), address_(std::move(address)), clients_(clients), devices_(devices) {}

  void run(int calls) {
    for (int i = 0; i < calls; ++i) {
      const tandem_status status = call();
      ASSERT_GE(status, TANDEM_FAULT + 1) << "an error of the library: " << tandem_last_error();
      ASSERT_LE(status, TANDEM_EMPTY);
    }
  }

 private:
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  std::uint64_t handle(Handles& handles) {
    switch (below(12)) {
      case 0:
        return random_();
      case 1:
        return 0;
      case 2:
        return devices_[below(kHandles)];
      case 3:
        return handles[below(kHandles)] ^ (std::uint64_t{1} << below(64));
      default:
        return handles[below(kHandles)];
    }
  }
  std::uint32_t size(std::size_t usual) {
    switch (below(12)) {
      case 0:
        return static_cast<std::uint32_t>(random_());
      case 1:
        return 0;
      case 2:
        return below(static_cast<std::uint32_t>(usual));
      default:
        return static_cast<std::uint32_t>(usual);
    }
  }
  double number() {
    switch (below(6)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return -1e300;
      default:
        return 1e-3 * (below(2000) - 1000.0);
    }
  }
  const char* text() {
    static constexpr std::array<const char*, 7> kTexts{nullptr, "",         "late-pose",   "coupling.stiffness_n_per_m",
                                                       "hold",  "\xff\xfe", "no such name"};
    return kTexts[below(kTexts.size())];
  }
  /// Returns a struct in a buffer of the claimed size, or of 64 KiB if the claimed size is too large.
  template <class Struct>
  Struct* result() {
    if (below(20) == 0) return nullptr;
    const std::uint32_t claimed = size(sizeof(Struct));
    buffer_.assign(std::max<std::size_t>(std::min<std::uint32_t>(claimed, 65536), sizeof(Struct)), 0);
    std::memcpy(buffer_.data(), &claimed, sizeof claimed);
    return reinterpret_cast<Struct*>(buffer_.data());
  }
  template <class Struct, class Function>
  tandem_status read_array(Function function) {
    Struct* const to = result<Struct>();
    std::uint32_t claimed = 0;
    if (to != nullptr) std::memcpy(&claimed, to, sizeof claimed);
    const std::uint32_t capacity = below(4);
    if (to != nullptr && claimed <= 65536) {
      buffer_.resize(std::max<std::size_t>(buffer_.size(), std::size_t{claimed} * 4));
      return function(reinterpret_cast<Struct*>(buffer_.data()), capacity);
    }
    return function(to, capacity);
  }

  tandem_status open_client() {
    auto settings = settings_for(address_);
    settings.struct_size = size(sizeof settings);
    if (settings.struct_size > sizeof settings) settings.struct_size = 0;
    settings.role = below(5);
    settings.stage = below(3) == 0 ? text() : "late-pose";
    settings.own_device = below(2) == 0 ? handle(devices_) : 0;
    settings.has_simulated_link = below(2);
    tandem_client made = 0;
    const tandem_status status = tandem_client_open(&settings, below(20) == 0 ? nullptr : &made);
    if (made != 0) tandem_client_close(clients_[below(kHandles)].exchange(made));
    return status;
  }
  tandem_status open_device() {
    auto settings = sized<tandem_device_settings>();
    settings.abilities = below(9);
    settings.force_limit_n = below(3) == 0 ? number() : 0;
    tandem_device made = 0;
    const tandem_status status = tandem_device_open(&settings, &made);
    if (made != 0) tandem_device_close(devices_[below(kHandles)].exchange(made));
    return status;
  }
  tandem_status feed() {
    auto sample = sized<tandem_sample>();
    sample.struct_size = size(sizeof sample);
    if (sample.struct_size > sizeof sample) sample.struct_size = 7;
    sample.buttons = below(4);
    sample.has_velocity = below(2);
    for (double& each : sample.handle_D.position_m) each = below(4) == 0 ? number() : 0;
    if (below(4) == 0) sample.handle_D.rotation_wxyz[below(4)] = number();
    return tandem_device_feed(handle(devices_), below(20) == 0 ? nullptr : &sample);
  }

  tandem_status call() {
    const tandem_client client = handle(clients_);
    std::uint32_t count = 0;
    switch (below(400)) {
      case 0:
      case 1:
      case 2:
        return open_client();
      case 3:
        return tandem_client_close(client);
      case 4:
        return tandem_client_stop(client);
      case 5:
        return tandem_device_close(handle(devices_));
      case 6:
      case 7:
        return open_device();
      default:
        break;
    }
    char small[16];
    int descriptor = 0;
    const double place[3] = {number(), number(), number()};
    switch (below(24)) {
      case 0:
        return tandem_client_join(client);
      case 1:
        return tandem_client_start(client);
      case 2:
        return tandem_client_wait_joined(client, below(2) == 0 ? 0.002 : number() * 1e-3);
      case 3:
        return tandem_client_session(client, result<tandem_session>());
      case 4:
        return tandem_client_snapshot(client, result<tandem_snapshot>(), nullptr);
      case 5:
        return tandem_client_snapshot(client, nullptr, result<tandem_tick>());
      case 6:
        return read_array<tandem_body>([&](auto* to, auto n) { return tandem_client_bodies(client, to, n, &count); });
      case 7:
        return read_array<tandem_user>([&](auto* to, auto n) { return tandem_client_users(client, to, n, &count); });
      case 8:
        return read_array<tandem_tick>(
            [&](auto* to, auto n) { return tandem_client_read_ticks(client, to, n, &count); });
      case 9:
        return tandem_client_next_event(client, result<tandem_event>(), below(8) == 0 ? nullptr : small,
                                        below(sizeof small + 1));
      case 10:
        return tandem_client_wait_event(client, below(2) == 0 ? 0.001 : -1);
      case 11:
        return tandem_client_event_descriptor(client, below(8) == 0 ? nullptr : &descriptor);
      case 12:
        return tandem_client_grab(client, below(3));
      case 13:
        return tandem_client_release(client);
      case 14:
        return tandem_client_point(client, below(3), below(8) == 0 ? nullptr : place);
      case 15:
        return tandem_client_set_parameter(client, text(), number());
      case 16:
        return tandem_client_set_law(client, text());
      case 17:
        return tandem_client_set_stage(client, text(), text(), below(2));
      case 18:
        return tandem_client_set_link(client, number(), number(), number());
      case 19:
        return below(2) == 0 ? tandem_client_reset_room(client) : tandem_client_set_nudges(client, below(2));
      case 20:
        return tandem_client_set_workspace(client, number(), number());
      case 21:
        return tandem_client_request_pose(client, below(10), below(3), text(), below(2));
      case 22:
        return tandem_device_force(handle(devices_), result<tandem_force>());
      default:
        return feed();
    }
  }

  std::mt19937_64 random_;
  std::string address_;
  Handles& clients_;
  Handles& devices_;
  std::vector<unsigned char> buffer_;
};

TEST(Abi, RandomCallsFromSeveralThreadsGiveAStatusAndNoCrash) {
  const std::uint64_t seed = tandem::test::test_seed(1);
  const char* const given = std::getenv("TANDEM_ABI_CALLS");
  const int calls = given != nullptr ? std::stoi(given) : 3000;
  RunningServer server(kScene);
  const std::string address = address_of(server);
  RandomCalls::Handles clients{}, devices{};
  std::vector<std::thread> threads;
  for (std::uint64_t i = 0; i < 3; ++i) {
    threads.emplace_back([&, i] { RandomCalls(seed * 1000 + i, address, clients, devices).run(calls); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& client : clients) tandem_client_close(client);
  for (const auto& device : devices) tandem_device_close(device);
  // After the random calls, the library must still be usable.
  Running running(settings_for(address));
  EXPECT_TRUE(eventually([&] { return running.body().id == 1; }));
}

TEST(HandleTable, HandlesAreNeverReusedAndBelongToOneTable) {
  tandem::client::embed::HandleTable<int> numbers(1), others(2);
  const auto object = std::make_shared<int>(5);
  const std::uint64_t first = numbers.add(object);
  EXPECT_EQ(numbers.find(first), object);
  EXPECT_EQ(others.find(first), nullptr);
  EXPECT_EQ(numbers.remove(first), object);
  EXPECT_EQ(numbers.find(first), nullptr);
  EXPECT_EQ(numbers.remove(first), nullptr);
  std::uint64_t last = 0;
  for (int i = 0; i < 300; ++i) {
    const std::uint64_t handle = numbers.add(object);
    EXPECT_EQ(handle != 0, i < 256);
    EXPECT_NE(handle, first);
    if (handle != 0) last = handle;
  }
  EXPECT_EQ(numbers.find(last), object);
  EXPECT_EQ(numbers.remove_all().size(), 256U);
  EXPECT_EQ(numbers.find(last), nullptr);
}

}  // namespace
