// Tests messages of the room on the control channel: soft bodies, common start, saved poses, and places to which users
// point.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <utility>

#include "client/session/joined_scene.hpp"
#include "client/session/session.hpp"
#include "proto/soft_shape.hpp"
#include "tests/support/session_bench.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;

void begin_joining(test::SessionBench& bench) {
  bench.session.on_connected(bench.now);
  bench.deliver_welcome();
}

TEST(ClientSession, KeepsTheShapesOfItsSoftBodiesAndNoOthers) {
  test::SessionBench bench;
  wire::Joined joined = test::minimal_joined();
  joined.mutable_scene()->add_soft_bodies()->set_name("pad");
  begin_joining(bench);
  bench.deliver_joined(joined);
  wire::ServerControl message;
  const std::vector<Vec3> offsets(proto::kSoftLatticePoints, Vec3(0, 0, 0.01));
  proto::write_soft_shape(0, offsets, *message.mutable_soft_shape());
  bench.deliver(message);
  ASSERT_EQ(bench.session.soft_offsets().size(), 1U);
  ASSERT_NE(bench.session.soft_offsets()[0], nullptr);
  EXPECT_NEAR((*bench.session.soft_offsets()[0])[7].z(), 0.01, 5e-5);
  message.mutable_soft_shape()->set_soft_body(1);
  bench.deliver(message);
  message.mutable_soft_shape()->set_soft_body(0);
  message.mutable_soft_shape()->set_offsets("short");
  bench.deliver(message);
  EXPECT_EQ(bench.state(), "active");
  EXPECT_NEAR((*bench.session.soft_offsets()[0])[7].z(), 0.01, 5e-5);
}

