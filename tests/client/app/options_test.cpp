// Tests the command line: valid values are read with their unit. An invalid value must give an error of one line that
// names the valid values.
#include "client/app/options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <vector>

#include "client/app/run_settings.hpp"
#include "client/app/summary.hpp"
#include "client/start/start_choice.hpp"
#include "tests/client/start/some_invitation.hpp"

namespace tandem::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::optional<ClientOptions> parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), {"tandem-client", "--headless", "--insecure"});
  return parse_client_options(static_cast<int>(arguments.size()), arguments.data());
}

std::string error_of(const std::vector<const char*>& arguments) {
  try {
    parse(arguments);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ClientOptions, DefaultsRunTheSimulatedHandAgainstThisMachine) {
  const auto options = parse({});
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->io.host, "127.0.0.1");
  EXPECT_EQ(options->io.port, 47800);
  EXPECT_EQ(options->device.hand, "rest");
  EXPECT_EQ(options->stage.name, StageSettings{}.name);
  EXPECT_EQ(options->stage.predictor, "scored");
  EXPECT_TRUE(options->stage.passivity);
  EXPECT_FALSE(parse({"--passivity", "off"})->stage.passivity);
  EXPECT_FALSE(parse({"--guard", "off"})->stage.passivity) << "its older name";
  EXPECT_EQ(options->realtime_priority, 70);
  EXPECT_FALSE(options->keeps_awake.has_value()) << "where it is worth it";
  EXPECT_EQ(parse({"--keep-awake", "on"})->keeps_awake, true);
  EXPECT_EQ(parse({"--keep-awake", "off"})->keeps_awake, false);
  EXPECT_FALSE(options->io.links.has_value()) << "no simulated link unless asked for";
  EXPECT_FALSE(options->duration.has_value());
}

TEST(ClientOptions, ParametersToSetAreCheckedAndInTheOrderOfTheirTimes) {
  const auto options = parse({"--set", "coupling.law=qsa-dynamic@2s", "--set", "coupling.stiffness_n_per_m=400",
                              "--set", "coupling.law=spring-damper@1500ms"});
  ASSERT_TRUE(options.has_value());
  ASSERT_EQ(options->sets.size(), 3U);
  EXPECT_EQ(options->sets[0].second.value(), 400);
  EXPECT_EQ(options->sets[0].first, Duration{0});
  EXPECT_EQ(options->sets[1].second.text(), "spring-damper");
  EXPECT_EQ(options->sets[1].first, Duration(std::chrono::milliseconds(1500)));
  EXPECT_EQ(options->sets[2].second.text(), "qsa-dynamic");
  EXPECT_THAT(error_of({"--set", "coupling.law"}), HasSubstr("NAME=VALUE"));
  EXPECT_THAT(error_of({"--set", "coupling.law=hooke"}), AllOf(HasSubstr("hooke"), HasSubstr("spring-damper")));
  EXPECT_THAT(error_of({"--set", "coupling.law="}), HasSubstr("spring-damper"));
  EXPECT_THAT(error_of({"--set", "gravity=1"}), HasSubstr("coupling.damping_n_s_per_m"));
  for (const char* value : {"-1", "nan", "many", "2e5", ""}) {
    const std::string text = "coupling.stiffness_n_per_m=" + std::string(value);
    EXPECT_THAT(error_of({"--set", text.c_str()}), HasSubstr("range")) << value;
  }
  EXPECT_THAT(error_of({"--set", "coupling.stiffness_n_per_m=1@soon"}), HasSubstr("soon"));
}

TEST(ClientOptions, TheSimulatedHandHoldsADeviceByItsProfile) {
  EXPECT_EQ(parse({})->device.name, "sim");
  EXPECT_EQ(parse({})->device.profile.name, "sim");
  const auto options = parse({"--device", "sim", "--profile", "falcon", "--seed", "9"});
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->device.name, "sim");
  EXPECT_FALSE(options->device.profile.has_torque());
  EXPECT_EQ(options->device.profile.spec.force_limit_n, 7);
  EXPECT_EQ(options->device.seed, 9U);
  EXPECT_EQ(options->device.hand_parameters.mass_kg, devices::HandParameters{}.mass_kg)
      << "the hand alone: the device is added later";
}

