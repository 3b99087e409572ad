// Tests that the three output formats of a reproduction agree, and that the recorded path of the peg has its five
// steps: the tip moves into the hole and out again.
#include "lab/results/reproduction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "devices/sim/hand_path.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {
namespace {

using ::testing::HasSubstr;

Reproduction example() {
  Reproduction example;
  example.title = "A <b>title</b>";
  example.summary = "Run on a <i>bench</i>" + std::string(40, ' ') + "with a word after many blanks.";
  example.rows = {{"time of a frame", "2 ms", "20 µs"}};
  example.claims = {{"scope", "fast", 20, Relation::kAtMost, 60, "µs", 1},
                    {"scope", "deep", 2, Relation::kAtMost, 1, "mm", 1}};
  example.details = boost::json::object{{"p50", 20}};
  return example;
}

TEST(Reproduction, JsonHasRowsAndClaimsWithValueBoundAndWhetherTheyHold) {
  const boost::json::object json = to_json(example());
  EXPECT_EQ(json.at("summary").as_string(), example().summary);
  EXPECT_EQ(json.at("rows").at(0).at("published").as_string(), "2 ms");
  EXPECT_EQ(json.at("rows").at(0).at("ours").as_string(), "20 µs");
  const boost::json::array& claims = json.at("claims").as_array();
  ASSERT_EQ(claims.size(), 2U);
  EXPECT_EQ(claims[0].at("claim").as_string(), "fast");
  EXPECT_EQ(claims[0].at("value").to_number<double>(), 20);
  EXPECT_EQ(claims[0].at("bound").to_number<double>(), 60);
  EXPECT_TRUE(claims[0].at("holds").as_bool());
  EXPECT_FALSE(claims[1].at("holds").as_bool());
}

TEST(Reproduction, PageAndTextShowBothSidesAndEscapeMarkup) {
  EXPECT_THAT(to_report(example()).html(), AllOf(HasSubstr("2 ms"), HasSubstr("20 µs"), HasSubstr("A &lt;b&gt;title")));
  EXPECT_THAT(to_report(example()).html(), HasSubstr("Run on a &lt;i&gt;bench"));
  EXPECT_THAT(to_text(example()), HasSubstr("Run on a <i>bench</i> with a word after many blanks.\n"));
  EXPECT_THAT(to_text(example()), AllOf(HasSubstr("time of a frame  2 ms       20 µs\n"), HasSubstr("FAILED")));
}

TEST(PegFiveSteps, HasTheFiveStepsAndItsTipGoesWellIntoTheHoleAndOutAgain) {
  const devices::HandPath path = devices::load_hand_path(test::source_path("lab/paths/peg_five_steps.json").string());
  EXPECT_EQ(path.phases(), (std::vector<std::string>{"slide tip on top", "lay down and slide", "push the front side",
                                                     "insert", "leave"}));
  const Vec3 tip(0, 0, -kPegLength_m / 2);
  const double top_m = kBoxHeight_m / 2;
  double lowest_in_hole_m = top_m;
  for (Duration at{0}; at < path.length(); at += std::chrono::milliseconds(5)) {
    const Vec3 p = path.pose_at(at) * tip;
    if (path.phases()[static_cast<std::size_t>(path.phase_at(at))] == "insert" && p.head<2>().norm() < 0.002) {
      lowest_in_hole_m = std::min(lowest_in_hole_m, p.z());
    }
  }
  EXPECT_LT(lowest_in_hole_m, top_m - 0.03);
  EXPECT_GT((path.pose_at(path.length()) * tip).z(), top_m + 0.02);
}

}  // namespace
}  // namespace tandem::lab
