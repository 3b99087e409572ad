// Any quantity of an experiment by its name: for `--set link.rtt_ms=130`, for the grid of an experiment file, and for
// the zero-delay run that a trial is compared with.
//
//   stage, seed, duration_s, link.loss, model.mass_scale   as in the file; of all users, also those with their own
//   hand.mass_kg, device                                   of all users
//   users.1.link.rtt_ms, users.ben.hand                    of one user, by number from 0 or by name
//   law, coupling.stiffness_n_per_m                        of the scene's coupling
//   scene.bodies.cube.friction                             any other field of the scene's file
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// Current name of a quantity that files may contain under an older one ("guard" is "passivity").
std::string current_name(const std::string& quantity);
/// Renames every field of an experiment's document in the same way.
boost::json::object with_current_names(boost::json::object document);

/// One quantity and the values that it takes in turn.
struct Axis {
  std::string name;
  std::vector<boost::json::value> values;
};

/// Parses "link.rtt_ms=0,50,100". A value is JSON, otherwise text; commas within brackets do not separate values.
/// Fails   std::invalid_argument: no "=", or nothing on one of its sides
Axis parse_axis(const std::string& text);

/// "a.b" → "a", "b".
std::vector<std::string> parts_of_name(std::string_view name);

/// Names that can be set in an experiment, from its complete document (experiment_json()). A user's names begin with
/// "users.0."; placeholders for a scene's own fields end in "…".
std::vector<std::string> known_quantities(const boost::json::object& complete);
/// Fails   std::invalid_argument: unknown name; lists the nearest and all known names
void check_quantity(const boost::json::object& complete, const std::string& name);

/// Sets a quantity in an experiment's document. A quantity of all users replaces the values of single users.
/// Fails   std::invalid_argument: a user that does not exist
void set_quantity(boost::json::object& document, const std::string& name, const boost::json::value& value);

/// Levenshtein distance: the fewest letters to insert, delete or replace to turn one text into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace tandem::lab
