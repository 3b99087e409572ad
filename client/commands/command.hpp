// The commands that tandem-client --commands accepts: names, fields and units, and the parser of a line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/control.pb.h"

namespace tandem::client {

/// Maximum length of a line [bytes]. Longer lines are refused.
inline constexpr std::size_t kMaxCommandBytes = 1024;

/// A parsed line. The command is known to exist, and the fields are known to be within their ranges.
struct CommandLine {
  std::string verb;
  std::vector<std::string> texts;  ///< text fields, in the order of the command's usage
  std::vector<double> numbers;     ///< numeric fields, in the same order and in the units of the usage
};

/// Parses a line. Fields are separated by blanks. A field that contains blanks is enclosed in double quotes, in which
/// \" and \\ stand for " and \.
///
/// Fails   std::invalid_argument in these cases:
///         * the line is empty, too long or not printable UTF-8
///         * the command does not exist; the message lists all commands
///         * a field is missing, superfluous, not a number, or out of range; the message names the field and its unit
CommandLine parse_command(std::string_view line);

/// Returns the first field of a line, printable and shortened, for a quotation in an answer. Empty for an empty line.
std::string command_word(std::string_view line);

/// Returns usage and purpose of all commands: "keep [NAME]", "move X Y Z", …
std::vector<std::pair<std::string, std::string>> command_usages();

/// Finds the saved pose with this number ("2", "#2") or this name.
///
/// In      pose  "#2" is always a number; "2" may be a number or a name
/// Fails   std::invalid_argument: no pose matches (the message lists all poses), or several match (the message lists
///         them)
const wire::KeptPose& find_pose(const std::vector<wire::KeptPose>& poses, const std::string& pose);

}  // namespace tandem::client
