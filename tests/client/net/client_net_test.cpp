#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <fstream>
#include <future>
#include <mutex>

#include "client/net/client_io.hpp"
#include "client/net/event_queue.hpp"
#include "server/app/security.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/running_server.hpp"

namespace tandem::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ClientIoSettings settings_for(std::uint16_t port) {
  ClientIoSettings settings;
  settings.port = port;
  settings.client.session.user_name = "ada";
  settings.client.session.reconnect_delay = std::chrono::milliseconds(20);
  return settings;
}

std::function<bool()> is_in(const ClientIo& io, SessionState state) {
  return [&io, state] { return io.snapshot().status.state == state; };
}

std::function<bool()> has_received(const ClientIo& io, std::uint64_t datagrams) {
  return [&io, datagrams] { return io.snapshot().counters.datagrams_received >= datagrams; };
}

/// Returns a port on which no server listens: the former port of a server that has just ended.
std::uint16_t unused_port() {
  return server::LiveServer({.port = 0}, {}).port();
}

TEST(ClientIo, JoinsAndGetsStateUntilItLeaves) {
  test::RunningServer running(test::two_hands_scene());
  ScriptedDevice device;
  ClientIo io(settings_for(running.server->port()), device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kActive))) << io.snapshot().status.why;
  EXPECT_EQ(io.snapshot().joined->scene().name(), "bench");
  ASSERT_TRUE(test::eventually(has_received(io, 100)));
  EXPECT_TRUE(test::eventually([&io] { return io.snapshot().clock.is_known; }));
  io.stop();
  EXPECT_EQ(io.snapshot().status.state, SessionState::kEnded);
  EXPECT_TRUE(test::eventually([&running] { return running.has_logged("left on request"); }));
}

TEST(ClientIo, WhereTheHapticThreadHasTheHandleTheToolFollows) {
  test::RunningServer running(test::two_hands_scene());
  ScriptedDevice device;
  ClientIo io(settings_for(running.server->port()), device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kActive)));
  const bool has_arrived = test::eventually([&] {
    device.sample.X_DH.p = Vec3(0, 0.03, 0);
    io.haptics().tick(SteadyClock().now());
    io.notify();
    const TickRecord& record = io.haptics().record();
    return record.newest_step.value != 0 && (record.tool_W.X.p - record.handle_W.X.p).norm() < 1e-3 &&
           record.handle_W.X.p.y() > 0;
  });
  EXPECT_TRUE(has_arrived);
}

TEST(ClientIo, AnEventComesWhenTheSnapshotHasTheEffectOfWhatCameBefore) {
  test::RunningServer running(test::two_hands_scene());
  ScriptedDevice device;
  ClientIo io(settings_for(running.server->port()), device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kActive)));
  io.send(command::SetNudges{false});
  io.send(pose_command(wire::AskPose::KEEP, 0, {}, 77));
  std::string error;
  bool had_effect = false;
  ASSERT_TRUE(test::eventually([&] {
    while (const std::optional<Event> event = io.next()) {
      const auto* const answer = std::get_if<event::PoseAnswered>(&*event);
      if (answer == nullptr) continue;
      EXPECT_EQ(answer->tag, 77U);
      error = answer->answer.error().text();
      had_effect = !io.snapshot().has_nudges;
    }
    return !error.empty();
  }));
  EXPECT_THAT(error, HasSubstr("there are none here"));
  EXPECT_TRUE(had_effect) << "though a snapshot may be 10 ms old";
}

TEST(ClientIo, UnreadEventsAreCounted) {
  ClientIoSettings settings = settings_for(unused_port());
  ScriptedDevice device;
  ClientIo io(settings, device);
  // A client that is in no room refuses each tagged request at once, with one event. The events exceed the capacity of
  // the queue by 100.
  constexpr std::size_t kRequests = EventQueue::kCapacity + 100;
  for (std::size_t i = 0; i < kRequests; ++i) io.send(pose_command(wire::AskPose::KEEP, 0, {}, 5));
  EXPECT_EQ(io.snapshot().events_dropped, 0U);
  io.start();
  ASSERT_TRUE(test::eventually([&io] { return io.snapshot().events_dropped >= 100; }));
  io.stop();
  std::size_t read = 0;
  while (io.next()) ++read;
  EXPECT_EQ(read, EventQueue::kCapacity);
}

