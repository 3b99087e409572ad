#include "client/start/recent.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/client/start/some_invitation.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;

class Recent : public testing::Test {
 protected:
  fs::path folder_ = fs::path(testing::TempDir()) / "recent";
  fs::path file_ = folder_ / "recent.json";

  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  std::string stored() const {
    std::ifstream in(file_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string mesh(const std::string& name) const {
    std::ofstream(folder_ / name) << "x";
    return (folder_ / name).string();
  }
};

TEST_F(Recent, KeepsTheLastSixNewestFirstAndEachOnce) {
  const StartChoice first{
      .kind = StartChoice::Kind::kMesh, .mesh = mesh("a.stl"), .mesh_size_m = 0.2, .is_movable = true};
  remember_choice(file_, first);
  for (const char* name : {"wall", "free", "crate", "mass", "rim"}) remember_choice(file_, {.scene = name});
  remember_choice(file_, first);
  auto choices = recent_choices(file_);
  ASSERT_EQ(choices.size(), 6U);
  EXPECT_EQ(choices.front(), first);
  EXPECT_EQ(choices.back().scene, "wall");
  remember_choice(file_, {.scene = "curve"});
  EXPECT_EQ(recent_choices(file_).back().scene, "free");
}

TEST_F(Recent, ADeletedFileIsOmitted) {
  remember_choice(file_, {.kind = StartChoice::Kind::kMesh, .mesh = mesh("a.stl")});
  fs::remove(folder_ / "a.stl");
  EXPECT_TRUE(recent_choices(file_).empty());
}

TEST_F(Recent, AnInvitationIsNeverStored) {
  const std::string invitation = test::some_invitation("192.0.2.2:47800");
  remember_choice(file_, {.kind = StartChoice::Kind::kJoin, .address = invitation});
  EXPECT_FALSE(fs::exists(file_));
  remember_choice(file_, {.kind = StartChoice::Kind::kJoin, .address = "127.0.0.1:5000"});
  ASSERT_EQ(recent_choices(file_).size(), 1U);
}

TEST_F(Recent, OnlyTheFieldsOfItsKindAreStoredAndOnlyTheUserCanReadThem) {
  const StartChoice form{.kind = StartChoice::Kind::kMesh,
                         .scene = "/home/anna/other.json",
                         .mesh = mesh("a.stl"),
                         .receptor = "/home/anna/secret.pdb",
                         .address = test::some_invitation("192.0.2.2:47800"),
                         .invited = 3,
                         .port = 5000};
  remember_choice(file_, form);
  EXPECT_EQ(stored().find("192.0.2.2"), std::string::npos) << "a part of the invitation";
  EXPECT_EQ(stored().find("anna"), std::string::npos) << "a path of another choice";
  EXPECT_EQ(fs::status(file_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  remember_choice(file_, {.kind = StartChoice::Kind::kMesh, .mesh = form.mesh});
  EXPECT_EQ(recent_choices(file_).size(), 1U) << "an equal choice must not be stored twice";
}

TEST_F(Recent, APathThatIsNotUtf8DestroysNoOtherEntry) {
  remember_choice(file_, {.scene = "wall"});
  const std::string path = (folder_ / "caf\xe9.json").string();
  std::ofstream(path) << "{}";
  ASSERT_EQ(problem_of({.scene = path}), "") << "it can be opened";
  remember_choice(file_, {.scene = path});
  ASSERT_EQ(recent_choices(file_).size(), 1U);
  EXPECT_EQ(recent_choices(file_)[0].scene, "wall");
}

TEST_F(Recent, DamagedEntriesAreLeftOutAndNumbersClamped) {
  std::ofstream(file_)
      << R"([7, {"kind": "warp"}, {"kind": "scene", "scene": "wall", "is_hosted": true, "invited": 1e9, "port": "x"}])";
  const auto choices = recent_choices(file_);
  ASSERT_EQ(choices.size(), 1U);
  EXPECT_EQ(choices[0].invited, kMaxInvited);
  EXPECT_EQ(choices[0].port, StartChoice{}.port);
  std::ofstream(file_) << "[{";
  EXPECT_TRUE(recent_choices(file_).empty());
}

TEST_F(Recent, LongPathsNeverMakeTheFileUnreadable) {
  std::string deep = folder_.string();
  for (int i = 0; i < 4; ++i) deep += "/" + std::string(200, '"');  // each quotation mark takes two bytes in the file
  fs::create_directories(deep);
  for (char c = 'a'; c <= 'h'; ++c) {
    const std::string file = deep + "/" + std::string(60, c) + ".pdb";
    std::ofstream(file) << "x";
    remember_choice(file_, {.kind = StartChoice::Kind::kDock, .receptor = file, .ligand = file});
    ASSERT_FALSE(recent_choices(file_).empty());
    EXPECT_EQ(recent_choices(file_).front().receptor, file);
  }
}

}  // namespace
}  // namespace tandem::client
