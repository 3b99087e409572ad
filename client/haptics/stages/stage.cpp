// See stage.hpp: one table names every stage, for the command line, the lab and error messages.
#include "client/haptics/stages/stage.hpp"

#include <algorithm>
#include <array>

#include "client/haptics/stages/makers.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {
namespace {

struct StageEntry {
  std::string_view name;
  std::unique_ptr<Stage> (*make)(const StageSettings&);
};
constexpr std::array kStages{StageEntry{"local-model", &make_local_model_stage},
                             StageEntry{"late-pose", &make_late_pose_stage},
                             StageEntry{"hold", &make_hold_stage},
                             StageEntry{"linear", &make_force_stream_stage},
                             StageEntry{"ar", &make_force_stream_stage},
                             StageEntry{"ar-spline", &make_force_stream_stage},
                             StageEntry{"wave", &make_wave_stage},
                             StageEntry{"god-object", &make_god_object_stage}};

std::string listed(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

}  // namespace

std::unique_ptr<Stage> make_stage(const StageSettings& settings) {
  const std::vector<std::string_view> predictors = predictor_names();
  if (std::find(predictors.begin(), predictors.end(), settings.predictor) == predictors.end()) return nullptr;
  for (const StageEntry& entry : kStages) {
    if (entry.name == settings.name) return entry.make(settings);
  }
  return nullptr;
}

bool needs_local_model(std::string_view stage) {
  return stage == kStages.front().name;
}

bool needs_proxy_world(std::string_view stage) {
  return stage == "god-object";
}

std::vector<std::string_view> stage_names() {
  std::vector<std::string_view> names;
  names.reserve(std::size(kStages));
  for (const StageEntry& entry : kStages) names.push_back(entry.name);
  return names;
}

std::vector<std::string_view> predictor_names() {
  std::vector<std::string_view> names{kScoredPredictor, "none"};
  for (const std::string_view name : haptics::force_stream_names()) names.push_back(name);
  return names;
}

std::string listed_stage_names() {
  return listed(stage_names());
}

std::string listed_predictor_names() {
  return listed(predictor_names());
}

}  // namespace tandem::client
