// Tests requests for saved poses: limits per user and room, deletion, renaming, minimisation in slices, cancellation,
// and refusal at the stop of the server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/server/docking/pose_bench.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

TEST_F(PoseKeeperTest, UserAndRoomHaveBudgetsAndDeletingGivesThemBack) {
  start("");
  const auto keep = [this](const std::string& user) {
    user_name_ = user;
    return submit(wire::AskPose::KEEP);
  };
  std::size_t number = 0;
  for (const char* user : {"ada", "ben", "cleo", "dora"}) {
    for (std::size_t i = 0; i < kMaxKeptPosesOfUser; ++i) ASSERT_EQ(keep(user).kept_pose().number(), ++number);
    if (number < kMaxKeptPoses) {
      EXPECT_THAT(keep(user).error().text(),
                  HasSubstr("you have kept 50 poses in this room, and a user keeps at most 50; "
                            "delete one of yours"));
    }
  }
  EXPECT_THAT(keep("eve").error().text(), HasSubstr("has kept 200 poses, and keeps no more; delete some"));
  EXPECT_EQ(keeper_->kept(room()).size(), kMaxKeptPoses + 1);
  EXPECT_EQ(submit(wire::AskPose::GO_TO, kMaxKeptPoses).message_case(), wire::ServerControl::kPoseTaken);
  EXPECT_EQ(submit(wire::AskPose::DELETE, 77).pose_deleted().number(), 77U);
  EXPECT_EQ(keep("eve").kept_pose().number(), 201U) << "no number is used twice";
  EXPECT_THAT(keep("ada").error().text(), HasSubstr("keeps no more"));
}

TEST_F(PoseKeeperTest, AUserWaitsForAnswersBeforeAskingMore) {
  wire::AskPose request;
  for (std::size_t i = 0; i < kMaxPoseRequestsOfUser; ++i)
    EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 1, request), "");
  EXPECT_THAT(keeper_->submit(room(), UserId{7}, "ada", 1, request), HasSubstr("4 of your requests wait"));
  std::uint32_t user = 8;
  for (std::size_t i = kMaxPoseRequestsOfUser; i < kMaxPoseRequestsOfRoom; ++i)
    EXPECT_EQ(keeper_->submit(room(), UserId{user++}, "ben", 1, request), "");
  EXPECT_THAT(keeper_->submit(room(), UserId{user}, "cleo", 1, request), HasSubstr("32 requests of this room wait"));
}

TEST_F(PoseKeeperTest, ADeletedPoseIsGoneWithItsFilesAndItsNumberIsNotUsedAgain) {
  for (int i = 0; i < 3; ++i) submit(wire::AskPose::KEEP);
  EXPECT_EQ(submit(wire::AskPose::DELETE, 3).pose_deleted().number(), 3U);
  EXPECT_EQ(submit(wire::AskPose::DELETE, 1).pose_deleted().user(), 7U);
  EXPECT_THAT(submit(wire::AskPose::DELETE, 1).error().text(), HasSubstr("no pose has that number"));
  EXPECT_THAT(submit(wire::AskPose::GO_TO, 1).error().text(), HasSubstr("no pose has that number"));
  EXPECT_THAT(submit(wire::AskPose::DELETE, 0).error().text(), HasSubstr("the files themselves stays"));
  EXPECT_EQ(structure_files(), (std::vector<std::string>{"2.cif", "2.pdb"}));
  // If a server is killed after it wrote its list, structure files of deleted poses may be left over. The next server
  // must remove these files, but no other file of the folder.
  for (const char* file : {"1.cif", "3.pdb"}) std::ofstream(list_folder() / file) << "left over";
  for (const char* file : {"notes.pdb", "01.cif", "7.cif"}) std::ofstream(list_folder() / file) << "somebody's own";
  start(folder_);
  ASSERT_EQ(keeper_->kept(room()).size(), 2U);
  EXPECT_EQ(keeper_->kept(room())[1].number(), 2U);
  EXPECT_EQ(submit(wire::AskPose::KEEP).kept_pose().number(), 4U) << "3 was used";
  submit(wire::AskPose::DELETE, 4);
  EXPECT_EQ(structure_files(), (std::vector<std::string>{"01.cif", "2.cif", "2.pdb", "7.cif", "notes.pdb"}));
}

