#include "lab/experiment/pipeline.hpp"

#include <limits>

#include "client/haptics/stages/stage.hpp"

namespace tandem::lab {

std::string default_stage() {
  return client::StageSettings{}.name;
}

std::vector<std::string_view> known_stages() {
  return client::stage_names();
}

std::vector<std::string_view> known_predictors() {
  return client::predictor_names();
}

std::string listed_stages() {
  std::string text;
  for (const std::string_view stage : known_stages()) text.append(text.empty() ? "" : ", ").append(stage);
  return text;
}

boost::json::object pipeline_json(const Pipeline& pipeline) {
  return {{"stage", pipeline.stage},
          {"predictor", pipeline.predictor},
          {"passivity", pipeline.passivity},
          {"deadband", pipeline.deadband},
          {"model", boost::json::object{{"mass_scale", pipeline.model_mass_scale}}}};
}

client::LocalModelSettings local_model_settings(const Pipeline& pipeline) {
  client::LocalModelSettings settings;
  settings.mass_scale = pipeline.model_mass_scale;
  settings.keeps_ledger = true;
  return settings;
}

client::HapticSettings haptic_settings(const Pipeline& pipeline, const haptics::CouplingParameters& coupling_bounds) {
  client::HapticSettings settings;
  settings.stage.name = pipeline.stage;
  settings.stage.predictor = pipeline.predictor;
  settings.stage.passivity = pipeline.passivity;
  settings.coupling_bounds = coupling_bounds;
  return settings;
}

double passivity_dissipated_j(const client::HapticCore& core, const Pipeline& pipeline) {
  return pipeline.passivity ? core.record().passivity_withheld_j : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tandem::lab
