// Tests setting of the coupling's law and coefficients, and that all affected users receive the changes.
#include <gtest/gtest.h>

#include <map>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using test::message_of;

wire::ClientControl set_parameter(const std::string& name, double value) {
  return message_of([&](auto& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
  });
}

TEST(SessionParameters, AParameterIsBoundedAndSentToAllAndToNewUsers) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient ben = bench.join("ben");
  bench.drain(ada);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 250));
  const auto own = bench.drain(ada);
  ASSERT_EQ(test::described(own), "parameter_set");
  EXPECT_EQ(own[0].request(), 42U);
  const auto others = bench.drain(ben);
  ASSERT_EQ(test::described(others), "parameter_set");
  EXPECT_EQ(others[0].request(), 0U);
  EXPECT_EQ(others[0].parameter_set().value(), 250);
  for (const double bad : {-1.0, 1e9, 100001.0}) {
    bench.send(ada, set_parameter("coupling.stiffness_n_per_m", bad));
    EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_BAD_VALUE") << bad;
  }
  bench.send(ada, set_parameter("gravity", 1));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_UNKNOWN_PARAMETER");
  bench.send(ben, message_of([](auto& message) { message.mutable_leave(); }));
  EXPECT_EQ(bench.join("cleo").joined.scene().coupling().stiffness_n_per_m(), 250);
}

/// Returns a bench with two_hands_scene(), in which `coupling` replaces the coupling.
test::HubBench bench_with_coupling(const std::string& coupling) {
  std::string scene = test::two_hands_scene();
  const std::string old = R"({"law": "spring-damper", "stiffness_n_per_m": 200, "damping_n_s_per_m": 2})";
  EXPECT_NE(scene.find(old), std::string::npos);
  return test::HubBench({}, {scene.replace(scene.find(old), old.size(), coupling)});
}

/// Returns the values in the parameter_set messages, by name of the parameter.
std::map<std::string, double> parameters_in(const std::vector<wire::ServerControl>& messages) {
  std::map<std::string, double> values;
  for (const wire::ServerControl& message : messages) {
    if (message.has_parameter_set()) values[message.parameter_set().name()] = message.parameter_set().value();
  }
  return values;
}

TEST(SessionParameters, TheAdaptiveLawSendsEachUserTheStiffnessForTheHeldBody) {
  test::HubBench bench = bench_with_coupling(R"({"law": "adaptive", "adaptive": {
      "mass_range_kg": [0.01, 1], "stiffness_n_per_m": [100, 1000], "damping_n_s_per_m": [5]}})");
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient ben = bench.join("ben");
  EXPECT_DOUBLE_EQ(ada.joined.scene().coupling().stiffness_n_per_m(), 150) << "the tool's 0.05 kg";
  bench.drain(ada);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  const auto grabbed = bench.drain(ada);
  EXPECT_EQ(test::described(grabbed), "grabbed, parameter_set");
  EXPECT_EQ(parameters_in(grabbed), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 200}}));
  EXPECT_EQ(test::described(bench.drain(ben)), "") << "it is ada's alone";
  bench.send(ada, set_parameter("coupling.force_limit_n", 4));
  EXPECT_EQ(parameters_in(bench.drain(ben)), (std::map<std::string, double>{{"coupling.force_limit_n", 4}}));
  bench.drain(ada);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 500));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_NOT_ALLOWED") << "the law chooses it";
  bench.send(ada, message_of([](auto& message) { message.mutable_release(); }));
  bench.step();
  EXPECT_EQ(parameters_in(bench.drain(ada)), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 150}}));
}

TEST(SessionParameters, ALostEventDoesNotMakeTheSentCouplingWrong) {
  test::HubBench bench = bench_with_coupling(R"({"law": "adaptive", "adaptive": {
      "mass_range_kg": [0.01, 1], "stiffness_n_per_m": [100, 1000], "damping_n_s_per_m": [5]}})");
  test::BenchClient ada = bench.join("ada");
  bench.drain(ada);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  Room& room = *bench.rooms.front();
  room.step(ServerTime(room.period()));
  RoomEvent lost;
  ASSERT_TRUE(room.next_event(lost));
  EXPECT_EQ(lost.kind, RoomEvent::Kind::kGrabbed);
  bench.step();
  EXPECT_EQ(parameters_in(bench.drain(ada)), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 200}}));
}

TEST(SessionParameters, AMasslessToolHasDampingOnlyWhileItHoldsABody) {
  test::HubBench bench =
      bench_with_coupling(R"({"law": "qsa-static", "damping_n_s_per_m": 4, "damping_n_m_s_per_rad": 0.01})");
  test::BenchClient ada = bench.join("ada");
  EXPECT_EQ(ada.joined.scene().coupling().damping_n_s_per_m(), 0);
  bench.send(ada, message_of([](auto& message) { message.mutable_grab()->set_body(1); }));
  bench.step();
  EXPECT_EQ(parameters_in(bench.drain(ada)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 4},
                                                                            {"coupling.damping_n_m_s_per_rad", 0.01}}));
  test::BenchClient ben = bench.join("ben", wire::ROLE_OPERATOR);
  bench.drain(ada);
  bench.send(ben, set_parameter("coupling.damping_n_s_per_m", 7));
  EXPECT_EQ(parameters_in(bench.drain(ada)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 7}}));
  EXPECT_EQ(parameters_in(bench.drain(ben)), (std::map<std::string, double>{{"coupling.damping_n_s_per_m", 0}}));
}