TEST_F(PoseKeeperTest, ARenamedPoseHasItsNameInEveryListAfterARestartToo) {
  for (int i = 0; i < 2; ++i) submit(wire::AskPose::KEEP);
  const wire::KeptPose before = keeper_->kept(room())[1];
  const wire::ServerControl reply = submit(wire::AskPose::RENAME, 1, "bound");
  EXPECT_EQ(reply.kept_pose().name(), "bound");
  EXPECT_FALSE(reply.kept_pose().is_news());
  EXPECT_THAT(submit(wire::AskPose::RENAME, 9, "x").error().text(), HasSubstr("no pose has that number"));
  EXPECT_THAT(submit(wire::AskPose::RENAME, 0, "x").error().text(), HasSubstr("keeps its name"));
  std::stringstream csv;
  csv << std::ifstream(list_folder() / "poses.csv").rdbuf();
  EXPECT_THAT(csv.str(), HasSubstr(",\"bound\",\"ada\","));
  EXPECT_THAT(csv.str(), testing::Not(HasSubstr("pose 1")));
  start(folder_);
  ASSERT_EQ(keeper_->kept(room()).size(), 3U);
  wire::KeptPose after = keeper_->kept(room())[1];
  EXPECT_EQ(after.name(), "bound");
  after.set_name(before.name());
  EXPECT_EQ(after.SerializeAsString(), before.SerializeAsString());
}

TEST_F(PoseKeeperTest, ALongMinimisationLetsTheRequestsOfAnotherRoomInAndTellsHowFarItIs) {
  keeper_.reset();
  rooms_.clear();
  for (const char* name : {"a room", "another room"})
    rooms_.push_back(std::make_unique<Room>(RoomId{1}, name, helices()));
  keeper_ = std::make_unique<PoseKeeper>(folder_, rooms_, [] { return 1'700'000'000'000ULL; });
  for (const auto& each : rooms_) {
    ASSERT_TRUE(each->post({.seat = {0, UserId{9}, UserRole::kManipulator, 0}}));
    each->step(ServerTime{});
  }
  wire::AskPose request;
  request.set_kind(wire::AskPose::MINIMISE);
  EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 1, request), "");
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(keeper_->work_slice());
  request.set_kind(wire::AskPose::KEEP);
  EXPECT_EQ(keeper_->submit(*rooms_[1], UserId{9}, "ben", 2, request), "");
  EXPECT_EQ(keeper_->submit(room(), UserId{8}, "cleo", 3, request), "") << "in the same room";
  std::vector<std::uint32_t> answered;
  bool is_reported = false;
  for (int slice = 0; slice < 10 && answered.size() < 2; ++slice) {
    keeper_->work_slice();
    keeper_->deliver([&](const Room& of, UserId, const wire::ServerControl& answer, const RoomCommand*) {
      if (answer.has_kept_pose()) answered.push_back(answer.request());
      is_reported = is_reported || (&of == &room() && answer.has_pose_progress() && !answer.pose_progress().is_over());
      EXPECT_FALSE(answer.has_pose_taken()) << "it is still under way";
      return true;
    });
  }
  EXPECT_THAT(answered, testing::UnorderedElementsAre(2U, 3U));
  EXPECT_TRUE(is_reported);
}

TEST_F(PoseKeeperTest, ACancelledMinimisationDoesNotMoveTheMolecules) {
  const auto begin = [this] {
    wire::AskPose request;
    request.set_kind(wire::AskPose::MINIMISE);
    EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 31, request), "");
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(keeper_->work_slice());
  };
  const Pose X = pose();
  const auto end = [this] {
    keeper_->work();
    return serve().error().text();
  };
  begin();
  EXPECT_FALSE(keeper_->cancel(room(), UserId{8}, "cancelled")) << "another user's";
  EXPECT_TRUE(keeper_->cancel(room(), UserId{7}, "cancelled"));
  EXPECT_FALSE(keeper_->cancel(room(), UserId{7}, "cancelled")) << "it is already";
  EXPECT_EQ(end(), "cancelled");
  begin();
  EXPECT_TRUE(keeper_->cancel(room(), std::nullopt, "reset"));
  EXPECT_EQ(end(), "reset");
  begin();
  keeper_->forget(room(), UserId{7});
  EXPECT_THAT(end(), HasSubstr("has left"));
  // Cancels a minimisation that is already complete, while its answer is still in the queue. The molecule must not
  // move.
  begin();
  keeper_->work();
  EXPECT_TRUE(keeper_->cancel(room(), UserId{7}, "cancelled"));
  EXPECT_EQ(serve().error().text(), "cancelled");
  step(20);
  EXPECT_LT(apart_angstrom(pose(), X), 0.1);
  EXPECT_THAT(submit(wire::AskPose::MINIMISE).pose_taken().text(), HasSubstr("minimum nearby"))
      << "and another is served";
}

