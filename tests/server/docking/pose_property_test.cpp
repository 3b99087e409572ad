// Tests random sequences of pose requests and restarts. Each request must get exactly one answer, and the poses that
// users receive must equal those in the files.
#include <gtest/gtest.h>

#include <map>

#include "common/base/random.hpp"
#include "tests/server/docking/pose_bench.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

class PoseSequences {
 public:
  PoseSequences(std::uint64_t seed, std::uint64_t stream, std::filesystem::path folder)
      : random_(seed, stream), folder_(std::move(folder)) {
    start();
  }

  void run(int acts) {
    for (int i = 0; i < acts && !::testing::Test::HasFailure(); ++i) {
      const std::uint64_t act = below(20);
      if (act < 9) submit_any();
      if (act >= 9 && act < 15) serve(below(12));
      if (act == 15) keeper_->cancel(room(), below(2) == 0 ? std::nullopt : std::optional(user()), "cancelled");
      if (act == 16) keeper_->forget(room(), user());
      if (act >= 17 && act < 19) deliver();
      if (act == 19 && below(4) == 0) restart();
    }
    restart();
  }

 private:
  std::uint64_t below(std::uint64_t end) { return random_.next_u64() % end; }
  Room& room() { return *rooms_[below(rooms_.size())]; }
  UserId user() { return UserId{static_cast<std::uint32_t>(1 + below(3))}; }

  void start() {
    for (const char* name : {"one", "two"}) {
      rooms_.push_back(std::make_unique<Room>(RoomId{1}, name, helices()));
      EXPECT_TRUE(rooms_.back()->post({.seat = {0, UserId{1}, UserRole::kManipulator, 0}}));
    }
    keeper_ = std::make_unique<PoseKeeper>(folder_, rooms_, [this] { return ++clock_ms_; });
    for (const auto& each : rooms_) {
      each->step(ServerTime{});
      EXPECT_EQ(text_of(keeper_->kept(*each)), text_of(lists_[each->name()])) << "after a start";
    }
  }

  void submit_any() {
    const Room& of = room();
    const UserId by = user();
    wire::AskPose request;
    request.set_kind(static_cast<wire::AskPose::Kind>(below(9)));  // includes one unknown kind
    if (request.kind() == wire::AskPose::CANCEL) return;
    request.set_number(static_cast<std::uint32_t>(below(12)));
    request.set_name("name " + std::to_string(below(1000)));
    if (keeper_->submit(of, by, "user " + std::to_string(by.value), ++last_request_, request).empty())
      open_[last_request_] = {of.name(), by};
  }

  void serve(std::uint64_t slices) {
    for (std::uint64_t i = 0; i < slices; ++i) keeper_->work_slice();
  }

  void deliver() {
    keeper_->deliver([this](const Room& of, UserId by, const wire::ServerControl& answer, const RoomCommand* placing) {
      if (!answer.has_pose_progress()) {
        const auto found = open_.find(answer.request());
        EXPECT_NE(found, open_.end()) << "a second answer: " << answer.ShortDebugString();
        if (found == open_.end()) return false;
        EXPECT_EQ(found->second, std::pair(of.name(), by));
        open_.erase(found);
      }
      apply(lists_[of.name()], answer);
      if (placing == nullptr) return true;
      RoomCommand command = *placing;
      command.seat = {0, UserId{1}};
      return below(5) != 0 && const_cast<Room&>(of).post(command);
    });
    for (const auto& each : rooms_) {
      each->step(ServerTime{});
      EXPECT_EQ(text_of(keeper_->kept(*each)), text_of(lists_[each->name()]));
    }
  }

  /// Applies an answer of the server to a client's list of poses, which contains the name of each pose by its number.
  static void apply(std::map<std::uint32_t, std::string>& list, const wire::ServerControl& answer) {
    if (answer.has_kept_pose()) list[answer.kept_pose().number()] = answer.kept_pose().name();
    if (!answer.has_pose_deleted()) return;
    EXPECT_EQ(list.erase(answer.pose_deleted().number()), 1U);
  }

  void restart() {
    keeper_->begin_stop();
    for (int i = 0; i < 4; ++i) {
      keeper_->work();
      deliver();
    }
    EXPECT_EQ(open_.size(), 0U) << "without an answer";
    EXPECT_EQ(keeper_->unanswered(), 0U);
    keeper_->finish();
    for (const auto& each : rooms_) {
      const auto written = read_kept_poses(folder_ / kept_pose_folder(*each));
      ASSERT_TRUE(written);
      EXPECT_EQ(text_of(written->poses), text_of(lists_[each->name()])) << "in the file";
      for (const wire::KeptPose& pose : written->poses) {
        EXPECT_TRUE(
            std::filesystem::exists(folder_ / kept_pose_folder(*each) / (std::to_string(pose.number()) + ".cif")));
      }
    }
    keeper_.reset();
    rooms_.clear();
    start();
  }

  static std::string text_of(const std::map<std::uint32_t, std::string>& list) {
    std::string text;
    for (const auto& [number, name] : list) text += std::to_string(number) + " " + name + "\n";
    return text;
  }
  /// Returns a list of poses as text. Omits number 0, which is the pose in the structure files and always exists.
  static std::string text_of(const std::vector<wire::KeptPose>& poses) {
    std::map<std::uint32_t, std::string> list;
    for (const wire::KeptPose& pose : poses) {
      if (pose.number() != 0) list[pose.number()] = pose.name();
    }
    return text_of(list);
  }

  Random random_;
  std::filesystem::path folder_;
  std::uint64_t clock_ms_ = 1'700'000'000'000;
  std::vector<std::unique_ptr<Room>> rooms_;
  std::unique_ptr<PoseKeeper> keeper_;
  std::uint32_t last_request_ = 0;
  std::map<std::uint32_t, std::pair<std::string, UserId>> open_;       ///< room and user of open requests, by number
  std::map<std::string, std::map<std::uint32_t, std::string>> lists_;  ///< received pose names by room and number
};

class PoseKeeperProperty : public ::testing::TestWithParam<int> {};

TEST_P(PoseKeeperProperty, EachRequestGetsOneAnswerAndTheFilesHaveWhatUsersReceived) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const auto folder = std::filesystem::temp_directory_path() / ("tandem_pose_sequences_" + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  PoseSequences(test::test_seed(59), static_cast<std::uint64_t>(GetParam()), folder).run(60);
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Sequences, PoseKeeperProperty, ::testing::Range(0, 6));

}  // namespace
}  // namespace tandem::server
