// Compares the server's tables in proto/STATES.md with SessionHub: for each row, the event is produced and its result
// is checked.
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "tests/support/hub_bench.hpp"
#include "tests/support/markdown_table.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::server {
namespace {

const std::string kDocument = test::source_path("proto/STATES.md").string();

/// A bench with a client whose connection is in the given state.
struct Subject {
  explicit Subject(const std::string& state, const HubSettings& settings = {},
                   const std::string& scene = test::two_hands_scene())
      : bench(settings, {scene}) {
    client = bench.connect();
    if (state != "greeting") bench.greet(client);
    if (state == "active") {
      bench.send(client, test::HubBench::join_message("ada"));
      client.joined = bench.drain(client).at(0).joined();
    }
    if (state == "closed") bench.hub->on_disconnected(client.handle, bench.now);
  }
  std::string state() const { return std::string(name_of(bench.hub->state_of(client.handle))); }
  void send(const std::function<void(wire::ClientControl&)>& fill) {
    wire::ClientControl message;
    message.set_request(1);
    fill(message);
    bench.send(client, message);
  }

  test::HubBench bench;
  test::BenchClient client;
};

void fill_with(wire::ClientControl& message, const google::protobuf::FieldDescriptor& field) {
  if (field.name() == "state_datagram") {
    message.set_state_datagram("x");
  } else {
    message.GetReflection()->MutableMessage(&message, &field);
  }
}

/// Returns two_hands_scene() with a game that has a signal.
std::string scene_with_signal() {
  std::string scene = test::two_hands_scene();
  scene.insert(scene.rfind('}'), R"(, "game": {"signals": [{"name": "valence"}], "levels": [
      {"name": "a", "goals": [{"name": "g", "conditions": [{"held": {"body": "box"}}]}]}]})");
  return scene;
}

void send_signal(Subject& subject, const std::string& name) {
  subject.send([&name](auto& message) { message.mutable_signal()->set_name(name); });
}

void become_source(Subject& subject) {
  subject.client = subject.bench.join("eeg", wire::ROLE_SIGNAL);
}

void wait_out(Subject& subject) {
  for (int i = 0; i < 5000 && subject.state() != "closed"; ++i) {
    subject.bench.now += std::chrono::milliseconds(1);
    subject.bench.hub->poll(VirtualClock(subject.bench.now));
  }
}

void send_forbidden(Subject& subject) {
  // Messages that are forbidden in the state: a ping before the hello, and a second hello.
  if (subject.state() == "greeting") {
    subject.send([](auto& message) { message.mutable_ping(); });
  } else {
    subject.send([](auto& message) { message.mutable_hello()->set_protocol_version(proto::kProtocolVersion); });
  }
}

void join_room(Subject& subject, const std::string& name, wire::Role role, const std::string& room) {
  subject.bench.send(subject.client, test::HubBench::join_message(name, role, room));
}

void set_parameter(Subject& subject, const std::string& name, double value) {
  subject.send([&](auto& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
  });
}

void point_at(Subject& subject, std::uint32_t body) {
  subject.send([&](auto& message) {
    message.mutable_point()->set_body(body);
    for (const double number : {0.01, 0.02, -0.03}) {
      message.mutable_point()->add_place(number);
      message.mutable_point()->add_place_w(number);
    }
  });
}

using Event = std::function<void(Subject&)>;