TEST(SessionParameters, OnlyTheOperatorSetsThemAndTheyEndWithTheOperator) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient olga = bench.join("olga", wire::ROLE_OPERATOR);
  EXPECT_EQ(olga.joined.role(), wire::ROLE_OPERATOR);
  bench.drain(ada);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 300));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_NOT_ALLOWED");
  bench.send(olga, set_parameter("coupling.stiffness_n_per_m", 300));
  bench.step(200);
  EXPECT_EQ(bench.rooms.front()->world().coupling(0).stiffness_n_per_m, 300);
  bench.drain(ada);
  bench.send(olga, message_of([](auto& message) { message.mutable_leave(); }));
  const auto received = bench.drain(ada);
  EXPECT_EQ(parameters_in(received), (std::map<std::string, double>{{"coupling.stiffness_n_per_m", 200}}));
  bench.step(200);
  EXPECT_EQ(bench.rooms.front()->world().coupling(0).stiffness_n_per_m, 200);
}

wire::ClientControl set_law(const std::string& law) {
  return message_of([&](auto& message) {
    message.mutable_set_parameter()->set_name("coupling.law");
    message.mutable_set_parameter()->set_text(law);
  });
}

TEST(SessionLaw, IsSetByTheOperatorAndSentToAllUsersUntilTheOperatorLeaves) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient olga = bench.join("olga", wire::ROLE_OPERATOR);
  bench.drain(ada);
  bench.send(ada, set_law("stable-dynamic"));
  EXPECT_EQ(test::described(bench.drain(ada)), "error ERROR_NOT_ALLOWED");
  bench.send(olga, set_law("stable-dynamic"));
  const auto own = bench.drain(olga);
  ASSERT_EQ(test::described(own), "parameter_set");
  EXPECT_EQ(own[0].request(), 42U);
  EXPECT_EQ(own[0].parameter_set().text(), "stable-dynamic");
  const auto others = bench.drain(ada);
  ASSERT_EQ(test::described(others), "parameter_set");
  EXPECT_EQ(others[0].parameter_set().name(), "coupling.law");
  EXPECT_EQ(others[0].parameter_set().text(), "stable-dynamic");
  bench.send(olga, set_law("stable-dynamic"));
  EXPECT_EQ(test::described(bench.drain(olga)), "parameter_set");
  EXPECT_EQ(test::described(bench.drain(ada)), "") << "an unchanged law must not be reported";
  EXPECT_EQ(bench.join("eve", wire::ROLE_OBSERVER).joined.scene().coupling().law(), "stable-dynamic");
  bench.drain(ada);
  bench.send(olga, message_of([](auto& message) { message.mutable_leave(); }));
  const auto received = bench.drain(ada);
  ASSERT_EQ(test::described(received), "parameter_set, user_left");
  EXPECT_EQ(received[0].parameter_set().text(), "spring-damper") << "the scene's";
  EXPECT_EQ(bench.join("cleo").joined.scene().coupling().law(), "spring-damper");
}

TEST(SessionLaw, ThatTheSceneCannotHaveIsRefusedWithTheReason) {
  test::HubBench bench;
  test::BenchClient olga = bench.join("olga", wire::ROLE_OPERATOR);
  const auto answer_to = [&](const std::string& law) {
    bench.send(olga, set_law(law));
    return bench.drain(olga).at(0);
  };
  for (const char* law : {"", "hooke"}) EXPECT_EQ(answer_to(law).error().code(), wire::ERROR_BAD_VALUE) << law;
  for (const char* law : {"qsa-static", "direct", "adaptive", "qsa-dynamic", "stable-dynamic-literal"}) {
    const wire::ServerControl answer = answer_to(law);
    EXPECT_EQ(answer.error().code(), wire::ERROR_NOT_ALLOWED) << law;
    EXPECT_NE(answer.error().text().find(law), std::string::npos) << answer.error().text();
  }
  EXPECT_EQ(bench.join("cleo").joined.scene().coupling().law(), "spring-damper");
  for (const char* law : {"qsa-static", "direct"}) {
    test::HubBench other = bench_with_coupling(R"({"law": ")" + std::string(law) + "\"}");
    test::BenchClient ada = other.join("ada", wire::ROLE_OPERATOR);
    other.send(ada, set_law("spring-damper"));
    EXPECT_EQ(test::described(other.drain(ada)), "error ERROR_NOT_ALLOWED") << law;
    other.send(ada, set_law(law));
    EXPECT_EQ(test::described(other.drain(ada)), "parameter_set") << "it has that: " << law;
  }
}

TEST(SessionLaw, AfterTheAdaptiveLawTheOperatorSetsTheCoefficients) {
  test::HubBench bench = bench_with_coupling(R"({"law": "adaptive", "stiffness_n_per_m": 250, "adaptive": {
      "mass_range_kg": [0.01, 1], "stiffness_n_per_m": [100, 1000], "damping_n_s_per_m": [5]}})");
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient ben = bench.join("ben");
  bench.drain(ada);
  const std::map<std::string, double> scene{
      {"coupling.law", 0}, {"coupling.stiffness_n_per_m", 250}, {"coupling.damping_n_s_per_m", 3}};
  bench.send(ada, set_law("spring-damper"));
  EXPECT_EQ(parameters_in(bench.drain(ada)), scene);
  EXPECT_EQ(parameters_in(bench.drain(ben)), scene);
  bench.send(ada, set_parameter("coupling.stiffness_n_per_m", 500));
  EXPECT_EQ(test::described(bench.drain(ada)), "parameter_set");
  bench.drain(ben);
  bench.send(ada, set_law("adaptive"));
  EXPECT_EQ(parameters_in(bench.drain(ben)),
            (std::map<std::string, double>{
                {"coupling.law", 0}, {"coupling.stiffness_n_per_m", 150}, {"coupling.damping_n_s_per_m", 5}}));
}

}  // namespace
}  // namespace tandem::server
