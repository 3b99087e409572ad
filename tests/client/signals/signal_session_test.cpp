// Tests a program that sends signals to a room: the messages that it sends, its behaviour after a loss of the
// connection, and the parser of its input lines.
#include "client/signals/signal_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "client/signals/signal_line.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct SignalBench {
  explicit SignalBench(const SignalSessionSettings& settings = {}) : session(settings, transport) {
    session.on_log = [this](const std::string& line) { log.push_back(line); };
    session.start(now);
  }
  void receive(const wire::ServerControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    session.on_control_bytes(frame, now);
  }
  void greet() {
    session.on_connected(now);
    wire::ServerControl welcome;
    welcome.mutable_welcome()->set_protocol_version(proto::kProtocolVersion);
    welcome.mutable_welcome()->set_connection_id(5);
    receive(welcome);
  }
  void join() {
    greet();
    wire::ServerControl joined;
    joined.mutable_joined()->set_user(1);
    joined.mutable_joined()->add_signals("valence");
    receive(joined);
  }
  void wait(Duration time) {
    now += time;
    session.poll(now);
  }
  /// Returns the signals sent since the last call.
  std::vector<wire::Signal> sent() {
    std::vector<wire::Signal> signals;
    for (const wire::ClientControl& message : transport.messages) {
      if (message.has_signal()) signals.push_back(message.signal());
    }
    transport.messages.clear();
    return signals;
  }

  test::RecordingClientTransport transport;
  LocalTime now{std::chrono::seconds(10)};
  SignalSession session;
  std::vector<std::string> log;
};

TEST(SignalSession, JoinsInItsRoleAndSendsTheNewestValueWithItsAge) {
  SignalBench bench;
  bench.session.set({"valence", 0.1, 1, bench.now});
  bench.session.set({"valence", 0.2, 0.7, bench.now});
  bench.wait(std::chrono::milliseconds(300));
  bench.join();
  EXPECT_EQ(bench.session.status().state, SessionState::kActive);
  EXPECT_THAT(bench.session.names(), ElementsAre("valence"));
  const wire::ClientControl& join = bench.transport.messages.at(1);
  EXPECT_EQ(join.join().role(), wire::ROLE_SIGNAL);
  bench.wait(std::chrono::milliseconds(200));
  const std::vector<wire::Signal> sent = bench.sent();
  ASSERT_EQ(sent.size(), 1U) << "a newer value replaces one that waits";
  EXPECT_EQ(sent[0].value(), 0.2);
  EXPECT_EQ(sent[0].confidence(), 0.7);
  EXPECT_NEAR(sent[0].age_s(), 0.5, 1e-9);
  EXPECT_EQ(bench.session.waiting(), 0U);
}

TEST(SignalSession, StaysBelowTheRateOfTheServer) {
  SignalBench bench;
  bench.join();
  std::size_t count = 0;
  for (int i = 0; i < 2000; ++i) {
    bench.session.set({"valence", static_cast<double>(i), 1, bench.now});
    wire::ServerControl pong;
    pong.mutable_pong();
    bench.receive(pong);
    bench.wait(std::chrono::milliseconds(1));
    count += bench.sent().size();
  }
  EXPECT_LE(count, 40U + 2 * 40U + 1U);
  EXPECT_GE(count, 110U);
  bench.transport.queued = 1;
  bench.session.set({"valence", 7, 1, bench.now});
  bench.wait(std::chrono::milliseconds(100));
  EXPECT_TRUE(bench.sent().empty()) << "no old values queue";
}

TEST(SignalSession, KeepsItsConnectionAliveAndRestoresALostOne) {
  SignalBench bench;
  bench.join();
  bench.transport.messages.clear();
  bench.wait(std::chrono::milliseconds(500));
  ASSERT_EQ(bench.transport.messages.size(), 1U);
  EXPECT_TRUE(bench.transport.messages[0].has_ping());
  bench.session.on_disconnected(bench.now, "cut");
  EXPECT_EQ(bench.session.status().state, SessionState::kWaiting);
  bench.wait(std::chrono::milliseconds(260));
  EXPECT_EQ(bench.transport.connects, 2);
  bench.join();
  EXPECT_EQ(bench.session.status().state, SessionState::kActive);
  for (int i = 0; i < 3; ++i) bench.wait(std::chrono::milliseconds(500));
  EXPECT_EQ(bench.session.status().state, SessionState::kWaiting) << "the server is silent";
}

TEST(SignalSession, APongConfirmsTheValuesSentBeforeItsPing) {
  SignalBench bench;
  bench.join();
  bench.session.hasten_confirmation();
  bench.session.set({"valence", 0.5, 1, bench.now});
  bench.wait(std::chrono::milliseconds(5));
  ASSERT_EQ(bench.transport.messages.size(), 4U) << "hello, join, signal, ping";
  ASSERT_TRUE(bench.transport.messages.back().has_ping());
  EXPECT_EQ(bench.session.unconfirmed(), 1U);
  wire::ServerControl pong;
  pong.mutable_pong()->set_token(~std::uint64_t{0});
  bench.receive(pong);
  EXPECT_EQ(bench.session.unconfirmed(), 1U) << "no such ping was sent";
  bench.session.set({"pulse", 70, 1, bench.now});
  bench.wait(std::chrono::milliseconds(5));
  pong.mutable_pong()->set_token(1);
  bench.receive(pong);
  EXPECT_EQ(bench.session.unconfirmed(), 1U) << "the second value was sent after the first ping";
  pong.mutable_pong()->set_token(2);
  bench.receive(pong);
  EXPECT_EQ(bench.session.unconfirmed(), 0U);
}

