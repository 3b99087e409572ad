// A study of eight short trials in the format of a study file, in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_fields.hpp"
#include "lab/experiment/trial_grid.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {

namespace fs = std::filesystem;
namespace json = boost::json;

// A scene without gravity. Two tools are in front of a free block, which is pushed for one second.
inline constexpr const char* kScene = R"({
  "name": "push", "gravity_m_per_s2": [0, 0, 0],
  "bodies": [{"name": "block", "mass_kg": 0.3, "graspable": true,
              "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}]}],
  "tools": [{"name": "left", "placement": {"position_m": [-0.04, 0, 0]},
             "workspace": {"device_base": {"position_m": [-0.04, 0, 0]}}},
            {"name": "right", "placement": {"position_m": [0.04, 0, 0]},
             "workspace": {"device_base": {"position_m": [0.04, 0, 0]}}}],
  "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}
})";
inline constexpr const char* kHand = R"({"points": [
  {"t_s": 0, "phase": "move"}, {"t_s": 0.2, "phase": "contact"}, {"t_s": 1, "position_m": [0.06, 0, 0]}]})";
inline constexpr const char* kExperiment = R"({
  "name": "small", "scene": "./push_scene.json", "duration_s": 1, "seeds": 2,
  "users": [{"name": "anna", "hand": "push.json", "hand_parameters": {"tremor_rms_n": 0.05}}, {"name": "ben"}],
  "grid": [{"stage": ["late-pose", "hold"], "passivity": false, "link.rtt_ms": [0, 20], "link.loss": 0.05}]
})";

class Study : public testing::Test {
 protected:
  Study()
      : folder_(fs::path(testing::TempDir()) /
                (std::string("study_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "out");
    std::ofstream(folder_ / "push_scene.json") << kScene;
    std::ofstream(folder_ / "push.json") << kHand;
  }
  ~Study() override { fs::remove_all(folder_); }

  std::vector<Trial> trials(const GridRequest& request = {}) const {
    return expand({"small.json", folder_, parse_json(kExperiment, "small.json").get_object()}, request);
  }
  RunSettings settings(const std::string& out = "out") const {
    RunSettings settings;
    settings.out = folder_ / out;
    settings.program = "test";
    fs::create_directories(settings.out);
    return settings;
  }
  static std::vector<TrialResult> run(std::vector<Trial> trials, const RunSettings& settings) {
    return TrialRunner(std::move(trials), settings).run([](std::size_t, std::size_t) {});
  }
  static std::size_t reused(const std::vector<TrialResult>& results) {
    return static_cast<std::size_t>(
        std::count_if(results.begin(), results.end(), [](const TrialResult& result) { return result.was_done; }));
  }

  fs::path folder_;
};

}  // namespace tandem::lab
