#include "lab/studies/prediction/series_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <stdexcept>

namespace tandem::lab {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

std::filesystem::path written(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / name;
  std::ofstream(file) << text;
  return file;
}

bool are_near(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) < 1e-9; });
}

TEST(TrajFile, ForcesAreResampledToAnEvenRate) {
  const std::string text =
      "# time x y z fx fy fz\n"
      "0.000 1 2 3 0.0 10 -1\n"
      "0.010\t1 2 3 1.0 20 -1 77 88\r\n"
      "\n"
      "0.030 1 2 3 2.0 20 -1\n";
  const auto series = parse_traj(text, "duck.traj", 200);
  ASSERT_EQ(series.columns.size(), 3U);
  EXPECT_EQ(series.names[0], "force_x_n");
  EXPECT_TRUE(are_near(series.columns[0], {0, 0.5, 1, 1.25, 1.5, 1.75, 2}));
  EXPECT_THAT(series.columns[1], testing::Pointwise(testing::DoubleNear(1e-9), {10, 15, 20, 20, 20, 20, 20}));
  EXPECT_EQ(series.columns[2].size(), 7U);
}

TEST(TrajFile, TimesMayBeMilliseconds) {
  const std::string text = "0 0 0 0 1 1 1\n100 0 0 0 2 2 2\n";
  EXPECT_EQ(parse_traj(text, "a.traj", 200, 1e-3).row_count(), 21U);
}

TEST(TrajFile, ComplaintsNameFileLineAndRemedy) {
  const auto complaint_of = [](const std::string& text) { return complaint([&] { parse_traj(text, "duck.traj"); }); };
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 1\n1 0 0 0 1 1\n"),
              AllOf(HasSubstr("duck.traj: line 2"), HasSubstr("6 numbers")));
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 1\n1 0 0 0 1 1 1x\n"),
              AllOf(HasSubstr("line 2, column 7"), HasSubstr("\"1x\"")));
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 -\n"), HasSubstr("finite number"));
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 1e999\n"), HasSubstr("finite number"));
  EXPECT_THAT(complaint_of("1 0 0 0 1 1 1\n1 0 0 0 1 1 1\n"), AllOf(HasSubstr("line 2"), HasSubstr("later")));
  EXPECT_THAT(complaint_of(""), HasSubstr("0 samples"));
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 1\n1e9 0 0 0 1 1 1\n"), HasSubstr("--time-unit"));
  EXPECT_THAT(complaint_of("0 0 0 0 1 1 1\n1e-9 0 0 0 1 1 1\n"), HasSubstr("--time-unit"));
  EXPECT_THAT(complaint([] { load_series("/nowhere/duck.traj"); }), HasSubstr("/nowhere/duck.traj"));
}

TEST(SeriesFile, AllForceColumnsOfACsvAreRead) {
  const auto file = written("series_file_test.csv", "t_s,speed_m_per_s,force_x_n,torque_z_n_m\n0,1,2,3\n0.01,1,4,5\n");
  const auto series = load_series(file, 200);
  ASSERT_EQ(series.columns.size(), 2U);
  EXPECT_EQ(series.names[0], "force_x_n");
  EXPECT_TRUE(are_near(series.columns[0], {2, 3, 4}));
  EXPECT_EQ(series.names[1], "torque_z_n_m");
  const auto chosen = load_series(file, 200, 1, "speed_m_per_s");
  ASSERT_EQ(chosen.columns.size(), 1U);
  EXPECT_THAT(complaint([&] { load_series(file, 200, 1, "warmth"); }), HasSubstr("warmth"));
}

TEST(SeriesFile, ACsvWithoutTimesOrForcesIsRefused) {
  EXPECT_THAT(complaint([] { load_series(written("series_no_time.csv", "a_n\n1\n2\n")); }), HasSubstr("t_s"));
  EXPECT_THAT(complaint([] { load_series(written("series_no_force.csv", "t_s,a\n0,1\n1,2\n")); }),
              HasSubstr("--columns"));
  EXPECT_THAT(complaint([] { load_series(written("series_gap.csv", "t_s,a_n\n0,1\n1,\n")); }), HasSubstr("line 3"));
}

}  // namespace
}  // namespace tandem::lab
