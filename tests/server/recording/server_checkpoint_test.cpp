// Tests when the checkpoint thread writes: after changes, with a back-off after failures, and independently of the wall
// clock. A missing write would lose the rooms' state in a crash.
#include "server/recording/server_checkpoint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class ServerCheckpointTest : public testing::Test {
 protected:
  ServerCheckpointTest() {
    char folder[] = "/tmp/tandem-checkpoint-XXXXXX";
    root_ = ::mkdtemp(folder);
    state = root_ / "state";
    std::filesystem::create_directory(state);
  }
  ~ServerCheckpointTest() override { std::filesystem::remove_all(root_); }

  std::unique_ptr<ServerCheckpoint> open() {
    return std::make_unique<ServerCheckpoint>(
        state, bench.rooms, "key", [this] { return unix_ms; },
        [this](const std::string& line) { news.push_back(line); });
  }
  /// Replaces the state folder by a file, so that writing fails even for root.
  void make_unwritable() {
    std::filesystem::rename(state, root_ / "aside");
    std::ofstream(state.string()) << "in the way";
  }
  void make_writable() {
    std::filesystem::remove(state);
    std::filesystem::rename(root_ / "aside", state);
  }

  std::uint64_t unix_ms = 1'700'000'000'000;
  std::vector<std::string> news;
  std::filesystem::path state;
  test::HubBench bench;

 private:
  std::filesystem::path root_;
};

TEST_F(ServerCheckpointTest, AFailedWriteIsRetriedWithBackOffWhileRoomsAreIdle) {
  auto checkpoint = open();
  checkpoint->note({});
  make_unwritable();
  std::vector<std::int64_t> tried;
  for (Duration at = 0s; at < 30s; at += 20ms) {
    const std::uint64_t before = checkpoint->failures();
    checkpoint->work(LocalTime(at));
    if (checkpoint->failures() > before) tried.push_back(at / 1ms);
  }
  EXPECT_THAT(tried, testing::ElementsAre(0, 500, 1500, 3500, 7500, 15'500, 23'500));
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0], testing::AllOf(HasSubstr("checkpoint.pb cannot be written"), HasSubstr("Not a directory")));
  make_writable();
  checkpoint->work(LocalTime(31s));
  EXPECT_EQ(checkpoint->writes(), 0U) << "not before its time";
  checkpoint->work(LocalTime(32s));
  EXPECT_EQ(checkpoint->writes(), 1U);
  EXPECT_TRUE(std::filesystem::exists(state / "checkpoint.pb"));
  ASSERT_EQ(news.size(), 2U);
  EXPECT_THAT(news[1], HasSubstr("is written again"));
  for (Duration at = 32s; at < 60s; at += 20ms) checkpoint->work(LocalTime(at));
  EXPECT_EQ(checkpoint->writes(), 1U) << "without changes nothing must be written";
}

TEST_F(ServerCheckpointTest, ANotedStateIsWrittenEvenWithoutAFinish) {
  {
    const auto checkpoint = open();
    wire::AdmissionState admission;
    admission.add_credentials()->set_id("here");
    checkpoint->note(admission);
  }
  EXPECT_EQ(open()->admission().credentials_size(), 1);
}

TEST_F(ServerCheckpointTest, AClockThatIsSetBackDoesNotDelayAWrite) {
  auto checkpoint = open();
  std::uint64_t writes = 0;
  for (int i = 0; i < 10; ++i) {
    unix_ms -= 3'600'000;
    // Each iteration steps the room, which is empty and becomes idle after two iterations. Until then there is new
    // state to be written, although the wall clock is set back by an hour each time.
    bench.step(200);
    checkpoint->work(LocalTime(1s * i));
    EXPECT_TRUE(checkpoint->writes() > writes || i >= 2);
    writes = checkpoint->writes();
  }
}

TEST_F(ServerCheckpointTest, ConnectedUsersCountAsDisconnectedAtTheTimeOfTheFile) {
  {
    auto checkpoint = open();
    wire::AdmissionState admission;
    admission.add_credentials()->set_id("here");
    admission.add_credentials()->set_lost_ms(5);
    checkpoint->note(admission);
    checkpoint->work(LocalTime{});
  }
  unix_ms += 1'000'000;
  const auto checkpoint = open();
  ASSERT_EQ(checkpoint->admission().credentials_size(), 2);
  EXPECT_EQ(checkpoint->admission().credentials(0).lost_ms(), unix_ms - 1'000'000);
  EXPECT_EQ(checkpoint->admission().credentials(1).lost_ms(), 5U);
}

/// A client tries for 15 minutes to rejoin after a crash. Detects a server that discards the state of the room before
/// this time has passed: the users' work would be lost.
TEST_F(ServerCheckpointTest, AStateIsKeptForAsLongAsClientsRejoin) {
  {
    auto checkpoint = open();
    const test::BenchClient anna = bench.join("ada");
    bench.step(200);
    checkpoint->work(LocalTime{});
    ASSERT_EQ(checkpoint->writes(), 1U);
  }
  unix_ms += 14 * 60'000;
  EXPECT_TRUE(open()->restored(0)) << "scene's reset_after_s is 30 s, and 14 min have passed";
  news.clear();
  unix_ms += 16 * 60'000;  // 16 minutes after the last run, which wrote the file again when it ended
  EXPECT_FALSE(open()->restored(0));
  EXPECT_THAT(news, testing::Contains(testing::AllOf(HasSubstr("room bench starts from its scene"),
                                                     HasSubstr("960 s old"), HasSubstr("kept for 900 s"))));
}

}  // namespace
}  // namespace tandem::server
