// The processing between the server's state and a hand. Each stage is selected by its name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "client/model/local_model.hpp"
#include "common/base/json.hpp"

namespace tandem::lab {

/// Returns the default stage of a client.
std::string default_stage();
/// Returns the stage that displays the contact forces of the server unchanged. A run of this stage at zero delay is the
/// reference of a trial.
std::string truth_stage();
std::vector<std::string_view> known_stages();
std::vector<std::string_view> known_predictors();
/// Returns the known stages as text for messages: "late-pose, hold".
std::string listed_stages();

struct Pipeline {
  std::string stage = default_stage();
  std::string predictor =
      client::StageSettings{}.predictor;               ///< predictor of the residual force (server minus local model)
  bool passivity = client::StageSettings{}.passivity;  ///< whether a passivity controller limits the force of the stage
  double deadband = 0;        ///< Weber fraction below which messages are suppressed; 0: no message is suppressed
  client::ModelErrors model;  ///< deliberate errors of the local model
};

/// Returns a pipeline in the format of an experiment file.
boost::json::object pipeline_json(const Pipeline& pipeline);

}  // namespace tandem::lab