std::map<std::string, Event> events_before_joining() {
  return {{"hello",
           [](Subject& s) {
             s.send([](auto& message) { message.mutable_hello()->set_protocol_version(proto::kProtocolVersion); });
           }},
          {"hello of another version",
           [](Subject& s) {
             s.send([](auto& message) { message.mutable_hello()->set_protocol_version(proto::kProtocolVersion + 1); });
           }},
          {"leave", [](Subject& s) { s.send([](auto& message) { message.mutable_leave(); }); }},
          {"ping", [](Subject& s) { s.send([](auto& message) { message.mutable_ping(); }); }},
          {"message not allowed here", send_forbidden},
          {"unreadable bytes",
           [](Subject& s) {
             s.bench.hub->on_control_bytes(s.client.handle, proto::Bytes(8, std::byte{0xFF}), s.bench.now);
           }},
          {"time-out", wait_out},
          {"server stops", [](Subject& s) { s.bench.hub->stop(s.bench.now); }},
          {"connection lost", [](Subject& s) { s.bench.hub->on_disconnected(s.client.handle, s.bench.now); }},
          {"join", [](Subject& s) { join_room(s, "ada", wire::ROLE_MANIPULATOR, ""); }},
          {"join of an unknown room", [](Subject& s) { join_room(s, "ada", wire::ROLE_MANIPULATOR, "attic"); }},
          {"join of a full room",
           [](Subject& s) {
             s.bench.join("ben");
             s.bench.join("cleo");
             join_room(s, "ada", wire::ROLE_MANIPULATOR, "");
           }},
          {"join as a second operator",
           [](Subject& s) {
             s.bench.join("olga", wire::ROLE_OPERATOR);
             join_room(s, "ada", wire::ROLE_OPERATOR, "");
           }},
          {"join with a bad name", [](Subject& s) { join_room(s, "", wire::ROLE_MANIPULATOR, ""); }},
          {"join with a bad deadband",
           [](Subject& s) {
             wire::ClientControl join = test::HubBench::join_message("ada");
             join.mutable_join()->set_deadband(0.6);
             s.bench.send(s.client, join);
           }},
          {"join as a source of signals", [](Subject& s) { join_room(s, "eeg", wire::ROLE_SIGNAL, ""); }},
          {"join without a role", [](Subject& s) { join_room(s, "ada", wire::ROLE_UNSPECIFIED, ""); }}};
}

std::map<std::string, Event> events_of_users() {
  return {
      {"grab",
       [](Subject& s) {
         s.send([](auto& message) { message.mutable_grab()->set_body(1); });
         s.bench.step();
       }},
      {"grab of an unknown body",
       [](Subject& s) {
         s.send([](auto& message) { message.mutable_grab()->set_body(60); });
         s.bench.step();
       }},
      {"release",
       [](Subject& s) {
         s.send([](auto& message) { message.mutable_release(); });
         s.bench.step();
       }},
      {"kick by the operator",
       [](Subject& s) {
         const std::uint32_t kicked = s.client.joined.user();
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         s.send([kicked](auto& message) { message.mutable_kick()->set_user(kicked); });
       }},
      {"kick by another user",
       [](Subject& s) {
         const std::uint32_t other = s.bench.join("olga", wire::ROLE_OPERATOR).joined.user();
         s.bench.drain(s.client);
         s.send([other](auto& message) { message.mutable_kick()->set_user(other); });
       }},
      {"kick of an unknown user",
       [](Subject& s) {
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         s.send([](auto& message) { message.mutable_kick()->set_user(77); });
       }},
      {"kicked",
       [](Subject& s) {
         const auto olga = s.bench.join("olga", wire::ROLE_OPERATOR);
         s.bench.drain(s.client);
         s.bench.send(
             olga, test::message_of([&s](auto& message) { message.mutable_kick()->set_user(s.client.joined.user()); }));
       }},
      {"set_parameter by the operator",
       [](Subject& s) {
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         set_parameter(s, "coupling.force_limit_n", 5);
       }},
      {"set_parameter by another user", [](Subject& s) { set_parameter(s, "coupling.force_limit_n", 5); }},
      {"set_parameter of an unknown name",
       [](Subject& s) {
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         set_parameter(s, "colour", 5);
       }},
      {"set_parameter out of range",
       [](Subject& s) {
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         set_parameter(s, "coupling.force_limit_n", -5);
       }},
      {"reset_room by the operator",
       [](Subject& s) {
         s.client = s.bench.join("olga", wire::ROLE_OPERATOR);
         s.send([](auto& message) { message.mutable_reset_room(); });
       }},
      {"reset_room by another user", [](Subject& s) { s.send([](auto& message) { message.mutable_reset_room(); }); }},
      {"ask_pose where there are no molecules",
       [](Subject& s) { s.send([](auto& message) { message.mutable_ask_pose(); }); }},
      {"signal by a source of signals",
       [](Subject& s) {
         become_source(s);
         send_signal(s, "valence");
       }},
      {"signal by another user", [](Subject& s) { send_signal(s, "valence"); }},
      {"signal of an unknown name",
       [](Subject& s) {
         become_source(s);
         send_signal(s, "arousal");
       }},
      {"grab by a source of signals",
       [](Subject& s) {
         become_source(s);
         s.send([](auto& message) { message.mutable_grab(); });
       }},
      {"point at a body", [](Subject& s) { point_at(s, 1); }},
      {"point at a body that is not there", [](Subject& s) { point_at(s, 99); }},
  };
}

