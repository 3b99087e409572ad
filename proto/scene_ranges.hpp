// Table of the valid range of each number in a scene. The server completes and checks scene files by this table, and a
// client checks received scenes by it. So both accept the same scenes.
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
  /// default of an absent field; empty: the field is required, or its default depends on other fields
  std::vector<double> fallback;
  int count = 1;  ///< number of values; 0: depends on other fields and is checked together with them
  /// meaning of the value 0 in messages, if 0 is accepted although it is outside the range; "": 0 is not accepted
  std::string_view zero_is = "";

  /// Returns whether the value is accepted; a NaN never is.
  bool accepts(double value) const;
};

/// Returns the ranges of all numbers of a scene in the order of scene.proto, and then those of MassProperties in
/// control.proto.
/// Source  our choice: plausible bounds in SI units for scenes from the size of a desk to the size of a room. A value
///         outside is probably a wrong unit or a typing error, which would otherwise only make the simulation
///         implausible. Positions and shapes are limited to 100 m, because hands cannot reach anything farther away
/// Thread  any
std::span<const SceneRange> scene_ranges();
/// Returns the range of the field "Message.field".
/// Fails   std::out_of_range: the table does not contain the field
const SceneRange& scene_range(std::string_view field);

/// Sets each absent number of `message`, and of its present sub-messages, to its default.
void complete_numbers(google::protobuf::Message& message);

/// Describes the first number in `message`, or in its present sub-messages, that is absent or out of range. Returns an
/// empty text if there is none. An absent array counts as its default.
///
/// In      path  prefix of field names in the text, e.g. "scene"; "": the text begins with a field name
/// Out     e.g. "bodies[2].mass_kg is -1 kg; it must be from 1e-06 to 10000 kg, or 0 (static)"
std::string find_range_problem(const google::protobuf::Message& message, const std::string& path = "");

/// Returns a number as text with at most 6 digits.
std::string number_text(double value);

}  // namespace tandem::proto
