// The commands of tandem-client --commands: their names, fields and units, and how one is read from a line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/control.pb.h"

namespace tandem::client {

/// Bytes of a line; a longer one is refused.
inline constexpr std::size_t kMaxCommandBytes = 1024;

/// A line that names a command and has each of its fields within its range.
struct Command {
  std::string verb;
  std::vector<std::string> texts;  ///< fields that are no numbers, in the order of the command's usage
  std::vector<double> numbers;     ///< the others, likewise, in the units of its usage
};

/// Fields are separated by blanks; a field with blanks in it stands in double quotes, where \" and \\ stand for " and \.
///
/// Fails   std::invalid_argument: the line is empty, too long or not printable UTF-8; the command does not exist (lists
///         those that do); a field is missing, left over, no number or out of its range (names it and its unit)
Command parse_command(std::string_view line);

/// The first field of a line as an answer repeats it: printable and short; "" of an empty line.
std::string command_word(std::string_view line);

/// "keep [NAME]", "move X Y Z", …: all commands, and what each does.
std::vector<std::pair<std::string, std::string>> command_usages();

/// The pose that a user means by its number ("2", "#2") or by its name.
///
/// In      pose  "2" is also a name; "#2" is a number only
/// Fails   std::invalid_argument: none or more than one is meant (lists those that are there, or those that are meant)
const wire::KeptPose& find_pose(const std::vector<wire::KeptPose>& poses, const std::string& pose);

}  // namespace tandem::client
