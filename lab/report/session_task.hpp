// What the hands of a session were to achieve, and whether they did: apart from how it felt (session_checks.hpp).
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

/// All of it holds in the settled part of each user's phase "hold". What is left out is not checked.
struct SessionTask {
  std::string body;                         ///< that users are to watch; empty: any
  std::optional<Vec3> place_W;              ///< of the origin of the watched body [m] …
  double within_m = 0;                      ///< … which is at most this far from it
  std::optional<double> rest_m;             ///< largest distance of the watched body from its mean position
  std::optional<double> energy_kj_per_mol;  ///< the molecular field has at most this: molecules in contact attract
};

/// By the name of the session.
using SessionTasks = std::map<std::string, SessionTask, std::less<>>;

/// Reads {"SESSION": {"body": "peg", "place_m": [x, y, z], "within_m": 0.001, "rest_m": 0.001,
/// "energy_kj_per_mol": -20}}; every field may be left out.
/// Fails   std::invalid_argument naming file, field, value and remedy
SessionTasks parse_session_tasks(std::string_view json, const std::string& origin);
SessionTasks load_session_tasks(const std::filesystem::path& file);

/// One check for each field and user. A value that the traces do not have is NaN, and its check fails.
std::vector<Check> check_task(const Session& session, const SessionTask& task);

}  // namespace tandem::lab
