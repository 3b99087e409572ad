// Result files of one trial. trial.json contains the parameters and the outcome, but no data about the host. Therefore
// two runs of the same experiment give the same bytes. bodies.csv contains the motion of the bodies.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Returns whether every user stayed connected for the whole trial.
bool is_complete(const SessionTrace& trace);

boost::json::object results_json(const Experiment& experiment, const SessionTrace& trace);

/// Returns the poses of the movable bodies, one row for each sample. The columns are t_s, then NAME_x_m … NAME_qz for
/// each body, and the energy of the molecular field.
std::string bodies_csv(const SessionTrace& trace);

}  // namespace tandem::lab
