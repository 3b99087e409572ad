// Tests the benchmark commands in the way that a script uses them: keys, exit codes, and error messages that name the
// remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/studies/contact/contact_bench.hpp"
#include "lab/studies/contact/contact_scaling.hpp"
#include "lab/studies/contact/mesh_source.hpp"
#include "lab/studies/contact/pose_check.hpp"

namespace tandem::lab {
namespace {

using ::testing::HasSubstr;
using Arguments = std::vector<std::string>;

struct Outcome {
  int exit_code = -1;
  std::string out;
};

/// Runs `bench …` and captures its output.
Outcome run(Arguments arguments) {
  CLI::App app;
  Outcome outcome;
  add_contact_bench(app, outcome.exit_code);
  add_contact_scaling(app, outcome.exit_code);
  std::reverse(arguments.begin(), arguments.end());
  testing::internal::CaptureStdout();
  try {
    app.parse(arguments);
  } catch (...) {
    testing::internal::GetCapturedStdout();
    throw;
  }
  outcome.out = testing::internal::GetCapturedStdout();
  return outcome;
}

std::string complaint(const Arguments& arguments) {
  try {
    run(arguments);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(ContactBench, JsonHasWhatAScriptReadsAndItIsPlausible) {
  // Objects at 0.4 of their usual size are prepared faster.
  const Outcome outcome = run({"contact", "--a", "peg", "--b", "box_with_hole", "--scale", "0.4", "--direction", "0",
                               "1", "0", "--steps", "900", "--peer-steps", "20", "--json"});
  EXPECT_EQ(outcome.exit_code, 0);
  const boost::json::object json = boost::json::parse(outcome.out).as_object();
  EXPECT_EQ(json.at("triangles_a").to_number<int>(), 180);
  EXPECT_EQ(json.at("triangles_b").to_number<int>(), 176);
  EXPECT_EQ(json.at("steps").to_number<int>(), 900);
  EXPECT_GT(json.at("points").to_number<int>(), 5000);
  EXPECT_LE(json.at("spacing_m").to_number<double>(), 5e-4);
  EXPECT_LE(json.at("cell_m").to_number<double>(), 8e-4);
  EXPECT_GT(json.at("contacts_max").to_number<int>(), 0);
  EXPECT_GT(json.at("memory_bytes").to_number<double>(), 0);
  EXPECT_EQ(json.at("pop_throughs").to_number<int>(), 0);
  EXPECT_LE(json.at("max_penetration_m").to_number<double>(), 1e-3);
  for (const char* step : {"hand_force_step_max_n", "hand_torque_step_max_n_m"}) {
    EXPECT_GT(json.at(step).to_number<double>(), 0) << step;
    EXPECT_LT(json.at(step).to_number<double>(), 1) << step << ": it is pressed with 5 N";
  }
  EXPECT_GT(json.at("build_s").to_number<double>(), 0);
  EXPECT_GT(json.at("cache_load_s").to_number<double>(), 0);
  for (const char* times : {"query_us", "step_us"}) {
    const boost::json::object& quantiles = json.at(times).as_object();
    EXPECT_GT(quantiles.at("p50").to_number<double>(), 0);
    EXPECT_LE(quantiles.at("p50").to_number<double>(), quantiles.at("p99").to_number<double>());
    EXPECT_LE(quantiles.at("p99").to_number<double>(), quantiles.at("p999").to_number<double>());
    EXPECT_LE(quantiles.at("p999").to_number<double>(), quantiles.at("max").to_number<double>());
  }
  EXPECT_GT(json.at("looks").at("p99").to_number<int>(), 0);
  EXPECT_LE(json.at("looks").at("p50").to_number<int>(), json.at("looks").at("p99").to_number<int>());
  const boost::json::object& peer = json.at("gimpact").as_object();
  EXPECT_EQ(peer.at("steps").to_number<int>(), 20);
  for (const char* key : {"contacts_max", "query_us", "step_us", "max_penetration_m", "pop_throughs"}) {
    EXPECT_TRUE(peer.contains(key)) << key;
  }
  EXPECT_GT(json.at("machine").at("field_sample_ns").to_number<double>(), 0);
}

TEST(ContactBench, OmitsThePeerWhenRequested) {
  const Outcome outcome =
      run({"contact", "--a", "cube", "--b", "cube", "--scale", "0.4", "--steps", "50", "--no-peer", "--json"});
  EXPECT_FALSE(boost::json::parse(outcome.out).as_object().contains("gimpact"));
}

TEST(ContactBench, LandingPrintsItsChecksInPlaceOfThePath) {
  const Outcome outcome = run({"contact", "--a", "cube", "--b", "cube", "--scale", "0.4", "--landing", "--json"});
  EXPECT_EQ(outcome.exit_code, 0);
  const boost::json::object json = boost::json::parse(outcome.out).as_object();
  EXPECT_FALSE(json.contains("steps"));
  const boost::json::object& landing = json.at("landing").as_object();
  ASSERT_EQ(landing.at("landings").as_array().size(), 6U);
  ASSERT_EQ(landing.at("drops").as_array().size(), 6U);
  const boost::json::object& first = landing.at("landings").at(0).as_object();
  EXPECT_NEAR(first.at("force_ratio").to_number<double>() * first.at("stop_force_n").to_number<double>(),
              first.at("hand_force_step_max_n").to_number<double>(), 1e-12);
  for (const char* key : {"speed_m_per_s", "stiffness_n_per_m", "torque_ratio", "separations", "contact_created_j",
                          "contact_returned_j", "kinetic_left_j"}) {
    EXPECT_TRUE(first.contains(key)) << key;
  }
  EXPECT_GT(landing.at("drops").at(0).at("rest_s").to_number<double>(), 0);
  // Four checks for each landing and two for each drop.
  ASSERT_EQ(landing.at("checks").as_array().size(), 48U);
  for (const char* key : {"scope", "claim", "value", "relation", "bound", "unit", "holds"}) {
    EXPECT_TRUE(landing.at("checks").at(0).as_object().contains(key)) << key;
  }
  EXPECT_THAT(run({"contact", "--a", "cube", "--b", "cube", "--scale", "0.4", "--landing"}).out,
              AllOf(HasSubstr("of a rigid stop"), HasSubstr("at rest after")));
  EXPECT_THROW(run({"contact", "--a", "cube", "--b", "cube", "--landing", "--check", "3"}), CLI::ExcludesError);
}

/// Returns a cube of 20 mm. It is prepared only once, because preparation is slow.
const TouchObject& small_cube() {
  static const TouchObject object = make_touch_object("cube", mesh_from("cube", "--a", 0.1, 0.4), SteadyClock{});
  return object;
}

TEST(ContactBench, ReusesItsCachedAssets) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "contact_bench_cache";
  std::filesystem::remove_all(folder);
  const auto make = [&folder] {
    return make_touch_object("cube", mesh_from("cube", "--a", 0.1, 0.1), SteadyClock{}, folder);
  };
  const TouchObject built = make(), kept = make();
  EXPECT_GT(built.build_s, 0);
  EXPECT_EQ(kept.build_s, 0);
  EXPECT_EQ(contact::contact_asset_bytes(*kept.shape, 0), contact::contact_asset_bytes(*built.shape, 0));
  // A damaged asset must be built again. If an asset cannot be stored, a message must report it.
  const std::filesystem::path file = std::filesystem::directory_iterator(folder)->path();
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_GT(make().build_s, 0);
  EXPECT_EQ(make().build_s, 0);
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);
  testing::internal::CaptureStderr();
  EXPECT_GT(make().build_s, 0);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("cannot be written"));
}

TEST(ContactBench, TwoRunsGiveTheSameMotion) {
  const SteadyClock clock;
  const TouchObject& cube = small_cube();
  const devices::HandPath path = touch_path(*cube.exact, *cube.exact, bench_plan({}));
  const Duration press = begin_of_phase(path, "press");
  const TouchTrace first = run_touch(*cube.shape, *cube.shape, path, {}, clock, press, 500);
  const TouchTrace second = run_touch(*cube.shape, *cube.shape, path, {}, clock, press, 500);
  ASSERT_EQ(first.size(), second.size());
  std::uint32_t contacts = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].X_WT.p, second[i].X_WT.p);
    EXPECT_EQ(first[i].on_hand_W.f, second[i].on_hand_W.f);
    contacts = std::max(contacts, first[i].contacts);
  }
  EXPECT_GT(contacts, 10U);
  EXPECT_EQ(fastest_of({first, second}).size(), first.size());
  EXPECT_THROW(fastest_of({first, run_touch(*cube.shape, *cube.shape, path, {.mass_kg = 0.3}, clock, press, 500)}),
               std::logic_error);
}

