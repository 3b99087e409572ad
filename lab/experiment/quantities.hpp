// Sets any quantity of an experiment by its name. Names are used by `--set link.rtt_ms=130`, by the grid of an
// experiment file, and to derive the zero-delay run with which a trial is compared.
//
//   name of the quantity                                   value that is set
//   stage, seed, duration_s, link.loss, model.mass_scale   field of the experiment. If users have this field too, it is
//                                                          set for all users, even if a user has a value of its own
//   hand.mass_kg, device                                   field of every user
//   users.1.link.rtt_ms, users.ben.hand                    field of one user, selected by number (from 0) or by name
//   law, coupling.stiffness_n_per_m                        field of the scene's coupling
//   scene.bodies.cube.friction                             any other field of the scene file
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::lab {

/// Returns the current name of a quantity. Older files may contain a previous name: "guard" is now "passivity".
std::string current_name(const std::string& quantity);
/// Replaces the previous names of all fields in an experiment's document by the current ones.
boost::json::object with_current_names(boost::json::object document);

/// One quantity and the list of its values. Each value gives one trial.
struct Axis {
  std::string name;
  std::vector<boost::json::value> values;
};

/// Parses a quantity with its values, such as "link.rtt_ms=0,50,100". A value is read as JSON if it is valid JSON,
/// otherwise as text. Commas within brackets belong to a value and do not separate values.
/// Fails   std::invalid_argument: there is no "=", or one of its sides is empty
Axis parse_axis(const std::string& text);

/// Splits a dotted name: "a.b" → "a", "b".
std::vector<std::string> parts_of_name(std::string_view name);

/// Returns the names of all quantities that can be set in an experiment.
/// * Quantities of a single user are listed once, for user 0: "users.0.…".
/// * Fields of the scene file are not listed one by one; they have placeholders that end in "…".
///
/// In      complete  complete document of the experiment; see experiment_json()
std::vector<std::string> known_quantities(const boost::json::object& complete);
/// Checks that a quantity exists.
/// Fails   std::invalid_argument: the name is unknown; the message lists the most similar names and all known names
void check_quantity(const boost::json::object& complete, const std::string& name);

/// Sets a quantity in an experiment's document. A quantity that applies to all users replaces the values of single
/// users too.
/// Fails   std::invalid_argument: the user does not exist
void set_quantity(boost::json::object& document, const std::string& name, const boost::json::value& value);

/// Returns the Levenshtein distance: the minimum number of letters to insert, delete or replace that turns one text
/// into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace tandem::lab
