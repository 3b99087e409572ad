// Details of one trial. trial.json contains parameters and outcome but nothing about the host, so two runs of the same
// experiment give the same bytes. bodies.csv contains the motion of the bodies.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Whether every user stayed connected for the whole trial.
bool is_complete(const SessionTrace& trace);

boost::json::object results_json(const Experiment& experiment, const SessionTrace& trace);

/// Poses of the movable bodies, one row for each sample: t_s, then NAME_x_m … NAME_qz, and the energy of the field.
std::string bodies_csv(const SessionTrace& trace);

}  // namespace tandem::lab