TEST(ClientOptions, ADeadbandIsAShareUpToHalf) {
  EXPECT_EQ(parse({})->io.client.session.deadband, 0) << "everything is sent unless asked otherwise";
  EXPECT_DOUBLE_EQ(parse({"--deadband", "10%"})->io.client.session.deadband, 0.1);
  for (const char* bad : {"60%", "-1%", "much", "nan"}) {
    EXPECT_THAT(error_of({"--deadband", bad}), HasSubstr("--deadband")) << bad;
  }
}

TEST(ClientOptions, LinkOptionsHoldForBothDirections) {
  const auto options = parse({"--delay", "25ms", "--jitter", "500us", "--loss", "1%", "--duplication", "0.5%",
                              "--reorder", "--rate-limit", "1e6", "--seed", "9"});
  ASSERT_TRUE(options && options->io.links);
  for (const net::LinkParameters& link : {options->io.links->up, options->io.links->down}) {
    EXPECT_EQ(link.delay, std::chrono::milliseconds(25));
    EXPECT_EQ(link.jitter, std::chrono::microseconds(500));
    EXPECT_DOUBLE_EQ(link.loss, 0.01);
    EXPECT_DOUBLE_EQ(link.duplication, 0.005);
    EXPECT_TRUE(link.allows_reordering);
    EXPECT_DOUBLE_EQ(link.rate_limit_bytes_per_s, 1e6);
  }
  EXPECT_EQ(options->io.links->seed, 9U);
}

TEST(ClientOptions, SessionOptionsReachTheSession) {
  const auto options = parse({"--server", "[::1]:1234", "--room", "attic", "--name", "anna", "--role", "observer",
                              "--transport", "tcp", "--duration", "10s", "--rt-priority", "0"});
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->io.host, "::1");
  EXPECT_EQ(options->io.port, 1234);
  EXPECT_EQ(options->io.client.session.room, "attic");
  EXPECT_EQ(options->io.client.session.user_name, "anna");
  EXPECT_EQ(options->io.client.session.role, wire::ROLE_OBSERVER);
  EXPECT_TRUE(options->io.client.session.state_over_tcp);
  EXPECT_EQ(options->duration, std::chrono::seconds(10));
  EXPECT_EQ(options->realtime_priority, 0);
}