TEST(ClientIo, StateIsSentOverTcpWhenRequested) {
  test::RunningServer running(test::two_hands_scene());
  ClientIoSettings settings = settings_for(running.server->port());
  settings.client.session.state_over_tcp = true;
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  EXPECT_TRUE(test::eventually(has_received(io, 100)));
}

/// An encrypted server, and settings for its clients.
struct EncryptedServer {
  explicit EncryptedServer(const std::string& bind_address = "127.0.0.1", std::uint16_t port = 0,
                           const std::string& folder = "client_net_state")
      : options{
            .state = std::filesystem::path(testing::TempDir()) / folder, .certificate = {}, .key = {}, .issuers = {}} {
    server::LiveServerSettings settings{.bind_address = bind_address, .port = port};
    settings.tls = server::tls_of(keys);
    settings.hub.admission = server::admission_of(keys, options);
    running = std::make_unique<test::RunningServer>(test::two_hands_scene(), settings);
  }
  ClientIoSettings client(const std::string& role = "manipulator") const {
    ClientIoSettings settings = settings_for(running->server->port());
    settings.trust = secure::Trust{.pin = keys.identity.id()};
    settings.client.session.token = server::token_for({.role = role}, keys.identity.id(), keys.issuer);
    if (role == "operator") settings.client.session.role = wire::ROLE_OPERATOR;
    return settings;
  }

  const server::SecurityOptions options;
  const server::ServerKeys keys = server::open_keys(options);
  std::unique_ptr<test::RunningServer> running;
};

TEST(ClientIo, AnEncryptedSessionGetsStateUntilItsUserIsKickedAndThenStaysOut) {
  EncryptedServer server;
  ScriptedDevice device, other_device;
  ClientIo olga(server.client("operator"), other_device), ada(server.client(), device);
  olga.start();
  ada.start();
  ASSERT_TRUE(test::eventually(has_received(ada, 100))) << ada.snapshot().status.why;
  ASSERT_TRUE(test::eventually(has_received(olga, 100))) << olga.snapshot().status.why;
  olga.send(command::Kick{UserId{ada.snapshot().joined->user()}});
  ASSERT_TRUE(test::eventually(is_in(ada, SessionState::kEnded)));
  EXPECT_THAT(ada.snapshot().status.why, HasSubstr("kicked"));
  EXPECT_EQ(olga.snapshot().status.state, SessionState::kActive);
}

TEST(ClientIo, AnEncryptedSessionOverTcpAndThroughASimulatedLinkIsTheSame) {
  EncryptedServer server;
  ClientIoSettings settings = server.client();
  settings.client.session.state_over_tcp = true;
  settings.links.emplace();
  settings.links->up.delay = settings.links->down.delay = std::chrono::milliseconds(5);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  EXPECT_TRUE(test::eventually(has_received(io, 100))) << io.snapshot().status.why;
}

TEST(ClientIo, ReportsThatNoServerListensAtTheAddress) {
  const std::uint16_t port = unused_port();
  ScriptedDevice device;
  ClientIo io(settings_for(port), device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kEnded)));
  EXPECT_TRUE(io.snapshot().status.is_setup_error);
  EXPECT_EQ(io.snapshot().status.why, "cannot connect to 127.0.0.1:" + std::to_string(port) +
                                          ": connection refused; is tandem-server running there?");
}

