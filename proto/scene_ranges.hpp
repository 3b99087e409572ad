// The one table of what each number of a scene may be. The server fills in defaults and checks scene files by it, a
// client checks what a server sends by it: neither accepts what the other refuses.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "google/protobuf/message.h"

namespace tandem::proto {

/// Shapes of a body or tool.
inline constexpr int kMaxShapes = 256;

/// What one field of scene.proto that holds a number, or several, may be.
struct SceneRange {
  std::string_view field;         ///< "Message.field"
  std::string_view unit;          ///< "" of a plain number
  double low, high;               ///< both accepted, both finite
  std::vector<double> fallback;   ///< of an absent field; empty: it must be there, or follows from other fields
  int count = 1;                  ///< of numbers; 0: how many is a matter of other fields, and checked with them
  std::string_view zero_is = "";  ///< what 0 stands for where it is accepted though outside the range; for people

  /// False for NaN.
  bool accepts(double value) const;
};

/// Every number of a scene in the order of scene.proto, then those of control.proto's MassProperties.
///
/// Source  ours: bounds of plausibility for scenes from the desk to the room in SI units. A value outside is a slip of
///         units or of the keyboard, and would only show as a strange simulation. Positions end at 100 m because shapes
///         do: a scene is for hands, and farther away nothing could be met.
/// Thread  any
std::span<const SceneRange> scene_ranges();
/// Fails   std::out_of_range for a field that is not in the table
const SceneRange& scene_range(std::string_view field);

/// Fills in the fallback of each absent number of `message` and of the messages that are set in it.
void complete_numbers(google::protobuf::Message& message);

/// The first number of `message`, or of a message that is set in it, that is absent or out of its range; empty when
/// there is none. An absent array counts as its fallback.
///
/// In      path  of `message`, e.g. "scene"; "": the text begins with the name of a field
/// Out     "bodies[2].mass_kg is -1 kg; it must be from 1e-06 to 10000 kg, or 0 (static)"
std::string find_range_problem(const google::protobuf::Message& message, const std::string& path = "");

/// A number for people: as short as it can be with 6 digits.
std::string number_text(double value);

}  // namespace tandem::proto
