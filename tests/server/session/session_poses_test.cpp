// Tests permissions and rate limits of pose requests, and the messages that other users receive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/assets/docking_scene.hpp"
#include "server/docking/pose_keeper.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

const std::string& helices_json() {
  static const std::string kJson = [] {
    wire::Scene scene = docking_scene(molecule_source(std::string(test::k3al1File) + ":A", ""),
                                      molecule_source(std::string(test::k3al1File) + ":B", ""), wire::MolecularField());
    wire::Tool& third = *scene.add_tools();
    third.set_name("third");
    for (const double number : {0.3, 0.0, 0.0}) third.mutable_placement()->add_position_m(number);
    scene.mutable_limits()->set_observers(2);
    return scene_text(scene);
  }();
  return kJson;
}

class SessionPosesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
    // PoseKeeper needs the rooms of the bench, and the hub needs PoseKeeper. The hub of the bench is therefore
    // replaced.
    bench_ = std::make_unique<test::HubBench>(HubSettings{}, std::vector<std::string>{helices_json()});
    bench_->hub.reset();
    keeper_ = std::make_unique<PoseKeeper>("", bench_->rooms, [] { return 1'700'000'000'000ULL; });
    HubSettings settings;
    settings.poses = keeper_.get();
    settings.silence_timeout = std::chrono::hours(1);  // the users of this test send no state and must not time out
    settings.connection_ids = [ids = Random(1)]() mutable { return ids.next_u64(); };
    bench_->hub =
        std::make_unique<SessionHub>(settings, std::vector<Room*>{bench_->rooms.front().get()}, bench_->transport);
    ada_ = bench_->join("ada");
    ben_ = bench_->join("ben");
    step(20);
  }
  void TearDown() override {
    if (bench_) bench_->hub.reset();
  }

  void step(int ms) {
    for (int i = 0; i < ms; ++i) {
      bench_->step();
      if (!is_held_) keeper_->work();
    }
  }
  void send(const test::BenchClient& client, wire::AskPose::Kind kind, std::uint32_t number = 0,
            const std::string& name = "") {
    bench_->send(client, test::message_of([&](auto& message) {
                   message.mutable_ask_pose()->set_kind(kind);
                   message.mutable_ask_pose()->set_number(number);
                   message.mutable_ask_pose()->set_name(name);
                 }));
  }
  /// Sends a request and returns the answer that the requesting user receives.
  wire::ServerControl request(const test::BenchClient& client, wire::AskPose::Kind kind, std::uint32_t number = 0,
                              const std::string& name = "") {
    step(300);  // refills the user's token bucket
    for (const test::BenchClient* each : {&ada_, &ben_}) bench_->drain(*each);
    send(client, kind, number, name);
    step(20);
    wire::ServerControl answer;
    for (const wire::ServerControl& message : bench_->drain(client)) {
      if (message.request() == 42) answer = message;
    }
    return answer;
  }

  std::unique_ptr<test::HubBench> bench_;
  std::unique_ptr<PoseKeeper> keeper_;
  test::BenchClient ada_, ben_;
  bool is_held_ = false;
};

TEST_F(SessionPosesTest, APoseIsItsKeepersAndTheOperatorsAndEverybodysOnceTheKeeperHasLeft) {
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(request(ada_, wire::AskPose::KEEP).has_kept_pose());
  for (const auto kind : {wire::AskPose::DELETE, wire::AskPose::RENAME}) {
    EXPECT_THAT(request(ben_, kind, 1, "mine").error().text(), HasSubstr("ada kept that pose and is here"));
  }
  test::BenchClient olga = bench_->join("olga", wire::ROLE_OPERATOR);
  EXPECT_EQ(request(olga, wire::AskPose::DELETE, 1).pose_deleted().number(), 1U);
  EXPECT_EQ(request(ada_, wire::AskPose::RENAME, 2, "bound").kept_pose().name(), "bound");
  EXPECT_EQ(test::described(bench_->drain(ben_)), "kept_pose");
  EXPECT_EQ(request(ada_, wire::AskPose::DELETE, 3).pose_deleted().number(), 3U);
  EXPECT_EQ(test::described(bench_->drain(ben_)), "pose_deleted");
  bench_->hub->on_disconnected(ada_.handle, bench_->now);
  EXPECT_EQ(request(ben_, wire::AskPose::DELETE, 2).pose_deleted().number(), 2U);
  EXPECT_EQ(request(ben_, wire::AskPose::RENAME, 4, "").error().code(), wire::ERROR_BAD_NAME);
  const test::BenchClient newcomer = bench_->join("cleo", wire::ROLE_OBSERVER);
  std::vector<std::uint32_t> numbers;
  for (const wire::KeptPose& pose : keeper_->kept(*bench_->rooms.front())) numbers.push_back(pose.number());
  EXPECT_THAT(numbers, testing::ElementsAre(0U, 4U));
}