TEST(ClientOptions, EachMistakeIsOneLineThatNamesOptionAndRemedy) {
  const struct {
    std::vector<const char*> arguments;
    std::vector<const char*> words;
  } cases[] = {
      {{"--stage", "telepathy"}, {"--stage", "telepathy", "late-pose"}},
      {{"--predictor", "telepathy"}, {"--predictor", "telepathy", "ar-spline"}},
      {{"--passivity", "maybe"}, {"--passivity", "maybe", "off"}},
      {{"--wave-impedance", "0"}, {"--wave-impedance", "0.1"}},
      {{"--delay", "25"}, {"--delay", "25ms"}},
      {{"--loss", "120%"}, {"--loss", "120%"}},
      {{"--loss", "99%"}, {"--loss", "0% to 95%"}},
      {{"--transport", "tcp", "--loss", "1%"}, {"--transport tcp", "--loss", "udp"}},
      {{"--transport", "tcp", "--duplication", "1%"}, {"--transport tcp", "--duplication", "udp"}},
      {{"--transport", "tcp", "--reorder"}, {"--transport tcp", "--reorder", "udp"}},
      {{"--device", "wand"}, {"--device", "wand", "sim"}},
      {{"--device", "omega.6"}, {"--device", "omega.6", "no driver", "--device sim --profile omega.6"}},
      {{"--device", "mine.json"}, {"--device", "--device sim --profile mine.json"}},
      {{"--profile", "wand"}, {"--profile", "wand", "sim", "omega.6"}},
      {{"--profile", "/nonexistent/mine.json"}, {"--profile", "/nonexistent/mine.json", "check the path"}},
      {{"--role", "king"}, {"--role", "king", "manipulator"}},
      {{"--transport", "carrier-pigeon"}, {"--transport", "udp"}},
      {{"--server", "127.0.0.1:99999"}, {"--server", "65535"}},
      {{"--server", ":47800"}, {"--server", "address"}},
      {{"--duration", "0s"}, {"--duration", "above 0"}},
      {{"--duration", "3"}, {"--duration", "3s"}},
      {{"--cpu", "1000000"}, {"--cpu", "1000000", "0 to "}},
      {{"--keep-awake", "maybe"}, {"--keep-awake", "maybe", "auto"}},
      {{"--rt-priority", "200"}, {"--rt-priority", "99"}},
      {{"--trace-every", "0"}, {"--trace-every"}},
      {{"--hand-mass", "heavy"}, {"--hand-mass", "heavy"}},
      {{"--hand-mass", "0"}, {"--hand-mass", "0.01 to 10"}},
      {{"--hand-stiffness", "nan"}, {"--hand-stiffness", "0 to 10000"}},
      {{"--no-such-option"}, {"--no-such-option", "--help"}},
  };
  for (const auto& one : cases) {
    const std::string error = error_of(one.arguments);
    for (const char* word : one.words) EXPECT_THAT(error, AllOf(HasSubstr(word), Not(HasSubstr("\n"))));
  }
}

TEST(ClientOptions, HelpAndVersionNeedNoDeviceProfiles) {
  setenv("TANDEM_DEVICE_PROFILES", "/nonexistent/devices.json", 1);
  for (const char* option : {"--help", "--version"}) {
    testing::internal::CaptureStdout();
    EXPECT_FALSE(parse({option}).has_value());
    EXPECT_FALSE(testing::internal::GetCapturedStdout().empty());
  }
  EXPECT_THAT(error_of({}), AllOf(HasSubstr("--profile"), HasSubstr("/nonexistent/devices.json")));
  unsetenv("TANDEM_DEVICE_PROFILES");
}

TEST(ClientOptions, DelayAndRateAreAllowedOverAStream) {
  const auto options = parse({"--transport", "tcp", "--delay", "25ms", "--jitter", "5ms", "--rate-limit", "1e6"});
  ASSERT_TRUE(options && options->io.links);
  EXPECT_EQ(options->io.links->up.delay, std::chrono::milliseconds(25));
}

std::optional<ClientOptions> parse_with_window(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), {"tandem-client", "--insecure"});
  return parse_client_options(static_cast<int>(arguments.size()), arguments.data());
}

TEST(ClientOptions, CommandsMoveTheMousesHandWithoutAWindow) {
  const auto options = parse({"--commands"});
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->reads_commands);
  EXPECT_EQ(options->device.name, "mouse");
  EXPECT_EQ(parse({"--commands", "--hand", "circle"})->device.name, "sim") << "a hand that has a path of its own";
  EXPECT_FALSE(parse({})->reads_commands);
  EXPECT_THAT(error_of({"--commands", "--json"}), AllOf(HasSubstr("--commands"), HasSubstr("leave out --json")));
}

TEST(ClientOptions, WithoutHeadlessThereIsAWindowAndTheMouseIsTheDevice) {
  const auto options = parse_with_window({"--screenshot", "a.png", "--after", "2s", "--window-size", "640x480"});
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->window.is_open);
  EXPECT_EQ(options->device.name, "mouse");
  EXPECT_EQ(options->window.screenshot, "a.png");
  EXPECT_EQ(options->window.after, std::chrono::seconds(2));
  EXPECT_EQ(options->window.width, 640);
  EXPECT_EQ(options->window.height, 480);
  EXPECT_FALSE(options->window.begins_guide);
  EXPECT_TRUE(parse_with_window({"--guide"})->window.begins_guide);
  EXPECT_THAT(error_of({"--guide"}), AllOf(HasSubstr("--guide"), HasSubstr("leave out --headless")));
  EXPECT_FALSE(options->window.awaits_server);
  EXPECT_TRUE(parse_with_window({"--guide", "--await-server"})->window.awaits_server);
  EXPECT_THAT(error_of({"--await-server"}), HasSubstr("add --guide"));
  EXPECT_FALSE(parse({})->window.is_open);
  EXPECT_EQ(parse_with_window({"--hand", "circle"})->device.name, "sim") << "who names a hand wants to watch it";
  EXPECT_EQ(parse_with_window({"--device", "sim"})->device.name, "sim");
}

