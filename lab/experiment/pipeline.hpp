// The processing between the server's state and a hand, by name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "client/model/local_model.hpp"
#include "common/base/json.hpp"

namespace tandem::lab {

/// Default stage of a client.
std::string default_stage();
/// Stage that displays the server's own contact forces: at zero delay, the reference.
std::string truth_stage();
std::vector<std::string_view> known_stages();
std::vector<std::string_view> known_predictors();
/// "late-pose, hold": for messages.
std::string listed_stages();

struct Pipeline {
  std::string stage = default_stage();
  std::string predictor =
      client::StageSettings{}.predictor;               ///< predictor of the residual force (server minus local model)
  bool passivity = client::StageSettings{}.passivity;  ///< whether a passivity controller follows the stage
  double deadband = 0;        ///< Weber fraction below which messages are suppressed; 0: none is
  client::ModelErrors model;  ///< deliberate errors of the local model
};

/// A pipeline in the format of an experiment file.
boost::json::object pipeline_json(const Pipeline& pipeline);

}  // namespace tandem::lab