std::map<std::string, Event> events_of_traffic() {
  return {
      {"get_asset of an unknown hash",
       [](Subject& s) { s.send([](auto& message) { message.mutable_get_asset()->set_sha256("?"); }); }},
      {"state_datagram",
       [](Subject& s) { s.send([](auto& message) { message.set_state_datagram("not a datagram"); }); }},
      {"reader too slow",
       [](Subject& s) {
         s.bench.transport.queued = kMaxQueuedControlBytes + 1;
         s.send([](auto& message) { message.mutable_ping(); });
       }},
      {"one connection too many", [](Subject&) {}},
      {"pushed out by newer connections",
       [](Subject& s) {
         for (std::size_t i = 0; i < kMaxHalfOpen; ++i) s.bench.connect();
       }},
  };
}

const std::map<std::string, Event>& events() {
  static const std::map<std::string, Event> kEvents = [] {
    std::map<std::string, Event> all = events_before_joining();
    all.merge(events_of_users());
    all.merge(events_of_traffic());
    return all;
  }();
  return kEvents;
}

TEST(StatesDocument, EveryTransitionOfTheServerHappensAsWritten) {
  std::map<std::string, int> caused;
  for (const test::TableRow& row : test::table_under(kDocument, "### Transitions of the server")) {
    const std::string& event = row.at("event");
    SCOPED_TRACE(row.at("state") + " / " + event);
    ASSERT_TRUE(events().contains(event)) << "the document has an event that the test cannot cause";
    ++caused[event];
    HubSettings settings;
    if (event == "one connection too many") settings.max_connections = 0;
    const bool has_signal = event.find("signal") != std::string::npos;
    Subject subject(row.at("state"), settings, has_signal ? scene_with_signal() : test::two_hands_scene());
    if (event != "one connection too many") {
      ASSERT_EQ(subject.state(), row.at("state"));
      subject.bench.drain(subject.client);
    }
    events().at(event)(subject);
    const auto sent = subject.bench.drain(subject.client);
    EXPECT_EQ(test::described(sent), row.at("sent"));
    EXPECT_EQ(subject.state(), row.at("next"));
    if (row.at("reason").empty()) continue;
    ASSERT_FALSE(sent.empty());
    EXPECT_EQ(wire::DisconnectReason_Name(sent.back().goodbye().reason()), row.at("reason"));
    EXPECT_TRUE(subject.bench.transport.closed.contains(subject.client.handle));
  }
  for (const auto& [event, action] : events()) EXPECT_GT(caused[event], 0) << event << " is not in the document";
}

TEST(StatesDocument, TheServerTakesExactlyTheListedMessages) {
  const auto* fields = wire::ClientControl::descriptor()->FindOneofByName("message");
  for (const test::TableRow& row : test::table_under(kDocument, "### Messages that the server takes")) {
    if (row.at("state") == "closed") continue;
    const auto allowed = test::split_trimmed(row.at("messages"), ',');
    for (int i = 0; i < fields->field_count(); ++i) {
      const auto& field = *fields->field(i);
      SCOPED_TRACE(row.at("state") + " / " + field.name());
      Subject subject(row.at("state"));
      subject.bench.drain(subject.client);
      subject.send([&field](auto& message) { fill_with(message, field); });
      bool was_protocol_error = false;
      for (const auto& message : subject.bench.drain(subject.client)) {
        was_protocol_error |= message.goodbye().reason() == wire::DISCONNECT_PROTOCOL_ERROR;
      }
      const bool is_allowed = std::find(allowed.begin(), allowed.end(), field.name()) != allowed.end();
      EXPECT_EQ(was_protocol_error, !is_allowed);
    }
  }
}

TEST(StatesDocument, TheServersTimeOutsAreThoseOfItsSettings) {
  for (const test::TableRow& row : test::table_under(kDocument, "## Server")) {
    SCOPED_TRACE(row.at("state"));
    if (row.at("time-out").empty()) continue;
    const Duration stated = std::chrono::milliseconds(std::stoi(row.at("time-out")));
    Subject subject(row.at("state"));
    const LocalTime begin = subject.bench.now;
    wait_out(subject);
    EXPECT_EQ(subject.bench.now - begin, stated);
  }
}

}  // namespace
}  // namespace tandem::server
