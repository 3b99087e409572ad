// Tests that poses of two helices are saved, found again after a restart, and restored by undo and redo.
#include "server/docking/pose_keeper.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "tests/server/docking/pose_bench.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

TEST_F(PoseKeeperTest, UndoGoesBackToWhereItRestedAndRedoForwardAgain) {
  const Pose first = pose();
  move({0, 0, 0}, 700);
  move({5, 0, 0}, 700);
  const Pose second = pose();
  move({0, 5, 0}, 100);  // rests too briefly to become a rest pose
  const Pose third = pose();
  EXPECT_THAT(submit(wire::AskPose::UNDO).pose_taken().text(), HasSubstr("ada: back"));
  EXPECT_LT(apart_angstrom(pose(), second), 0.2);
  submit(wire::AskPose::UNDO);
  EXPECT_LT(apart_angstrom(pose(), first), 0.2);
  EXPECT_THAT(submit(wire::AskPose::UNDO).error().text(), HasSubstr("nothing to go back to"));
  submit(wire::AskPose::REDO);
  EXPECT_LT(apart_angstrom(pose(), second), 0.2);
  submit(wire::AskPose::REDO);
  EXPECT_LT(apart_angstrom(pose(), third), 0.2) << "where it was when it was sent back";
  EXPECT_THAT(submit(wire::AskPose::REDO).error().text(), HasSubstr("nothing to go forward to"));
  submit(wire::AskPose::UNDO);
  move({0, 0, 4}, 700);
  EXPECT_THAT(submit(wire::AskPose::REDO).error().text(), HasSubstr("nothing to go forward to")) << "it went elsewhere";
}

TEST_F(PoseKeeperTest, ARequestDuringAPlacementWaitsForIt) {
  const Pose first = pose();
  move({0, 0, 0}, 700);
  move({5, 0, 0}, 700);
  move({0, 5, 0}, 700);
  const Pose third = pose();
  for (const auto kind : {wire::AskPose::UNDO, wire::AskPose::REDO}) {
    wire::AskPose request;
    request.set_kind(kind);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(keeper_->submit(room(), UserId{7}, "ada", 31, request), "");
    keeper_->work();
    // Both requests move the molecule. The room has not stepped, so the first move is not executed yet. The second
    // request must wait for it.
    keeper_->work();
    EXPECT_TRUE(serve().has_pose_taken());
    EXPECT_TRUE(serve().has_pose_taken());
    EXPECT_LT(apart_angstrom(pose(), kind == wire::AskPose::UNDO ? first : third), 0.2);
  }
}

TEST_F(PoseKeeperTest, WhatABusyRoomWasNotToldLeavesTheTrailAsItWas) {
  move({0, 0, 0}, 700);
  move({5, 0, 0}, 700);
  const Pose second = pose();
  submit(wire::AskPose::UNDO);
  const Pose first = pose();
  is_busy_ = true;
  submit(wire::AskPose::REDO);
  EXPECT_LT(apart_angstrom(pose(), first), 0.1);
  is_busy_ = false;
  EXPECT_TRUE(submit(wire::AskPose::REDO).has_pose_taken());
  EXPECT_LT(apart_angstrom(pose(), second), 0.2);
}

TEST_F(PoseKeeperTest, TheFirstIsMovedWhereTheSecondIsStatic) {
  start(folder_, load_helices({1}));
  const Pose X_WB = room().world().body(BodyId{2}).X;
  EXPECT_TRUE(submit(wire::AskPose::GO_TO, 0).has_pose_taken());
  EXPECT_EQ(room().world().body(BodyId{2}).X.p, X_WB.p);
  EXPECT_LT(submit(wire::AskPose::KEEP).kept_pose().rmsd_angstrom(), 0.1);
  start(folder_, load_helices({0, 1}));
  EXPECT_TRUE(submit(wire::AskPose::KEEP).has_kept_pose());
  EXPECT_THAT(submit(wire::AskPose::GO_TO, 0).error().text(), HasSubstr("neither molecule moves"));
}

TEST_F(PoseKeeperTest, OfTwoServersWithOneFolderNoneWritesOverTheOthers) {
  std::vector<std::unique_ptr<Room>> rooms;
  rooms.push_back(std::make_unique<Room>(RoomId{1}, "a room", helices()));
  PoseKeeper other(folder_, rooms, [] { return 1ULL; });
  ASSERT_TRUE(rooms[0]->post({.seat = {0, UserId{7}, UserRole::kManipulator, 0}}));
  rooms[0]->step(ServerTime{});
  EXPECT_EQ(submit(wire::AskPose::KEEP).kept_pose().number(), 1U);
  const auto request_other = [&] {
    wire::AskPose request;
    request.set_kind(wire::AskPose::KEEP);
    EXPECT_EQ(other.submit(*rooms[0], UserId{7}, "ada", 31, request), "");
    other.work();
    wire::ServerControl reply;
    other.deliver([&reply](const Room&, UserId, const wire::ServerControl& answer, const RoomCommand*) {
      reply = answer;
      return true;
    });
    return reply;
  };
  EXPECT_THAT(request_other().error().text(), HasSubstr("another server keeps poses in that folder"));
  keeper_.reset();
  EXPECT_THAT(request_other().error().text(), HasSubstr("has kept poses in that folder"));
}