TEST(ClientOptions, AWindowsSizeIsTwoNumbersThatAScreenCanHave) {
  for (const char* const size : {"640", "640x", "x480", "640x480x2", "100x100", "99999x480", "axb", ""}) {
    EXPECT_THROW(parse_with_window({"--window-size", size}), std::invalid_argument) << size;
  }
}

TEST(Summary, WatchesTheBodyOfItsToolElseTheFirstGraspableOne) {
  wire::Joined joined;
  EXPECT_FALSE(watched_body(joined).is_valid());
  joined.mutable_scene()->add_bodies()->set_name("table");
  wire::Body* peg = joined.mutable_scene()->add_bodies();
  peg->set_name("peg");
  peg->set_graspable(true);
  EXPECT_EQ(watched_body(joined), BodyId{2});
  joined.mutable_scene()->add_bodies()->set_name("helix_b");
  joined.mutable_scene()->add_tools()->set_holds("helix_b");
  joined.set_role(wire::ROLE_OBSERVER);
  EXPECT_EQ(watched_body(joined), BodyId{2});
  joined.set_role(wire::ROLE_MANIPULATOR);
  EXPECT_EQ(watched_body(joined), BodyId{3});
  joined.set_tool(7);
  EXPECT_EQ(watched_body(joined), BodyId{2}) << "a tool that the scene does not have";
}

RunSummary empty_summary() {
  return {.options = {},
          .device = {},
          .realtime_not_granted = {},
          .loop = {},
          .trace_overflows = 0,
          .counters = {},
          .io = {},
          .coupling_findings = {},
          .watched = {},
          .watched_name = "",
          .run = RunReport({"hold"}, Duration{1})};
}

boost::json::value written(const RunSummary& summary) {
  return boost::json::parse(boost::json::serialize(to_json(summary)));
}

TEST(Summary, SaysWhatItTakesToRunItAgain) {
  RunSummary summary = empty_summary();
  summary.options =
      *parse({"--role",      "observer", "--hand",      "circle", "--hand-mass", "0.5",  "--seed",  "77",
              "--delay",     "25ms",     "--loss",      "2%",     "--name",      "anna", "--stage", "hold",
              "--predictor", "linear",   "--passivity", "off",    "--profile",   "touch"});
  summary.io.joined = std::make_shared<wire::Joined>();
  summary.io.room = "attic";
  const boost::json::value parsed = written(summary);
  EXPECT_EQ(parsed.at("program").as_string(), "tandem-client");
  EXPECT_FALSE(parsed.at("version").as_string().empty());
  EXPECT_EQ(parsed.at("room").as_string(), "attic") << "though none was asked for";
  EXPECT_EQ(parsed.at("user").as_string(), "anna");
  EXPECT_EQ(parsed.at("role").as_string(), "observer");
  EXPECT_EQ(parsed.at("transport").as_string(), "udp");
  EXPECT_EQ(parsed.at("stage").as_string(), "hold");
  EXPECT_EQ(parsed.at("predictor").as_string(), "linear");
  EXPECT_FALSE(parsed.at("passivity").as_bool());
  EXPECT_EQ(parsed.at("wave_impedance").at("linear_n_s_per_m").to_number<double>(),
            haptics::WaveImpedance{}.linear_n_s_per_m);
  EXPECT_EQ(parsed.at("driver").as_string(), "sim");
  EXPECT_EQ(parsed.at("device").as_string(), "touch") << "as in an experiment's file";
  EXPECT_EQ(parsed.at("hand").as_string(), "circle");
  EXPECT_EQ(parsed.at("hand_parameters").at("mass_kg").to_number<double>(), 0.5);
  EXPECT_EQ(parsed.at("seed").to_number<int>(), 77);
  for (const char* direction : {"up", "down"}) {
    EXPECT_EQ(parsed.at("link_parameters").at(direction).at("delay_ms").to_number<double>(), 25);
    EXPECT_EQ(parsed.at("link_parameters").at(direction).at("loss").to_number<double>(), 0.02);
  }
}

