#include "lab/experiment/pipeline.hpp"

namespace tandem::lab {

std::string default_stage() {
  return client::StageSettings{}.name;
}

std::string truth_stage() {
  return "late-pose";
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
  const Vec3& shift = pipeline.model.shape_shift_m;
  return {{"stage", pipeline.stage},
          {"predictor", pipeline.predictor},
          {"passivity", pipeline.passivity},
          {"deadband", pipeline.deadband},
          {"model", boost::json::object{{"mass_scale", pipeline.model.mass_scale},
                                        {"friction_scale", pipeline.model.friction_scale},
                                        {"shape_shift_m", boost::json::array{shift.x(), shift.y(), shift.z()}}}}};
}

}  // namespace tandem::lab
