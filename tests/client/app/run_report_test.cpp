// Tests the report of a run: its statistics must follow from the tick records that the test supplies.
#include "client/app/run_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/app/trace.hpp"

namespace tandem::client {
namespace {

using ::testing::SizeIs;

constexpr Duration kTick{std::chrono::milliseconds(1)};
constexpr Duration kSilenceZero{std::chrono::milliseconds(140)};

/// Adds one tick record per millisecond.
struct Rig {
  void add(int ticks, int phase = 0) {
    for (int i = 0; i < ticks; ++i) {
      record.at += kTick;
      ++record.tick.value;
      report.add(record, phase);
    }
  }
  /// Simulates that no state arrives for `ticks` ticks. From tick `zero_after` of this gap on, the displayed force is
  /// zero.
  void fall_silent(int ticks, int zero_after) {
    for (int i = 1; i <= ticks; ++i) {
      record.state_age = i * kTick;
      record.displayed_on_hand_D.f.z() = i >= zero_after ? 0.0 : 1.0;
      add(1);
    }
    record.state_age = Duration{0};
    record.displayed_on_hand_D.f.z() = 1.0;
  }

  Rig() {
    record.sample.state = devices::DeviceState::kReady;
    record.sample.is_valid = true;
    record.displayed_on_hand_D.f = Vec3(0, 0, 1);
  }
  TickRecord record;
  RunReport report{{"approach", "hold"}, kSilenceZero};
};

TEST(RunReport, TellsWhatBecomesOfTheDeviceAndNotATickLongEach) {
  Rig rig;
  rig.add(1);
  EXPECT_EQ(rig.report.pop_device_news(), "") << "ready, as it should be";
  rig.record.sample.is_valid = false;
  rig.record.sample.reason = "its orientation is no rotation; plug it in again";
  rig.add(1);
  EXPECT_EQ(rig.report.pop_device_news(),
            "ready, but gives no usable samples: its orientation is no rotation; plug it in again");
  int news = 0;
  for (int i = 0; i < 3000; ++i) {
    rig.record.sample.is_valid = i % 2 == 0;
    rig.record.sample.reason = i % 2 == 0 ? "" : "its pose jumps";
    rig.add(1);
    news += rig.report.pop_device_news().empty() ? 0 : 1;
  }
  EXPECT_LE(news, 3);
  EXPECT_GE(news, 2);
  rig.record.sample = {};
  rig.record.sample.state = devices::DeviceState::kLost;
  rig.record.sample.reason = "it was unplugged; plug it in again";
  rig.add(1);
  EXPECT_EQ(rig.report.pop_device_news(), "lost: it was unplugged; plug it in again") << "at once";
}

TEST(RunReport, SilenceIsTimedFromTheLastArrivalToLastingZero) {
  Rig rig;
  rig.add(100);
  rig.fall_silent(500, 135);
  EXPECT_TRUE(rig.report.is_silent());
  rig.report.explain_silence("connection lost");
  rig.report.explain_silence("refused");
  rig.add(100);
  EXPECT_FALSE(rig.report.is_silent());
  ASSERT_THAT(rig.report.silences(), SizeIs(1));
  const Silence& silence = rig.report.silences()[0];
  EXPECT_EQ(silence.last_arrival, 99 * kTick) << "since the first tick";
  EXPECT_EQ(silence.zero_after, 135 * kTick);
  EXPECT_EQ(silence.why, "connection lost") << "the first reason";
}

TEST(RunReport, SilenceInWhichTheForceStayedHasNoZero) {
  Rig rig;
  rig.add(100);
  rig.fall_silent(500, 1000);
  ASSERT_THAT(rig.report.silences(), SizeIs(1));
  EXPECT_FALSE(rig.report.silences()[0].zero_after.has_value());
}

TEST(RunReport, GapShorterThanTheDecayIsNoSilence) {
  Rig rig;
  rig.add(100);
  rig.fall_silent(139, 1000);
  rig.add(100);
  EXPECT_THAT(rig.report.silences(), SizeIs(0));
}

TEST(RunReport, PhasesAreKeptApartAndSettleAfterASecond) {
  Rig rig;
  rig.record.sample.V_DH.v = Vec3(0.3, 0, 0.4);
  rig.add(500, 0);
  rig.record.sample.V_DH.v = Vec3(0.1, 0, 0);
  rig.record.displayed_on_hand_D.f = Vec3(0, 0, 5);
  rig.add(1000, 1);
  rig.record.displayed_on_hand_D.f = Vec3(0, 0, 2);
  rig.record.held_body = BodyId{1};
  rig.add(1000, 1);
  const PhaseReport& approach = rig.report.phases()[0];
  EXPECT_EQ(approach.whole.ticks(), 500U);
  EXPECT_DOUBLE_EQ(approach.whole.hand_speed_max_m_per_s(), 0.5);
  EXPECT_EQ(approach.settled.ticks(), 0U);
  const PhaseReport& hold = rig.report.phases()[1];
  EXPECT_EQ(hold.duration, 1999 * kTick);
  EXPECT_DOUBLE_EQ(hold.whole.force_max_n(), 5.0);
  EXPECT_DOUBLE_EQ(hold.whole.force_mean_n(), 3.5);
  EXPECT_DOUBLE_EQ(hold.settled.force_max_n(), 2.0);
  EXPECT_NEAR(hold.settled.hand_speed_rms_m_per_s(), 0.1, 1e-12);
  EXPECT_DOUBLE_EQ(hold.whole.holding_fraction(), 0.5);
}

TEST(RunReport, TheMeanVectorDistinguishesASwingFromAPush) {
  Rig rig;
  for (int i = 0; i < 100; ++i) {
    rig.record.displayed_on_hand_D.f.z() = i % 2 == 0 ? 1.0 : -1.0;
    rig.add(1);
  }
  EXPECT_DOUBLE_EQ(rig.report.phases()[0].whole.force_mean_n(), 1.0);
  EXPECT_DOUBLE_EQ(rig.report.phases()[0].whole.force_mean_vector_n(), 0.0);
}

TEST(RunReport, BodyIsMeasuredFromWhereItWasFirstSeenToItsFarthest) {
  Rig rig;
  rig.add(10);
  EXPECT_FALSE(rig.report.has_seen_body());
  rig.record.watched_body_W.emplace().X.p = Vec3(1, 0, 0);
  rig.add(1);
  rig.record.watched_body_W->X = {Vec3(1, 0, 0.05), quaternion_of(Vec3(0, 0.4, 0))};
  rig.add(1);
  rig.record.watched_body_W->X = {Vec3(1, 0, 0.01), Quat::Identity()};
  rig.add(1);
  EXPECT_DOUBLE_EQ(rig.report.body_displacement_m(), 0.05);
  EXPECT_NEAR(rig.report.body_rotation_rad(), 0.4, 1e-12);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line + ",");
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

/// A file in the temporary folder that is deleted after the test.
struct TemporaryFile {
  TemporaryFile() : path(std::filesystem::temp_directory_path() / ("tandem_trace_" + std::to_string(::getpid()))) {}
  ~TemporaryFile() { std::filesystem::remove(path); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  std::vector<std::string> lines() const {
    std::vector<std::string> result;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) result.push_back(line);
    return result;
  }
  std::filesystem::path path;
};

std::string cell(const std::vector<std::string>& lines, std::size_t row, const std::string& name) {
  const std::vector<std::string> names = cells_of(lines[0]);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return "no column " + name;
  return cells_of(lines[row])[static_cast<std::size_t>(found - names.begin())];
}

TEST(Trace, ValuesStandBelowTheirNamesAndUnknownOnesAreEmpty) {
  TemporaryFile file;
  TickRecord record;
  record.at = LocalTime{std::chrono::seconds(7)};
  record.state_age = Duration{-1};
  record.displayed_on_hand_D.f = Vec3(1.5, -2, 0.25);
  TraceWriter trace(file.path, 1);
  trace.write(record, 2);
  record.at += kTick;
  record.state_age = 3 * kTick;
  record.tool_W.X.p.y() = 0.125;
  trace.write(record, -1);
  ASSERT_TRUE(trace.flush());
  const std::vector<std::string> lines = file.lines();
  ASSERT_THAT(lines, SizeIs(3));
  for (const std::string& line : lines) EXPECT_EQ(cells_of(line).size(), cells_of(lines[0]).size());
  EXPECT_EQ(cell(lines, 1, "t_s"), "0.000000");
  EXPECT_EQ(cell(lines, 2, "t_s"), "0.001000");
  EXPECT_EQ(cell(lines, 1, "local_ns"), "7000000000");
  EXPECT_EQ(cell(lines, 1, "displayed_force_y_n"), "-2");
  EXPECT_EQ(cell(lines, 1, "state_age_s"), "");
  EXPECT_EQ(cell(lines, 1, "tool_p_y_m"), "");
  EXPECT_EQ(cell(lines, 2, "state_age_s"), "0.003000");
  EXPECT_EQ(cell(lines, 2, "tool_p_y_m"), "0.125");
  EXPECT_EQ(cell(lines, 2, "body_p_x_m"), "");
  EXPECT_EQ(cell(lines, 1, "phase"), "2");
}

TEST(Trace, ColumnNamesAreAllDifferent) {
  std::vector<std::string> names = cells_of(trace_header());
  const std::size_t count = names.size();
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  EXPECT_EQ(names.size(), count);
}

TEST(Trace, DecimationKeepsTheFirstAndEveryNth) {
  TemporaryFile file;
  TraceWriter trace(file.path, 10);
  TickRecord record;
  for (int i = 0; i < 25; ++i) {
    ++record.tick.value;
    trace.write(record, -1);
  }
  ASSERT_TRUE(trace.flush());
  const std::vector<std::string> lines = file.lines();
  ASSERT_THAT(lines, SizeIs(4));
  EXPECT_EQ(cell(lines, 1, "tick"), "1");
  EXPECT_EQ(cell(lines, 2, "tick"), "11");
  EXPECT_EQ(cell(lines, 3, "tick"), "21");
}

TEST(Trace, FileThatCannotBeCreatedIsASetupError) {
  EXPECT_THROW(TraceWriter("/nonexistent/folder/trace.csv", 1), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::client