TEST(SignalSession, AValueWithoutConfirmationIsSentAgainAfterALoss) {
  SignalBench bench;
  bench.join();
  for (const char* name : {"old", "valence"}) bench.session.set({name, 0.5, 1, bench.now});
  bench.wait(std::chrono::milliseconds(5));
  EXPECT_EQ(bench.sent().size(), 2U);
  bench.session.set({"valence", 0.75, 1, bench.now});
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(260));
  bench.join();
  bench.wait(std::chrono::milliseconds(5));
  const std::vector<wire::Signal> sent = bench.sent();
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_EQ(sent[0].value(), 0.5);
  EXPECT_NEAR(sent[0].age_s(), 0.27, 1e-9);
  EXPECT_EQ(sent[1].value(), 0.75) << "the newer value of its name";
}

TEST(SignalSession, AFinalLossIsReported) {
  SignalBench bench;
  bench.join();
  wire::ServerControl goodbye;
  goodbye.mutable_goodbye()->set_reason(wire::DISCONNECT_RESUMED);
  goodbye.mutable_goodbye()->set_text("another program uses the token");
  bench.receive(goodbye);
  EXPECT_EQ(bench.session.status().state, SessionState::kEnded);
  EXPECT_THAT(bench.log, ElementsAre(HasSubstr("another program uses the token; no more values are sent")));
}

TEST(SignalSession, AFirstRefusalIsASetUpErrorAndALaterOneIsReported) {
  SignalBench refused;
  refused.greet();
  wire::ServerControl error;
  error.mutable_error()->set_code(wire::ERROR_NOT_ALLOWED);
  error.mutable_error()->set_text("room x has no game with signals");
  refused.receive(error);
  EXPECT_EQ(refused.session.status().state, SessionState::kEnded);
  EXPECT_TRUE(refused.session.status().is_setup_error);
  EXPECT_THAT(refused.session.status().why, HasSubstr("no game with signals"));

  SignalBench joined;
  joined.join();
  joined.receive(error);
  EXPECT_EQ(joined.session.status().state, SessionState::kActive);
  EXPECT_EQ(joined.session.refused(), 1U);
  EXPECT_THAT(joined.log, ElementsAre(HasSubstr("refused: room x")));
}

TEST(SignalSession, HostileBytesEndTheConnectionAndNothingElse) {
  SignalBench bench;
  bench.join();
  bench.session.on_control_bytes(proto::Bytes(8, std::byte{0xFF}), bench.now);
  EXPECT_EQ(bench.session.status().state, SessionState::kWaiting);
  SignalBench many;
  many.greet();
  wire::ServerControl joined;
  for (int i = 0; i < 1000; ++i) joined.mutable_joined()->add_signals("s\n" + std::to_string(i));
  many.receive(joined);
  EXPECT_EQ(many.session.names().size(), SignalSession::kMaxNames);
  EXPECT_EQ(many.session.names()[0], "s?0");
}

TEST(SignalSession, AsManyNamesWaitAsItsLimitAllows) {
  SignalBench bench;
  for (std::size_t i = 0; i < SignalSession::kMaxNames; ++i) {
    EXPECT_TRUE(bench.session.set({"s" + std::to_string(i), 0, 1, bench.now}));
  }
  EXPECT_FALSE(bench.session.set({"more", 0, 1, bench.now}));
  EXPECT_TRUE(bench.session.set({"s0", 1, 1, bench.now}));
}

TEST(SignalSession, ProblemsNameTheNumberAndItsLimits) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(problem_of({"heart-rate_1.a", 60, 0.5}), "");
  EXPECT_THAT(problem_of({"Heart", 60, 1}), HasSubstr("a-z"));
  EXPECT_THAT(problem_of({"", 60, 1}), HasSubstr("1 to 32"));
  EXPECT_THAT(problem_of({std::string(33, 'a'), 60, 1}), HasSubstr("1 to 32"));
  EXPECT_THAT(problem_of({"a", nan, 1}), HasSubstr("-1e6 to 1e6"));
  EXPECT_THAT(problem_of({"a", 2e6, 1}), HasSubstr("-1e6 to 1e6"));
  EXPECT_THAT(problem_of({"a", 0, 1.5}), HasSubstr("0 to 1"));
  EXPECT_THAT(problem_of({"a", 0, nan}), HasSubstr("0 to 1"));
}

TEST(SignalLine, HasNameValueConfidenceAndAge) {
  const SignalLine line = parse_signal_line("  valence\t-0.25 0.8  1.5\r");
  EXPECT_EQ(line.signal.name, "valence");
  EXPECT_EQ(line.signal.value, -0.25);
  EXPECT_EQ(line.signal.confidence, 0.8);
  EXPECT_EQ(line.age, std::chrono::milliseconds(1500));
  EXPECT_EQ(parse_signal_line("a 1").signal.confidence, 1);
  for (const char* wrong :
       {"a", "a 1 1 1 1", "a x", "a 1x", "a 1 2", "a 1 1 -1", "a 1 1 601", "a nan", "a 1e99", "A 1"}) {
    EXPECT_THROW(parse_signal_line(wrong), std::invalid_argument) << wrong;
  }
}

}  // namespace
}  // namespace tandem::client