TEST_F(SessionPosesTest, OnlyTheRequestingUserAndTheOperatorCancelAMinimisation) {
  is_held_ = true;
  test::BenchClient olga = bench_->join("olga", wire::ROLE_OPERATOR);
  const auto begin = [&] {
    step(500);
    send(ada_, wire::AskPose::MINIMISE);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(keeper_->work_slice());
    step(5);
    bench_->drain(ada_);
  };
  begin();
  EXPECT_THAT(request(ben_, wire::AskPose::CANCEL).error().text(), HasSubstr("no minimisation of yours is under way"));
  const auto ended = [&] {
    keeper_->work();
    step(1);
    std::string text;
    for (const wire::ServerControl& message : bench_->drain(ada_)) text += message.error().text();
    return text;
  };
  EXPECT_TRUE(request(olga, wire::AskPose::CANCEL).pose_progress().is_over());
  EXPECT_THAT(ended(), HasSubstr("cancelled"));
  begin();
  bench_->send(olga, test::message_of([](auto& message) { message.mutable_reset_room(); }));
  EXPECT_THAT(ended(), HasSubstr("reset the room"));
  begin();
  bench_->hub->on_disconnected(ada_.handle, bench_->now);
  keeper_->work();
  step(1);
  EXPECT_EQ(keeper_->unanswered(), 0U);
}

TEST_F(SessionPosesTest, OneUsersFloodLeavesTheOthersTheirRequests) {
  for (int i = 0; i < 50; ++i) {
    send(ada_, wire::AskPose::UNDO);
    keeper_->work();
    step(1);
  }
  int busy = 0;
  for (const wire::ServerControl& message : bench_->drain(ada_))
    busy += message.error().text().find("at most 4 poses a second, 8 at once") != std::string::npos ? 1 : 0;
  EXPECT_GT(busy, 40);
  bench_->drain(ben_);
  send(ben_, wire::AskPose::KEEP);
  step(20);
  EXPECT_EQ(test::described(bench_->drain(ben_)), "kept_pose");
}

TEST_F(SessionPosesTest, AUserWithTooManyRequestsGetsTheAllowedRate) {
  bench_->drain(ada_);
  int served = 0;
  for (int i = 0; i < 250; ++i) {  // one request every 20 ms for 5 s
    send(ada_, wire::AskPose::GO_TO, 99);
    step(20);
    for (const wire::ServerControl& message : bench_->drain(ada_))
      served += message.error().text().find("poses a second") == std::string::npos;
  }
  EXPECT_NEAR(served, 8 + 5 * 4, 1);
}

TEST_F(SessionPosesTest, AStopRefusesPendingRequestsBeforeGoodbye) {
  is_held_ = true;
  bench_->drain(ada_);
  send(ada_, wire::AskPose::KEEP);
  send(ada_, wire::AskPose::MINIMISE);
  bench_->hub->begin_stop();
  EXPECT_TRUE(bench_->hub->owes_answers());
  bench_->hub->stop(bench_->now);
  EXPECT_EQ(test::described(bench_->drain(ada_)), "error ERROR_NOT_ALLOWED, error ERROR_NOT_ALLOWED, goodbye");
  EXPECT_FALSE(bench_->hub->owes_answers());
}

}  // namespace
}  // namespace tandem::server
