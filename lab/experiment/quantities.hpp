// Any quantity of an experiment by its name: for `--set link.rtt_ms=130`, for the grid of an experiment file, and for
// the run at zero delay that a trial is held against.
//
//   stage, seed, duration_s, link.loss, model.mass_scale   as in the file; of all users, also those with their own
//   hand.mass_kg, device                                   of all users
//   users.1.link.rtt_ms, users.ben.hand                    of one user, by number from 0 or by name
//   law, coupling.stiffness_n_per_m                        of the scene's coupling
//   scene.bodies.cube.friction                             anything else that the scene's file has
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// The name in use of a quantity that files may still have by an older one ("guard" is "passivity").
std::string current_name(const std::string& quantity);
/// The same of every field of an experiment's document.
boost::json::object with_current_names(boost::json::object document);

/// One quantity with the values that it shall take in turn.
struct Axis {
  std::string name;
  std::vector<boost::json::value> values;
};

/// "link.rtt_ms=0,50,100". A value is JSON, or text where it is none; commas within brackets do not divide.
/// Fails   std::invalid_argument: no "=", nothing on one of its sides
Axis parse_axis(const std::string& text);

/// "a.b" → "a", "b".
std::vector<std::string> parts_of_name(std::string_view name);

/// Names that can be set in an experiment, from its complete document (experiment_json()); a user's begin with
/// "users.0.". What stands for a scene's own fields ends in "…".
std::vector<std::string> known_quantities(const boost::json::object& complete);
/// Fails   std::invalid_argument for a name that is not known: names the nearest and all that are
void check_quantity(const boost::json::object& complete, const std::string& name);

/// Sets a quantity in an experiment's document. A quantity of all users takes the place of what single users say.
/// Fails   std::invalid_argument: a user that is not there
void set_quantity(boost::json::object& document, const std::string& name, const boost::json::value& value);

/// The fewest letters to insert, delete or replace that make one text of the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace tandem::lab
