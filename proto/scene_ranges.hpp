// Table of the valid range of each number of a scene. The server completes and checks scene files by it, and a client
// checks received scenes by it, so that both accept the same scenes.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "google/protobuf/message.h"

namespace tandem::proto {

/// Largest number of shapes of a body or tool.
inline constexpr int kMaxShapes = 256;

/// Range of one numeric field of scene.proto.
struct SceneRange {
  std::string_view field;         ///< "Message.field"
  std::string_view unit;          ///< "" for a plain number
  double low, high;               ///< inclusive, both finite
  std::vector<double> fallback;   ///< default of an absent field; empty: required, or derived from other fields
  int count = 1;                  ///< number of values; 0: depends on other fields, and is checked with them
  std::string_view zero_is = "";  ///< meaning of a 0 that is accepted outside the range, for people; "": not accepted

  /// Returns whether the value is accepted; false for NaN.
  bool accepts(double value) const;
};

/// Returns the range of every number of a scene in the order of scene.proto, then of control.proto's MassProperties.
///
/// Source  ours: plausible bounds for scenes from the desk to the room in SI units. A value outside is an error of
///         units or typing, which would otherwise only appear as a strange simulation. Positions end at 100 m like
///         shapes: a scene is for hands, and nothing farther away can be touched.
/// Thread  any
std::span<const SceneRange> scene_ranges();
/// Fails   std::out_of_range for a field that is not in the table
const SceneRange& scene_range(std::string_view field);

/// Fills in the default of each absent number of `message` and its set sub-messages.
void complete_numbers(google::protobuf::Message& message);

/// Returns the problem of the first number of `message`, or of its set sub-messages, that is absent or out of its
/// range; empty when there is none. An absent array counts as its default.
///
/// In      path  prefix for `message`, e.g. "scene"; "": the text begins with the name of a field
/// Out     "bodies[2].mass_kg is -1 kg; it must be from 1e-06 to 10000 kg, or 0 (static)"
std::string find_range_problem(const google::protobuf::Message& message, const std::string& path = "");

/// Returns a number as short text of up to 6 digits.
std::string number_text(double value);

}  // namespace tandem::proto
