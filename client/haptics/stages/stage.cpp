// The table below maps the names of stages to their makers, for the command line, the lab and error messages.
#include "client/haptics/stages/stage.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

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

bool is_among(const std::vector<std::string_view>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::unique_ptr<Stage> make_stage(const StageSettings& settings) {
  if (!is_among(predictor_names(), settings.predictor)) return nullptr;
  for (const StageEntry& entry : kStages) {
    if (entry.name == settings.name) return entry.make(settings);
  }
  return nullptr;
}

std::unique_ptr<Stage> require_stage(const StageSettings& settings) {
  if (!is_among(stage_names(), settings.name)) {
    throw std::invalid_argument("stage '" + settings.name + "' does not exist; use one of: " + listed_stage_names());
  }
  if (!is_among(predictor_names(), settings.predictor)) {
    throw std::invalid_argument("predictor '" + settings.predictor +
                                "' does not exist; use one of: " + listed_predictor_names());
  }
  if (!haptics::is_usable(settings.wave)) {
    throw std::invalid_argument("the wave's impedance must be above 0, for example 10 N*s/m and 0.01 N*m*s/rad");
  }
  return make_stage(settings);
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