TEST_F(PoseKeeperTest, AMinimisationEndsWhenAUserBringsTheMoleculesElsewhere) {
  submit(wire::AskPose::KEEP);
  wire::AskPose request;
  request.set_kind(wire::AskPose::MINIMISE);
  EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 1, request), "");
  keeper_->work_slice();
  EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 2, request), "");
  request.set_kind(wire::AskPose::GO_TO);
  request.set_number(1);
  EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 3, request), "");
  keeper_->work();
  std::map<std::uint32_t, wire::ServerControl> answers;
  keeper_->deliver([&](const Room&, UserId, const wire::ServerControl& answer, const RoomCommand*) {
    if (answer.request() != 0) answers[answer.request()] = answer;
    return true;
  });
  EXPECT_THAT(answers[1].error().text(), HasSubstr("ada has moved the molecules"));
  EXPECT_THAT(answers[2].error().text(), HasSubstr("a minimisation of ada is under way"));
  EXPECT_TRUE(answers[3].has_pose_taken());
}

TEST_F(PoseKeeperTest, PendingRequestsAreRefusedWhenTheServerStops) {
  submit(wire::AskPose::KEEP);
  wire::AskPose request;
  for (const auto kind : {wire::AskPose::MINIMISE, wire::AskPose::KEEP, wire::AskPose::DELETE}) {
    request.set_kind(kind);
    request.set_number(1);
    EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 10 + static_cast<std::uint32_t>(kind), request), "");
    if (kind == wire::AskPose::MINIMISE) keeper_->work_slice();
  }
  keeper_->begin_stop();
  EXPECT_THAT(keeper_->submit(room(), UserId{7}, "ada", 99, request), HasSubstr("the server is stopping"));
  EXPECT_EQ(keeper_->unanswered(), 3U);
  keeper_->work();
  std::vector<std::uint32_t> refused;
  keeper_->deliver([&](const Room&, UserId, const wire::ServerControl& answer, const RoomCommand*) {
    if (answer.has_error()) refused.push_back(answer.request());
    return true;
  });
  EXPECT_THAT(refused, testing::UnorderedElementsAre(10U, 14U, 15U));
  EXPECT_EQ(keeper_->unanswered(), 0U);
  keeper_->finish();
  EXPECT_EQ(structure_files(), (std::vector<std::string>{"1.cif", "1.pdb"}));
}

TEST_F(PoseKeeperTest, ARefusedRequestGetsNoSecondAnswerFromWorkThatWasDone) {
  move({0, 0, 4}, 1200);
  wire::AskPose request;
  for (const auto kind : {wire::AskPose::KEEP, wire::AskPose::UNDO}) {
    request.set_kind(kind);
    EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 20 + static_cast<std::uint32_t>(kind), request), "");
  }
  keeper_->work();  // both answers are queued until deliver() is called
  std::vector<std::uint32_t> answered;
  keeper_->refuse_unanswered([&](const Room&, UserId, std::uint32_t number) { answered.push_back(number); });
  ASSERT_EQ(answered.size(), 2U);
  keeper_->deliver([&](const Room&, UserId, const wire::ServerControl& answer, const RoomCommand* placing) {
    EXPECT_EQ(placing, nullptr) << "a refused request moves no molecule";
    answered.push_back(answer.request());
    return true;
  });
  EXPECT_THAT(answered, testing::UnorderedElementsAre(20U + wire::AskPose::KEEP, 20U + wire::AskPose::UNDO));
  EXPECT_EQ(keeper_->kept(room()).back().number(), 1U) << "the list is that of the files";
  EXPECT_EQ(structure_files(), (std::vector<std::string>{"1.cif", "1.pdb"}));
}

TEST_F(PoseKeeperTest, ADroppedRequestIsGivenUpOnceAndNotServedAfterTheRoomsEnd) {
  wire::AskPose request;
  EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 5, request), "");
  int refused = 0;
  keeper_->refuse_unanswered([&](const Room& of, UserId user, std::uint32_t number) {
    EXPECT_EQ(&of, &room());
    EXPECT_EQ(user, UserId{7});
    EXPECT_EQ(number, 5U);
    ++refused;
  });
  EXPECT_EQ(refused, 1);
  keeper_->finish();
  keeper_->work();
  EXPECT_EQ(structure_files(), std::vector<std::string>{});
}

}  // namespace
}  // namespace tandem::server
