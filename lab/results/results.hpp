// The details of one trial: trial.json holds parameters and outcome and nothing of the host, so that two runs of the
// same experiment give the same bytes; bodies.csv what the bodies did.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Whether every user stayed connected for the whole trial.
bool is_complete(const SessionTrace& trace);

boost::json::object results_json(const Experiment& experiment, const SessionTrace& trace);

/// Poses of the bodies that can move, one row a sample: t_s, then NAME_x_m … NAME_qz; and the field's energy.
std::string bodies_csv(const SessionTrace& trace);

}  // namespace tandem::lab