TEST(Summary, CountsTheEventsThatWereNotRead) {
  RunSummary summary = empty_summary();
  summary.io.events_dropped = 3;
  EXPECT_EQ(written(summary).at("events_dropped").to_number<int>(), 3);
}

TEST(Summary, NamesTheBodyThatWasWatched) {
  RunSummary summary = empty_summary();
  summary.watched = BodyId{2};
  summary.watched_name = "peg";
  TickRecord record;
  record.watched_body_W.emplace();
  summary.run.add(record, 0);
  EXPECT_EQ(written(summary).at("watched_body").at("name").as_string(), "peg");
}

TEST(Summary, IsAValidObjectEvenOfARunThatNeverTicked) {
  const boost::json::value parsed = written(empty_summary());
  EXPECT_TRUE(parsed.at("room").is_null());
  EXPECT_TRUE(parsed.at("link_parameters").is_null()) << "no link was simulated";
  EXPECT_TRUE(parsed.at("watched_body").is_null());
  EXPECT_TRUE(parsed.at("round_trip_ms").at("newest").is_null());
  EXPECT_EQ(parsed.at("ticks_run").to_number<int>(), 0);
  EXPECT_TRUE(parsed.at("all_forces_finite").as_bool());
  EXPECT_TRUE(parsed.at("phases").at(0).at("settled_force_max_n").is_null());
}

TEST(OptionsToJoin, ContainNothingOfAnEarlierSession) {
  const std::string first = test::some_invitation("192.0.2.2:5000");
  const std::vector<const char*> line{"tandem-client", "--headless", "--join", first.c_str(), "--room", "lab"};
  const auto options = parse_client_options(static_cast<int>(line.size()), line.data());
  ASSERT_TRUE(options && options->io.trust);
  const ClientOptions own = options_to_join(*options, join_target("127.0.0.1:4711"), "", true);
  EXPECT_FALSE(own.io.trust) << "a server of this machine does not speak TLS";
  EXPECT_TRUE(own.io.client.session.token.empty());
  EXPECT_EQ(own.io.client.session.room, "");
  EXPECT_EQ(own.io.client.session.role, wire::ROLE_OPERATOR);
  EXPECT_EQ(own.io.host, "127.0.0.1");
  EXPECT_EQ(own.io.port, 4711);
  EXPECT_EQ(options_to_join(*options, join_target("localhost"), "", false).io.port, 47800) << "not the earlier port";
  const JoinTarget other = join_target(test::some_invitation("192.0.2.3:6000", "ben"));
  const ClientOptions hosted = options_to_join(*options, other, "ben", false);
  ASSERT_TRUE(hosted.io.trust);
  EXPECT_EQ(hosted.io.host, "192.0.2.3");
  EXPECT_EQ(hosted.io.client.session.token, other.invitation->token);
  EXPECT_EQ(hosted.io.client.session.room, "");
  EXPECT_EQ(hosted.io.client.session.user_name, "ben");
}

TEST(OptionsOfNext, DoNotReplaceTheFilesOfTheFirstSession) {
  const ClientOptions next = options_of_next(*parse({"--trace", "t.csv", "--record", "r.mcap"}));
  EXPECT_TRUE(next.trace.empty());
  EXPECT_TRUE(next.record.empty());
}

}  // namespace
}  // namespace tandem::client