TEST(ClientIo, RefusesAddressesAndLinksThatCannotWork) {
  ScriptedDevice device;
  for (const char* host : {"192.0.2.1", "example.org", ""}) {
    ClientIoSettings settings;
    settings.host = host;
    EXPECT_THROW(ClientIo(settings, device), std::invalid_argument) << host;
  }
  ClientIoSettings settings;
  settings.links.emplace();
  settings.links->down.loss = 2;
  try {
    ClientIo io(settings, device);
    FAIL() << "a loss of 2 was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("down"), HasSubstr("loss is 2")));
  }
}

TEST(ClientIo, ChangesItsSimulatedLinkAtOnce) {
  test::RunningServer running(test::two_hands_scene());
  ClientIoSettings settings = settings_for(running.server->port());
  settings.links.emplace();
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually([&io] { return io.snapshot().clock.is_known; }));
  net::LinkParameters link;
  link.loss = 2;
  EXPECT_THROW(io.send(command::SetLinks{link}), std::invalid_argument);
  link.loss = 0;
  link.delay = std::chrono::milliseconds(60);
  io.send(command::SetLinks{link});
  EXPECT_TRUE(test::eventually([&io] { return io.snapshot().clock.round_trip >= std::chrono::milliseconds(120); }));
  EXPECT_EQ(io.snapshot().status.state, SessionState::kActive);
}

TEST(ClientIo, AnUnknownRoomEndsWithTheServersWords) {
  test::RunningServer running(test::two_hands_scene());
  ClientIoSettings settings = settings_for(running.server->port());
  settings.client.session.room = "attic";
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kEnded)));
  EXPECT_TRUE(io.snapshot().status.is_setup_error);
  EXPECT_THAT(io.snapshot().status.why, AllOf(HasSubstr("attic"), HasSubstr("bench")));
}

TEST(ClientIo, RejoinsAServerThatWasKilledAndCameBackOnItsPort) {
  auto running = std::make_unique<test::RunningServer>(test::two_hands_scene());
  const std::uint16_t port = running->server->port();
  ScriptedDevice device;
  ClientIo io(settings_for(port), device);
  io.start();
  ASSERT_TRUE(test::eventually(has_received(io, 10)));
  running->kill();
  ASSERT_TRUE(test::eventually([&io] { return !io.snapshot().status.why.empty(); }));
  EXPECT_THAT(io.snapshot().status.why, HasSubstr("127.0.0.1:" + std::to_string(port)));
  EXPECT_FALSE(io.snapshot().status.is_setup_error);
  running = std::make_unique<test::RunningServer>(test::two_hands_scene(), server::LiveServerSettings{.port = port});
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kActive)));
  EXPECT_GE(io.snapshot().counters.reconnects, 1U) << "more on a slow machine";
  const std::uint64_t before = io.snapshot().counters.datagrams_received;
  EXPECT_TRUE(test::eventually(has_received(io, before + 50)));
  EXPECT_EQ(io.snapshot().status.why, "");
}

TEST(ClientIo, StateOverTcpIsCountedOnTheControlLinksAndTheOnlyRoomIsNamed) {
  test::RunningServer running(test::two_hands_scene());
  ClientIoSettings settings = settings_for(running.server->port());
  settings.client.session.room = "";
  settings.client.session.state_over_tcp = true;
  settings.links.emplace();
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(has_received(io, 100))) << io.snapshot().status.why;
  const ClientIoSnapshot snapshot = io.snapshot();
  EXPECT_EQ(snapshot.room, "bench");
  EXPECT_EQ(snapshot.links.down.sent, 0U);
  EXPECT_GT(snapshot.links.control_down.delivered, 0U);
  EXPECT_GT(snapshot.links.control_up.delivered, 0U);
}

