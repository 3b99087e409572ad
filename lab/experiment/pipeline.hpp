// What stands between the server's state and a hand, by name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "client/model/local_model.hpp"
#include "common/base/json.hpp"

namespace tandem::lab {

/// The stage that a client uses when nobody asks for another.
std::string default_stage();
/// The one that shows the server's own touch: at zero delay, the truth.
std::string truth_stage();
std::vector<std::string_view> known_stages();
std::vector<std::string_view> known_predictors();
/// "late-pose, hold": for messages.
std::string listed_stages();

struct Pipeline {
  std::string stage = default_stage();
  std::string predictor = client::StageSettings{}.predictor;  ///< of what the stage's model does not know
  bool passivity = client::StageSettings{}.passivity;         ///< a passivity controller follows the stage
  double deadband = 0;        ///< Weber fraction below which nothing is sent; 0: everything is
  client::ModelErrors model;  ///< in what the local model is wrong
};

/// As an experiment file has it.
boost::json::object pipeline_json(const Pipeline& pipeline);

}  // namespace tandem::lab
