// Table of the valid range of each number in a scene. The server checks scene files by this table and adds the
// defaults. A client checks received scenes by the same table, so both accept the same scenes.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "google/protobuf/message.h"

namespace tandem::proto {

/// Maximum number of shapes of a body or tool.
inline constexpr int kMaxShapes = 256;

/// Range of one numeric field of scene.proto.
struct SceneRange {
  std::string_view field;  ///< name of the field in the form "Message.field"
  std::string_view unit;   ///< "" for a number without unit
  double low, high;        ///< inclusive limits; both are finite
  /// Default if the field is absent. Empty: the field is required, or its default depends on other fields.
  std::vector<double> fallback;
  int count = 1;  ///< number of values; 0: depends on other fields, which are checked with them
  /// Meaning of the value 0 for messages, if 0 is accepted although it is outside the range; "": 0 is not accepted.
  std::string_view zero_is = "";

  /// Returns whether the value is accepted; a NaN never is.
  bool accepts(double value) const;
};

/// Returns the ranges of all numbers of a scene in the order of scene.proto, and then those of MassProperties in
/// control.proto.
/// Source  our choice: plausible SI values for scenes between the size of a desk and the size of a room. A value
///         outside is probably a typing error or a wrong unit. Without a check, the simulation would only become
///         implausible. Positions and lengths are limited to 100 m, because hands cannot reach anything farther away
/// Thread  any
std::span<const SceneRange> scene_ranges();
/// Returns the range of the field "Message.field".
/// Fails   std::out_of_range: the table does not contain the field
const SceneRange& scene_range(std::string_view field);

/// Sets each absent number of `message`, and of its present sub-messages, to its default.
void complete_numbers(google::protobuf::Message& message);

/// Returns a description of the first number in `message`, or in its present sub-messages, that is absent or out of
/// range; empty if there is none. An absent array is no problem, because it has a default.
///
/// In      path  prefix of field names in the text, e.g. "scene"; "": the text begins with a field name
/// Out     e.g. "bodies[2].mass_kg is -1 kg; it must be from 1e-06 to 10000 kg, or 0 (static)"
std::string find_range_problem(const google::protobuf::Message& message, const std::string& path = "");

/// Returns a number as text with at most 6 digits.
std::string number_text(double value);

}  // namespace tandem::proto