TEST(ClientIo, SimulatedLinksDelayBothDirectionsAndLoseTheSetFraction) {
  test::RunningServer running(test::two_hands_scene());
  ClientIoSettings settings = settings_for(running.server->port());
  settings.links.emplace();
  settings.links->up.delay = settings.links->down.delay = std::chrono::milliseconds(15);
  settings.links->down.loss = 0.3;
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(has_received(io, 300))) << io.snapshot().status.why;
  const ClientIoSnapshot snapshot = io.snapshot();
  ASSERT_TRUE(snapshot.clock.is_known);
  // Lower limit: 0.1 ms below the true round trip of 30 ms. The kernel stamps datagrams by another clock than the
  // steady clock, and reading both clocks takes microseconds.
  EXPECT_GE(snapshot.clock.minimum_round_trip, Duration(std::chrono::microseconds(29'900)));
  EXPECT_GT(snapshot.links.down.lost, 0U);
  EXPECT_EQ(snapshot.counters.received_drops.count(proto::DropReason::kSimulatedLoss), snapshot.links.down.lost);
  EXPECT_GT(snapshot.links.up.delivered, 0U);
  io.stop();
  EXPECT_TRUE(test::eventually([&running] { return running.has_logged("left on request"); }))
      << "the leave went through the link before the end";
}

/// A resolver that returns fixed addresses. It can also block, like one whose name server does not respond.
struct TestResolver {
  explicit TestResolver(std::vector<std::string> addresses) {
    for (const std::string& text : addresses) all.push_back(boost::asio::ip::make_address(text));
  }
  Resolve function() {
    return [state = state, all = all](const std::string&, bool is_v6, std::string& problem) {
      std::unique_lock lock(state->mutex);
      ++state->calls;
      state->news.wait(lock, [&state] { return !state->hangs; });
      std::vector<net::Address> found;
      for (const net::Address& each : all) {
        if (each.is_v6() == is_v6) found.push_back(each);
      }
      if (found.empty()) problem = "host not found";
      return found;
    };
  }
  void hang(bool hangs) {
    const std::scoped_lock lock(state->mutex);
    state->hangs = hangs;
    state->news.notify_all();
  }
  int calls() {
    const std::scoped_lock lock(state->mutex);
    return state->calls;
  }

  struct State {
    std::mutex mutex;
    std::condition_variable news;
    bool hangs = false;
    int calls = 0;
  };
  std::vector<net::Address> all;
  std::shared_ptr<State> state = std::make_shared<State>();
};

/// Settings of a client that connects to `server` by host name.
ClientIoSettings by_name(EncryptedServer& server, TestResolver& resolver) {
  ClientIoSettings settings = server.client();
  settings.host = "rig.example";
  settings.resolve = resolver.function();
  return settings;
}

TEST(SeveralAddresses, TheOneThatAnswersIsUsedForStateToo) {
  EncryptedServer server;
  TestResolver resolver({"127.0.0.2", "127.0.0.3", "127.0.0.1"});
  ClientIoSettings settings = by_name(server, resolver);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  EXPECT_TRUE(test::eventually(has_received(io, 100))) << io.snapshot().status.why;
}

TEST(SeveralAddresses, AnotherServerAtOneOfThemDoesNotKeepTheRightOneFromBeingFound) {
  EncryptedServer server;
  EncryptedServer other("127.0.0.2", server.running->server->port(), "client_net_other_state");
  TestResolver resolver({"127.0.0.2", "127.0.0.1"});
  ClientIoSettings settings = by_name(server, resolver);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  EXPECT_TRUE(test::eventually(has_received(io, 100))) << io.snapshot().status.why;
  EXPECT_FALSE(other.running->has_logged("joined"));
}

TEST(SeveralAddresses, IfAllAddressesFailTheReasonOfEachIsReported) {
  EncryptedServer server;
  EncryptedServer other("127.0.0.2", server.running->server->port(), "client_net_other_state");
  TestResolver resolver({"127.0.0.2", "127.0.0.3"});
  ClientIoSettings settings = by_name(server, resolver);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kEnded)));
  EXPECT_TRUE(io.snapshot().status.is_setup_error);
  EXPECT_THAT(io.snapshot().status.why,
              AllOf(HasSubstr("cannot connect to rig.example:" + std::to_string(server.running->server->port())),
                    HasSubstr("127.0.0.2: "), HasSubstr("key"), HasSubstr("127.0.0.3: connection refused")));
}

