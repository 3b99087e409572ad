// What a trial writes to its folder. results.json holds the outcome and nothing of the host, so that two runs of the
// same experiment give the same bytes; what depends on the machine is in timing.json.
#pragma once

#include <ostream>
#include <string>

#include "common/json/json.hpp"
#include "lab/experiment.hpp"
#include "lab/trace.hpp"

namespace tandem::lab {

/// How long a trial took.
struct Timing {
  double virtual_s = 0;
  double wall_s = 0;
};

/// Whether every user stayed connected for the whole trial.
bool is_complete(const SessionTrace& trace);

boost::json::object results_json(const Experiment& experiment, const SessionTrace& trace);
boost::json::object timing_json(const Timing& timing);

/// Poses of the bodies that can move, one row a sample: t_s, then NAME_x_m … NAME_qz; and the field's energy.
std::string bodies_csv(const SessionTrace& trace);

/// A table for people: one column a user, one line a metric.
void print_summary(std::ostream& out, const Experiment& experiment, const SessionTrace& trace, const Timing& timing);

}  // namespace tandem::lab