TEST_F(PoseKeeperTest, ARoomOfAnotherNameHasAnotherFolder) {
  submit(wire::AskPose::KEEP);
  std::vector<std::unique_ptr<Room>> rooms;
  for (const char* name : {"a_room", "a room"}) rooms.push_back(std::make_unique<Room>(RoomId{1}, name, helices()));
  const PoseKeeper other(folder_, rooms, [] { return 1ULL; });
  EXPECT_EQ(other.kept(*rooms[0]).size(), 1U);
  EXPECT_EQ(other.kept(*rooms[1]).size(), 2U);
}

TEST_F(PoseKeeperTest, AKeptPoseIsCountedWrittenAndReadAgain) {
  ASSERT_EQ(keeper_->kept(room()).size(), 1U);
  EXPECT_EQ(keeper_->kept(room())[0].rmsd_angstrom(), 0);
  EXPECT_GT(keeper_->kept(room())[0].contacts(), 10U) << "the files have them together";
  const wire::KeptPose apart = submit(wire::AskPose::KEEP, 0, "a \"first\" one").kept_pose();
  EXPECT_EQ(apart.number(), 1U);
  EXPECT_EQ(apart.user_name(), "ada");
  EXPECT_EQ(apart.contacts(), 0U);
  EXPECT_NEAR(apart.rmsd_angstrom(), 8, 3) << "the scene separates the molecules";
  EXPECT_EQ(submit(wire::AskPose::KEEP).kept_pose().name(), "pose 2");
  std::filesystem::path list;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    if (entry.path().filename() == "poses.csv") list = entry.path();
  }
  for (const char* file : {"1.cif", "1.pdb", "2.cif", "poses.json"}) {
    EXPECT_TRUE(std::filesystem::exists(list.parent_path() / file)) << file;
  }
  std::ifstream in(list);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_THAT(text.str(), HasSubstr("1,1700000000000,\"a \"\"first\"\" one\",\"ada\","));
  start(folder_);
  ASSERT_EQ(keeper_->kept(room()).size(), 3U);
  EXPECT_EQ(keeper_->kept(room())[1].name(), "a \"first\" one");
  move({9, 0, 0}, 20);
  submit(wire::AskPose::GO_TO, 1);
  EXPECT_NEAR(helices()->world.metres_per_angstrom * apart.in_first(0), pose().p.x(), 1e-3);
  EXPECT_EQ(submit(wire::AskPose::KEEP).kept_pose().number(), 3U) << "counted on";
}

TEST_F(PoseKeeperTest, TheMinimumNearbyIsTheFilesOwn) {
  submit(wire::AskPose::GO_TO, 0);
  const wire::ServerControl reply = submit(wire::AskPose::MINIMISE);
  EXPECT_THAT(reply.pose_taken().text(), HasSubstr("to the minimum nearby, -"));
  const wire::KeptPose found = submit(wire::AskPose::KEEP).kept_pose();
  EXPECT_LT(found.rmsd_angstrom(), 1.0);
  EXPECT_LT(found.lj_kj_per_mol() + found.coulomb_kj_per_mol(),
            keeper_->kept(room())[0].lj_kj_per_mol() + keeper_->kept(room())[0].coulomb_kj_per_mol());
  submit(wire::AskPose::UNDO);
  EXPECT_LT(submit(wire::AskPose::KEEP).kept_pose().rmsd_angstrom(), 0.1);
}

TEST_F(PoseKeeperTest, AFileThatIsNotAListIsNotChanged) {
  submit(wire::AskPose::KEEP);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    if (entry.path().filename() == "poses.json")
      std::ofstream(entry.path()) << R"({"poses": [{"number": 1, "inFirst": [1, 2]}]})";
  }
  start(folder_);
  EXPECT_EQ(keeper_->kept(room()).size(), 1U);
  EXPECT_THAT(submit(wire::AskPose::KEEP).error().text(), HasSubstr("poses.json is no list of poses"));
  EXPECT_EQ(keeper_->kept(room()).size(), 1U);
  start(folder_);
  EXPECT_THAT(submit(wire::AskPose::KEEP).error().text(), HasSubstr("poses.json is no list"))
      << "the invalid file must remain";
}

TEST_F(PoseKeeperTest, FieldsOfANewerServerDoNotLoseTheList) {
  submit(wire::AskPose::KEEP, 0, "mine");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    if (entry.path().filename() != "poses.json") continue;
    std::stringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    std::ofstream(entry.path()) << R"({"colour": "blue", )" << text.str().substr(1);
  }
  start(folder_);
  ASSERT_EQ(keeper_->kept(room()).size(), 2U);
  EXPECT_EQ(keeper_->kept(room())[1].name(), "mine");
  EXPECT_EQ(submit(wire::AskPose::KEEP).kept_pose().number(), 2U);
}

}  // namespace
}  // namespace tandem::server