TEST(ContactBench, PressesWithTheCouplingsLimitAndRestsOnTheSurface) {
  const TouchObject& cube = small_cube();
  const TouchSettings settings;
  const devices::HandPath path = touch_path(*cube.exact, *cube.exact, bench_plan(settings));
  // In the last step before the hand slides, the tool is pressed and at rest.
  const Duration slide = begin_of_phase(path, "slide");
  const auto steps = static_cast<std::size_t>(to_seconds(slide) / settings.step_s);
  const TouchTrace trace = run_touch(*cube.shape, *cube.shape, path, settings, SteadyClock{}, Duration{0}, steps);
  const TouchStep& last = trace.back();
  EXPECT_NEAR(last.on_hand_W.f.z(), settings.coupling.force_limit_n, 1e-6);
  // A contact area of 4 cm² with a stiffness of 5 GN/m³ yields by 2.5 µm under 5 N.
  EXPECT_NEAR(last.X_WT.p.z(), 0.02, 1e-5);
}

TEST(PoseCheck, FindsNoMissedContactBetweenSmallPegAndBox) {
  const SteadyClock clock;
  constexpr double kSmall = 0.4;
  const TouchObject peg = make_touch_object("peg", mesh_from("peg", "--a", 0.1, kSmall), clock);
  const TouchObject box = make_touch_object("box", mesh_from("box_with_hole", "--b", 0.1, kSmall), clock);
  const PoseCheck check = check_poses(peg, box, 20, 7);
  EXPECT_EQ(check.poses, 20U);
  EXPECT_GT(check.exact_points, 0U);
  EXPECT_GT(check.deepest_max_m, 5e-4);
  EXPECT_EQ(check.missed_poses, 0U);
  EXPECT_LE(check.deepest_error_max_m, kDeepestErrorBound_m) << "pose " << check.worst_pose << " of seed 7";
}

