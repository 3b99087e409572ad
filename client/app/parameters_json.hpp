// Converts parameters of a run to JSON with the field names of an experiment file (lab/EXPERIMENTS.md), so that the lab
// can repeat a live run.
#pragma once

#include "common/base/json.hpp"
#include "common/net/link.hpp"
#include "devices/hand_parameters.hpp"

namespace tandem::client {

boost::json::object to_json(const net::LinkParameters& link);
boost::json::object to_json(const devices::HandParameters& hand);

}  // namespace tandem::client