TEST(ClientSession, TakesAStartOfTheRoomThatIsEitherAwaitedOrAtATime) {
  test::SessionBench bench;
  begin_joining(bench);
  wire::Joined joined = test::minimal_joined();
  joined.mutable_start()->set_awaited(2);
  bench.deliver_joined(joined);
  EXPECT_EQ(bench.session.hand_start().kind, HandStart::Kind::kAwaited);
  EXPECT_THAT(bench.news, HasSubstr("2 more users"));
  const auto deliver = [&](std::uint32_t awaited, std::uint64_t starts_ns) {
    wire::ServerControl message;
    message.mutable_room_start()->set_awaited(awaited);
    message.mutable_room_start()->set_starts_server_ns(starts_ns);
    bench.deliver(message);
  };
  deliver(0, 0);
  deliver(1, 5);
  deliver(17, 0);
  deliver(0, std::uint64_t{1} << 63U);
  deliver(0, ~std::uint64_t{0});
  EXPECT_EQ(bench.session.hand_start().kind, HandStart::Kind::kAwaited) << "an invalid start must be ignored";
  deliver(0, 7'000'000'000);
  EXPECT_EQ(bench.session.hand_start().kind, HandStart::Kind::kAt);
  EXPECT_EQ(bench.session.hand_start().at, ServerTime(std::chrono::seconds(7)));
  bench.mailboxes.scene.poll();
  EXPECT_EQ(bench.mailboxes.scene.front().hand_start.kind, HandStart::Kind::kAt);
  deliver(1, 0);
  EXPECT_EQ(bench.session.hand_start().kind, HandStart::Kind::kAwaited) << "withdrawn";
  EXPECT_EQ(bench.state(), "active");
}

TEST(ClientSession, RefusesASceneWhoseStartIsBoth) {
  test::SessionBench bench;
  begin_joining(bench);
  wire::Joined joined = test::minimal_joined();
  joined.mutable_start()->set_awaited(1);
  joined.mutable_start()->set_starts_server_ns(1);
  bench.deliver_joined(joined);
  EXPECT_EQ(bench.state(), "ended");
  EXPECT_THAT(bench.session.status().why, HasSubstr("start"));
}

TEST(ClientSession, KeepsPosesInTheirOrderAndNoneThatCannotBe) {
  test::SessionBench bench;
  begin_joining(bench);
  bench.deliver_joined(test::minimal_joined());
  EXPECT_EQ(bench.session.kept_poses(), nullptr);
  wire::ServerControl message;
  wire::KeptPose& pointed = *message.mutable_kept_pose();
  const auto deliver = [&](std::uint32_t number, const std::vector<double>& in_first) {
    pointed.set_number(number);
    pointed.mutable_in_first()->Assign(in_first.begin(), in_first.end());
    bench.deliver(message);
  };
  pointed.set_name("the \x1b[31mfirst");
  deliver(0, {0, 0, 0, 2, 0, 0, 0});
  deliver(0, {0, 0, 0, 1, 0, 0});
  deliver(1, {0, 0, 0, 1, 0, 0, 0});
  EXPECT_EQ(bench.session.kept_poses(), nullptr);
  deliver(0, {1, 2, 3, 1, 0, 0, 0});
  deliver(0, {4, 5, 6, 1, 0, 0, 0});
  ASSERT_NE(bench.session.kept_poses(), nullptr);
  EXPECT_EQ(bench.session.kept_poses()->size(), 1U);
  EXPECT_EQ(bench.session.kept_poses()->front().in_first(1), 2);
  EXPECT_EQ(bench.session.kept_poses()->front().name().find('\x1b'), std::string::npos);
  for (std::uint32_t number = 1; number < 1000; ++number) deliver(number, {1, 2, 3, 1, 0, 0, 0});
  EXPECT_EQ(bench.session.kept_poses()->size(), 256U) << "a server cannot fill a client";
  EXPECT_EQ(bench.state(), "active");
}

/// Calls `act`. Returns the answers to pose requests as text: the name of each request with its tag.
std::string answers_after(test::SessionBench& bench, const std::function<void()>& act) {
  bench.answers.clear();
  act();
  bench.session.poll(bench.now);
  std::string answers;
  for (const event::PoseAnswered& event : bench.answers) {
    const wire::ServerControl& answer = event.answer;
    answers +=
        std::to_string(event.tag) + ": " +
        (answer.has_error() ? "error " + answer.error().text() : "answer " + std::to_string(answer.message_case()));
    if (event.minimising.steps() > 0) answers += " after " + std::to_string(event.minimising.steps()) + " steps";
    answers += ";";
  }
  return answers;
}

TEST(ClientSession, ARequestAboutPosesIsAnsweredOnceAndByItsNumber) {
  test::SessionBench bench;
  const auto minimise = [&bench](std::uint32_t tag) {
    bench.session.send(pose_command(wire::AskPose::MINIMISE, 0, {}, tag), bench.now);
  };
  EXPECT_EQ(answers_after(bench, [&] { minimise(5); }), "5: error not in a room: ;");
  bench.join();
  const auto number = [&bench] { return bench.transport.messages.back().request(); };
  const auto taken = [](std::uint32_t request) {
    wire::ServerControl message;
    message.set_request(request);
    message.mutable_pose_taken()->set_text("ada: to the minimum nearby");
    return message;
  };
  const std::string none = answers_after(bench, [&] {
    minimise(6);
    bench.session.send(command::Point{}, bench.now);
    bench.deliver(taken(number()));
    bench.deliver(taken(0));
  });
  EXPECT_EQ(none, "") << "another request's answer, and news";
  wire::ServerControl progress;
  progress.mutable_pose_progress()->set_user(3);
  progress.mutable_pose_progress()->set_steps(7);
  progress.mutable_pose_progress()->set_max_steps(201);
  progress.mutable_pose_progress()->set_is_over(true);
  const std::string one = answers_after(bench, [&] {
    minimise(7);
    bench.deliver(progress);
    const auto request = number();
    bench.deliver(taken(request));
    bench.deliver(taken(request));
  });
  EXPECT_EQ(one, "7: answer " + std::to_string(wire::ServerControl::kPoseTaken) + " after 7 steps;");
}

TEST(ClientSession, ARequestAboutPosesIsAnsweredWithAnErrorWhenTheConnectionIsLostOrLeft) {
  const std::map<std::string, std::function<void(test::SessionBench&)>> ends{
      {"unplugged", [](auto& bench) { bench.session.on_disconnected(bench.now, "unplugged"); }},
      {"left", [](auto& bench) { bench.session.leave(bench.now); }},
      {"going to room attic", [](auto& bench) { bench.session.send(command::ChangeRoom{"attic"}, bench.now); }}};
  for (const auto& [why, end] : ends) {
    test::SessionBench bench;
    bench.join();
    const std::string answers = answers_after(bench, [&, &leave = end] {
      for (const std::uint32_t tag : {8U, 0U, 9U}) {
        bench.session.send(pose_command(wire::AskPose::KEEP, 0, {}, tag), bench.now);
      }
      leave(bench);
      leave(bench);
    });
    const std::string error = "error not in a room: " + why + ";";
    EXPECT_EQ(answers, "8: " + error + "9: " + error);
  }
}

TEST(ClientSession, EventsTellOfEachStateAndEachRefusalInTheirOrder) {
  test::SessionBench bench;
  bench.join();
  bench.deliver_error(wire::ERROR_NOT_ALLOWED, "no");
  bench.session.leave(bench.now);
  using enum SessionState;
  EXPECT_EQ(bench.states, (std::vector{kConnecting, kGreeting, kJoining, kActive, kEnded}));
  EXPECT_EQ(bench.refused, std::vector{wire::ERROR_NOT_ALLOWED});
  EXPECT_EQ(bench.news, "refused: no");
}

TEST(ClientSession, KeptPosesAreRenamedAndDeletedAndNoMessageLeavesAHole) {
  test::SessionBench bench;
  begin_joining(bench);
  bench.deliver_joined(test::minimal_joined());
  const auto deliver = [&bench](std::uint32_t number, const std::string& name) {
    wire::ServerControl message;
    message.mutable_kept_pose()->set_number(number);
    message.mutable_kept_pose()->set_name(name);
    for (const double each : {1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0}) message.mutable_kept_pose()->add_in_first(each);
    bench.deliver(message);
  };
  const auto deliver_deleted = [&bench](std::uint32_t number) {
    wire::ServerControl message;
    message.mutable_pose_deleted()->set_number(number);
    bench.deliver(message);
  };
  const auto names = [&bench] {
    std::string text;
    for (const wire::KeptPose& pose : *bench.session.kept_poses())
      text += std::to_string(pose.number()) + " " + pose.name() + ", ";
    return text;
  };
  deliver_deleted(1);
  EXPECT_EQ(bench.session.kept_poses(), nullptr);
  for (const std::uint32_t number : {0U, 1U, 4U, 9U}) deliver(number, "pose");
  deliver(4, "bound \x1b[31m");
  deliver(0, "not the files'");
  deliver(3, "too late");
  EXPECT_EQ(names().find('\x1b'), std::string::npos);
  deliver(4, "bound");
  EXPECT_EQ(names(), "0 pose, 1 pose, 4 bound, 9 pose, ");
  for (const std::uint32_t number : {0U, 1U, 1U, 9U, 4'000'000'000U}) deliver_deleted(number);
  EXPECT_EQ(names(), "0 pose, 4 bound, ");
  deliver(12, "another");
  EXPECT_EQ(names(), "0 pose, 4 bound, 12 another, ");
  EXPECT_EQ(bench.state(), "active");
}

TEST(ClientSession, TheProgressOfAMinimisationIsThereUntilItIsOver) {
  test::SessionBench bench;
  begin_joining(bench);
  bench.deliver_joined(test::minimal_joined());
  const auto deliver = [&bench](std::uint32_t max_steps, double energy, bool is_over) {
    wire::ServerControl message;
    message.mutable_pose_progress()->set_steps(3);
    message.mutable_pose_progress()->set_max_steps(max_steps);
    message.mutable_pose_progress()->set_energy_kj_per_mol(energy);
    message.mutable_pose_progress()->set_is_over(is_over);
    bench.deliver(message);
  };
  deliver(201, -3, false);
  ASSERT_TRUE(bench.session.pose_progress());
  EXPECT_EQ(bench.session.pose_progress()->steps(), 3U);
  for (const auto& [max_steps, is_over] : {std::pair(201U, true), {0U, false}}) {
    deliver(201, -3, false);
    deliver(max_steps, -3, is_over);
    EXPECT_FALSE(bench.session.pose_progress());
  }
  EXPECT_EQ(bench.state(), "active");
  deliver(201, std::nan(""), false);
  EXPECT_EQ(bench.state(), "waiting") << "no control message has a number that is not finite (WIRE.md)";
}

TEST(ClientSession, APlaceThatIsPointedAtIsOfSomebodyHereAndIsShownToTheHand) {
  test::SessionBench bench;
  begin_joining(bench);
  bench.deliver_joined(test::minimal_joined());
  wire::ServerControl joined;
  joined.mutable_user_joined()->set_user(7);
  joined.mutable_user_joined()->set_name("ben");
  bench.deliver(joined);
  const auto places = [&] {
    bench.mailboxes.scene.poll();
    return bench.mailboxes.scene.front().places_shown;
  };
  const auto deliver = [&](std::uint32_t user, std::uint32_t body, double far, int numbers = 3) {
    wire::ServerControl message;
    wire::Pointed& pointed = *message.mutable_pointed();
    pointed.set_user(user);
    pointed.mutable_point()->set_body(body);
    for (int i = 0; i < numbers; ++i) {
      pointed.mutable_point()->add_place(far);
      pointed.mutable_point()->add_place_w(2 * far);
    }
    bench.deliver(message);
  };
  deliver(8, 0, 0.1);     // unknown user
  deliver(7, 99, 0.1);    // unknown body
  deliver(7, 0, 1e9);     // out of range
  deliver(7, 0, 0.1, 2);  // two coordinates instead of three
  EXPECT_EQ(bench.session.pointed().size(), 0U);
  EXPECT_EQ(places(), 0U);
  deliver(7, 0, 0.1);
  deliver(7, 0, 0.2);
  ASSERT_EQ(bench.session.pointed().size(), 1U) << "the last of each user";
  EXPECT_EQ(bench.session.pointed()[0].second.point().place(1), 0.2);
  EXPECT_EQ(places(), 1U) << "seen at once, felt once in a while";
  EXPECT_EQ(bench.mailboxes.scene.front().shown_W, Vec3::Constant(0.2));
  deliver(test::minimal_joined().user(), 0, 0.3);
  EXPECT_EQ(bench.session.pointed().size(), 2U);
  bench.now += JoinedScene::kNudgeEvery;
  deliver(test::minimal_joined().user(), 0, 0.3);
  EXPECT_EQ(places(), 1U) << "a position shown by this user must not nudge this user";
  EXPECT_EQ(bench.state(), "active");
}

TEST(ClientSession, PlacesThatOthersPointAtNudgeTheHandRarelyAndAMutedOneNever) {
  std::mt19937_64 random(test::test_seed(4));
  const auto below = [&random](std::uint32_t limit) {
    return std::uniform_int_distribution<std::uint32_t>(0, limit - 1)(random);
  };
  for (int round = 0; round < 50; ++round) {
    SessionSettings settings;
    settings.has_nudges = below(3) > 0;
    settings.silence_timeout = std::chrono::hours(1);
    test::SessionBench bench(settings);
    bench.join();
    for (std::uint32_t user = 10; user < 13; ++user) {
      wire::ServerControl joined;
      joined.mutable_user_joined()->set_user(user);
      joined.mutable_user_joined()->set_name("user");
      bench.deliver(joined);
    }
    std::vector<LocalTime> nudges;
    std::uint32_t known = 0;
    bool was_felt = false;
    bool is_muted = !settings.has_nudges;
    for (int i = 0; i < 400; ++i) {
      bench.now += std::chrono::milliseconds(below(400));
      if (below(100) == 0) {
        is_muted = !is_muted;
        bench.session.send(command::SetNudges{!is_muted}, bench.now);
      }
      wire::ServerControl message;
      was_felt = was_felt || !is_muted;
      message.mutable_pointed()->set_user(10 + below(3));
      for (int axis = 0; axis < 3; ++axis) {
        message.mutable_pointed()->mutable_point()->add_place(0.1);
        message.mutable_pointed()->mutable_point()->add_place_w(0.1 * i);
      }
      bench.deliver(message);
      EXPECT_FALSE(bench.session.pointed().empty()) << "it is seen, muted or not";
      bench.mailboxes.scene.poll();
      const std::uint32_t places = bench.mailboxes.scene.front().places_shown;
      EXPECT_LE(places, known + (is_muted ? 0 : 1));
      if (places != known) nudges.push_back(bench.now);
      known = places;
    }
    for (std::size_t i = 1; i < nudges.size(); ++i) EXPECT_GE(nudges[i] - nudges[i - 1], std::chrono::seconds(5));
    EXPECT_EQ(nudges.empty(), !was_felt) << "the first one that is not muted is felt";
  }
}

}  // namespace
}  // namespace tandem::client
