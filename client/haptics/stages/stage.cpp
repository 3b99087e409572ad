// See stage.hpp: one table names every stage, for the command line, the lab and error messages.
#include "client/haptics/stages/stage.hpp"

#include <algorithm>
#include <array>

#include "client/haptics/stages/force_stream_stage.hpp"
#include "client/haptics/stages/hold.hpp"
#include "client/haptics/stages/late_pose.hpp"
#include "client/haptics/stages/local_model_stage.hpp"
#include "client/haptics/stages/wave_stage.hpp"

namespace tandem::client {
namespace {

using Maker = std::unique_ptr<Stage> (*)(const StageSettings&);

template <class T>
std::unique_ptr<Stage> plain(const StageSettings&) {
  return std::make_unique<T>();
}
std::unique_ptr<Stage> force_stream(const StageSettings& settings) {
  return std::make_unique<ForceStreamStage>(settings.name);
}
std::unique_ptr<Stage> wave(const StageSettings& settings) {
  return haptics::is_usable(settings.wave) ? std::make_unique<WaveStage>(settings.wave) : nullptr;
}

std::unique_ptr<Stage> local_model(const StageSettings& settings) {
  return std::make_unique<LocalModelStage>(settings.predictor);
}

struct StageEntry {
  std::string_view name;
  Maker make;
};
constexpr std::array kStages{StageEntry{"local-model", &local_model},
                             StageEntry{"late-pose", &plain<LatePose>},
                             StageEntry{"hold", &plain<Hold>},
                             StageEntry{"linear", &force_stream},
                             StageEntry{"ar", &force_stream},
                             StageEntry{"ar-spline", &force_stream},
                             StageEntry{"wave", &wave}};

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

std::vector<std::string_view> stage_names() {
  std::vector<std::string_view> names;
  for (const StageEntry& entry : kStages) names.push_back(entry.name);
  return names;
}

std::vector<std::string_view> predictor_names() {
  std::vector<std::string_view> names{"none"};
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
