// Task of the hands in a session, and whether they fulfilled it. The quality of the touch is in session_checks.hpp.
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

/// Conditions for the settled part of each user's phase "hold". Missing fields are not checked.
struct SessionTask {
  std::string body;                         ///< body to be watched; empty: any
  std::optional<Vec3> place_W;              ///< required position of the watched body's origin [m] …
  double within_m = 0;                      ///< … and its tolerance
  std::optional<double> rest_m;             ///< largest distance of the watched body from its mean position
  std::optional<double> energy_kj_per_mol;  ///< upper limit for the molecular field: molecules in contact attract
};

/// Tasks by session name.
using SessionTasks = std::map<std::string, SessionTask, std::less<>>;

/// Reads {"SESSION": {"body": "peg", "place_m": [x, y, z], "within_m": 0.001, "rest_m": 0.001, "energy_kj_per_mol":
/// -20}}; every field is optional.
/// Fails   std::invalid_argument naming file, field, value and remedy
SessionTasks parse_session_tasks(std::string_view json, const std::string& origin);
SessionTasks load_session_tasks(const std::filesystem::path& file);

/// Returns one check for each field and user. A value missing in the traces is NaN, and its check fails.
std::vector<Check> check_task(const Session& session, const SessionTask& task);

}  // namespace tandem::lab
