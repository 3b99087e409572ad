// The task of the hands in a session, and the check whether the hands completed it. The checks of the displayed touch
// are in session_checks.hpp.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/spatial.hpp"
#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// Conditions for the settled part of each user's phase "hold". A condition without a value is not checked.
struct SessionTask {
  std::string body;              ///< name of the watched body; empty: any body
  std::optional<Vec3> place_W;   ///< required position of the watched body's origin in W [m]
  double within_m = 0;           ///< largest permitted distance from place_W
  std::optional<double> rest_m;  ///< largest permitted distance of the watched body from its mean position
  /// upper limit of the energy of the molecular field; negative, because molecules in contact attract each other
  std::optional<double> energy_kj_per_mol;
};

/// Maps the name of a session to its task.
using SessionTasks = std::map<std::string, SessionTask, std::less<>>;

/// Reads {"SESSION": {"body": "peg", "place_m": [x, y, z], "within_m": 0.001, "rest_m": 0.001, "energy_kj_per_mol":
/// -20}}. Every field is optional.
/// Fails   std::invalid_argument naming file, field, value and remedy
SessionTasks parse_session_tasks(std::string_view json, const std::string& origin);
SessionTasks load_session_tasks(const std::filesystem::path& file);

/// Returns one check for each condition and user. A value that is missing in the traces is NaN, and its check fails.
std::vector<Check> check_task(const Session& session, const SessionTask& task);

}  // namespace tandem::lab