TEST(SeveralAddresses, ANameThatIsNotFoundIsReported) {
  EncryptedServer server;
  TestResolver resolver(std::vector<std::string>{});
  ClientIoSettings settings = by_name(server, resolver);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(is_in(io, SessionState::kEnded)));
  EXPECT_THAT(io.snapshot().status.why,
              AllOf(HasSubstr("rig.example"), HasSubstr("host not found"), HasSubstr("is that the name")));
}

TEST(SeveralAddresses, ANameServerThatHangsHoldsUpNeitherTheIoThreadNorTheEnd) {
  EncryptedServer server;
  TestResolver resolver({"127.0.0.1"});
  resolver.hang(true);
  ClientIoSettings settings = by_name(server, resolver);
  settings.client.session.setup_timeout = std::chrono::milliseconds(200);
  ScriptedDevice device;
  {
    ClientIo io(settings, device);
    io.start();
    ASSERT_TRUE(test::eventually(is_in(io, SessionState::kEnded)));
    EXPECT_THAT(io.snapshot().status.why, AllOf(HasSubstr("200 ms"), HasSubstr("not answered yet")));
  }
  resolver.hang(false);
}

TEST(SeveralAddresses, ARejoinUsesTheRememberedAddressWhileTheNameServerHangs) {
  EncryptedServer server;
  TestResolver resolver({"127.0.0.1"});
  ClientIoSettings settings = by_name(server, resolver);
  settings.links.emplace();
  settings.client.session.silence_timeout = std::chrono::milliseconds(300);
  ScriptedDevice device;
  ClientIo io(settings, device);
  io.start();
  ASSERT_TRUE(test::eventually(has_received(io, 10))) << io.snapshot().status.why;
  resolver.hang(true);
  net::LinkParameters link;
  link.delay = std::chrono::seconds(2);
  io.send(command::SetLinks{link});
  ASSERT_TRUE(test::eventually([&io] { return io.snapshot().status.state != SessionState::kActive; }));
  io.send(command::SetLinks{});
  EXPECT_TRUE(test::eventually([&io] {
    return io.snapshot().counters.reconnects > 0 && io.snapshot().status.state == SessionState::kActive;
  })) << io.snapshot().status.why;
  EXPECT_LE(resolver.calls(), 4) << "one look-up of each family at a time, however often it reconnects";
  const std::uint64_t before = io.snapshot().counters.datagrams_received;
  EXPECT_TRUE(test::eventually(has_received(io, before + 20)));
  io.stop();
  resolver.hang(false);
}

TEST(Ipv6, AServerOfAllAddressesHasUsersOfBothFamilies) {
  TANDEM_NEEDS_OF_MACHINE(std::ifstream("/proc/net/if_inet6").good(), "IPv6");
  EncryptedServer server("::");
  for (const std::string host : {"::1", "127.0.0.1"}) {
    ClientIoSettings settings = server.client();
    settings.host = host;
    ScriptedDevice device;
    ClientIo io(settings, device);
    io.start();
    EXPECT_TRUE(test::eventually(has_received(io, 100))) << host << ": " << io.snapshot().status.why;
  }
}

TEST(Ipv6, LocalhostIsEitherFamilyOfThisMachine) {
  TANDEM_NEEDS_OF_MACHINE(std::ifstream("/proc/net/if_inet6").good(), "IPv6");
  for (const std::string bind : {"::1", "127.0.0.1"}) {
    test::RunningServer running(test::two_hands_scene(), server::LiveServerSettings{.bind_address = bind, .port = 0});
    ClientIoSettings settings = settings_for(running.server->port());
    settings.host = "localhost";
    ScriptedDevice device;
    ClientIo io(settings, device);
    io.start();
    EXPECT_TRUE(test::eventually(has_received(io, 100))) << bind << ": " << io.snapshot().status.why;
  }
}

}  // namespace
}  // namespace tandem::client
