// Compares ClientSession with the client's tables in proto/STATES.md. Each row of a table is reproduced, so an
// undocumented transition fails.
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "tests/support/markdown_table.hpp"
#include "tests/support/session_bench.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::client {
namespace {

const std::string kDocument = test::source_path("proto/STATES.md").string();

/// Brings the session into `state`. If `has_joined`, the session joins a room before that.
void bring_to(test::SessionBench& bench, const std::string& state, bool has_joined) {
  if (has_joined && state != "active") {
    bench.join();
    bench.session.on_disconnected(bench.now, "cut");
    if (state == "waiting") return;
    bench.wait(std::chrono::milliseconds(250));
  }
  if (state == "connecting") return;
  bench.session.on_connected(bench.now);
  if (state == "greeting") return;
  bench.deliver_welcome();
  if (state == "joining") return;
  bench.deliver_joined();
  if (state == "ended") bench.session.leave(bench.now);
}

void deliver_forbidden(test::SessionBench& bench) {
  wire::ServerControl message;
  if (bench.state() == "active") {
    message.mutable_joined();
  } else {
    message.mutable_pong();
  }
  bench.deliver(message);
}

void wait_out(test::SessionBench& bench) {
  const std::string before = bench.state();
  for (int i = 0; i < 6000 && bench.state() == before; ++i) bench.wait(std::chrono::milliseconds(1));
}

using Event = std::function<void(test::SessionBench&)>;

const std::map<std::string, Event>& events() {
  static const std::map<std::string, Event> kEvents{
      {"connected", [](test::SessionBench& b) { b.session.on_connected(b.now); }},
      {"connection refused", [](test::SessionBench& b) { b.session.on_disconnected(b.now, "refused"); }},
      {"connection lost", [](test::SessionBench& b) { b.session.on_disconnected(b.now, "lost"); }},
      {"time-out", wait_out},
      {"leave", [](test::SessionBench& b) { b.session.leave(b.now); }},
      {"welcome", [](test::SessionBench& b) { b.deliver_welcome(); }},
      {"welcome of another version",
       [](test::SessionBench& b) {
         wire::ServerControl message;
         message.mutable_welcome()->set_protocol_version(proto::kProtocolVersion + 1);
         message.mutable_welcome()->set_connection_id(1);
         b.deliver(message);
       }},
      {"joined", [](test::SessionBench& b) { b.deliver_joined(); }},
      {"joined with an unusable scene",
       [](test::SessionBench& b) {
         wire::Joined joined = test::minimal_joined();
         joined.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_position_scale(0);
         b.deliver_joined(joined);
       }},
      {"goodbye",
       [](test::SessionBench& b) {
         wire::ServerControl message;
         message.mutable_goodbye()->set_reason(wire::DISCONNECT_SERVER_STOPPING);
         b.deliver(message);
       }},
      {"goodbye to one who is kicked",
       [](test::SessionBench& b) {
         wire::ServerControl message;
         message.mutable_goodbye()->set_reason(wire::DISCONNECT_KICKED);
         b.deliver(message);
       }},
      {"goodbye to one who rejoined on another connection",
       [](test::SessionBench& b) {
         wire::ServerControl message;
         message.mutable_goodbye()->set_reason(wire::DISCONNECT_RESUMED);
         b.deliver(message);
       }},
      {"message not allowed here", deliver_forbidden},
      {"unreadable bytes",
       [](test::SessionBench& b) { b.session.on_control_bytes(proto::Bytes(8, std::byte{0xFF}), b.now); }},
  };
  return kEvents;
}

void cause(test::SessionBench& bench, const std::string& event) {
  if (event.starts_with("error ")) {
    wire::ErrorCode code{};
    ASSERT_TRUE(wire::ErrorCode_Parse(event.substr(6), &code)) << event;
    bench.deliver_error(code);
  } else {
    ASSERT_TRUE(events().contains(event)) << "the document has an event that the test cannot cause";
    events().at(event)(bench);
  }
}

std::string outcome(const test::SessionBench& bench) {
  return bench.session.status().is_setup_error ? "refused" : bench.state();
}

TEST(StatesDocument, EveryTransitionOfTheClientHappensAsWritten) {
  std::map<std::string, int> caused;
  for (const test::TableRow& row : test::table_under(kDocument, "### Transitions of the client")) {
    ++caused[row.at("event")];
    for (const bool has_joined : {false, true}) {
      const std::string& next = row.at(has_joined ? "next after it" : "next before the first join");
      if (next.empty()) continue;
      SCOPED_TRACE(row.at("state") + " / " + row.at("event") + (has_joined ? " after a join" : ""));
      test::SessionBench bench;
      bring_to(bench, row.at("state"), has_joined);
      ASSERT_EQ(bench.state(), row.at("state"));
      bench.transport.messages.clear();
      const int connects = bench.transport.connects;
      cause(bench, row.at("event"));
      // An active session also sends state datagrams, which are not control messages.
      EXPECT_EQ(test::described(bench.transport.messages), row.at("sent"));
      EXPECT_EQ(outcome(bench), next);
      EXPECT_EQ(bench.transport.connects - connects, next == "connecting" ? 1 : 0);
      EXPECT_EQ(bench.scene_may_display(), next == "active");
      const bool has_a_reason_for_people = !bench.session.status().why.empty();
      EXPECT_EQ(has_a_reason_for_people,
                next == "waiting" || next == "refused" || next == "ended" || (has_joined && next != "active"));
    }
  }
  for (const auto& [event, action] : events()) EXPECT_GT(caused[event], 0) << event << " is not in the document";
}

TEST(StatesDocument, TheClientAcceptsExactlyTheListedMessages) {
  const auto* fields = wire::ServerControl::descriptor()->FindOneofByName("message");
  for (const test::TableRow& row : test::table_under(kDocument, "### Messages that the client takes")) {
    const auto allowed = test::split_trimmed(row.at("messages"), ',');
    const std::string& state = row.at("state");
    if (state == "connecting" || state == "waiting" || state == "ended") {
      EXPECT_TRUE(row.at("messages").empty()) << "there is no connection in " << state;
      continue;
    }
    for (int i = 0; i < fields->field_count(); ++i) {
      const auto& field = *fields->field(i);
      SCOPED_TRACE(state + " / " + field.name());
      test::SessionBench bench;
      bring_to(bench, state, false);
      wire::ServerControl message;
      if (field.name() == "state_datagram") {
        message.set_state_datagram("x");
      } else if (field.name() == "welcome") {
        message.mutable_welcome()->set_connection_id(1);
      } else if (field.name() == "asset_chunk") {
        message.mutable_asset_chunk()->set_sha256(std::string(proto::kAssetHashBytes, 'h'));
      } else {
        message.GetReflection()->MutableMessage(&message, &field);
      }
      bench.deliver(message);
      const bool was_protocol_error = bench.session.status().why.find("not allowed") != std::string::npos;
      const bool is_allowed = std::find(allowed.begin(), allowed.end(), field.name()) != allowed.end();
      EXPECT_EQ(was_protocol_error, !is_allowed) << bench.session.status().why;
    }
  }
}

TEST(StatesDocument, TheClientsTimeOutsAreThoseOfItsSettings) {
  for (const test::TableRow& row : test::table_under(kDocument, "## Client")) {
    SCOPED_TRACE(row.at("state"));
    if (row.at("time-out").empty()) continue;
    test::SessionBench bench;
    bring_to(bench, row.at("state"), row.at("state") == "waiting");
    const LocalTime begin = bench.now;
    wait_out(bench);
    EXPECT_EQ(bench.now - begin, Duration(std::chrono::milliseconds(std::stoi(row.at("time-out")))));
  }
}

}  // namespace
}  // namespace tandem::client