// If there are more contacts than the budget, one contact represents several points and lies at their mean position. It
// may be far from the deepest of these points. Fails if the check compares only the mean position and thus reports
// missed contacts.
TEST(PoseCheck, AContactThatStandsForSeveralPointsIsAtEachOfThem) {
  const TouchObject ball = make_touch_object("ball", mesh_from("sphere", "--a", 0.1, 1), SteadyClock{});
  const PoseCheck check = check_poses(ball, ball, 10, 7, {}, 24);
  EXPECT_GT(check.exact_points, 0U);
  EXPECT_EQ(check.missed_poses, 0U);
}

// The corner of one body pierces the face of a thin plate. The face is then deeper in the other body than any vertex or
// edge of the plate. Fails if the check compares only vertices and edges.
TEST(PoseCheck, KnowsHowDeepAFaceIsThatACornerIsThrough) {
  geometry::TriangleMesh thin = make_cube(0.1);
  for (Vec3& p : thin.vertices) p.z() *= 0.0012;
  const TouchObject plate = make_touch_object("plate", thin, SteadyClock{});
  const TouchObject cube = make_touch_object("cube", make_cube(0.02), SteadyClock{});
  const PoseCheck check = check_poses(plate, cube, 60, 7);
  EXPECT_EQ(check.missed_poses, 0U);
  EXPECT_LE(check.deepest_error_max_m, kDeepestErrorBound_m) << "pose " << check.worst_pose << " of seed 7";
}

TEST(ContactBench, RefusesBadArgumentsWithTheRemedy) {
  EXPECT_THAT(complaint({"contact", "--a", "/nowhere/x.obj", "--b", "cube"}),
              AllOf(HasSubstr("--a is /nowhere/x.obj, which does not exist"), HasSubstr("box_with_hole")));
  EXPECT_THAT(complaint({"contact", "--a", "cube", "--b", "/usr/share/glmark2/models/none.obj"}),
              AllOf(HasSubstr("--b is"), HasSubstr("glmark2-data")));
  for (const char* scale : {"0", "-1", "nan"}) {
    EXPECT_THAT(complaint({"contact", "--a", "cube", "--b", "cube", std::string("--scale=") + scale}),
                HasSubstr("it must be more than 0"));
  }
  EXPECT_THAT(complaint({"contact", "--a", "cube", "--b", "cube", "--size-mm", "0"}), HasSubstr("--size-mm is 0"));
  EXPECT_THAT(complaint({"contact", "--a", "cube", "--b", "cube", "--mass-kg", "0"}), HasSubstr("--mass-kg is 0"));
  EXPECT_THAT(complaint({"contact", "--a", "cube", "--b", "cube", "--scale=0.2", "--direction", "0", "0", "0"}),
              HasSubstr("--direction has no direction"));
}

TEST(ContactScaling, JudgesTheFinestAgainstTheMeshAsGiven) {
  std::vector<ScalingRow> rows(3);
  rows[0].figures.step_us.p99_us = 1;
  rows[1].figures.step_us.p99_us = 100;
  rows[2].triangles = 1000;
  rows[2].figures.step_us.p99_us = 199;
  EXPECT_TRUE(all_hold(scaling_checks(rows, 1)));
  rows[2].figures.step_us.p99_us = 201;
  EXPECT_FALSE(all_hold(scaling_checks(rows, 1)));
  for (ScalingRow& row : rows) row.triangles = 100;
  EXPECT_THAT(scaling_report("mesh.obj", rows, 1).html(), HasSubstr("<svg"));
}

}  // namespace
}  // namespace tandem::lab
