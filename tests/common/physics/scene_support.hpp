// Scenes for tests of worlds: short JSON texts in which a test replaces one part, and the scenes shipped with the
// server.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "server/assets/scene_file.hpp"
#include "tests/support/scene_of.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::physics {

inline constexpr const char* kWall = R"({"name": "wall", "shapes": [{"box": {"size_m": [1, 1, 1]}}]})";

/// A coupling with a linear law, whose forces are known in closed form.
inline constexpr const char* kLinear = R"({"law": "spring-damper"})";

/// Returns the fields of a coupling: the name of the law, and a fit if the law requires one. The fit has 100 N/m at
/// 0.05 kg and 400 N/m at 1 kg.
inline std::string law_fields(const std::string& law) {
  const std::string fit = R"(, "adaptive": {"mass_range_kg": [0.05, 1], "stiffness_n_per_m": [84.2, 315.8],
                                            "damping_n_s_per_m": [4]})";
  return R"("law": ")" + law + "\"" + (law == "adaptive" ? fit : "");
}
inline std::string coupling_with(const std::string& law) {
  return "{" + law_fields(law) + "}";
}

/// Parts of a scene file as JSON. The defaults form a valid scene.
struct SceneParts {
  std::string bodies = kWall;
  std::string tools = R"({"name": "t", "placement": {"position_m": [0, 0, 2]}})";
  std::string coupling = kLinear;  ///< empty: the file has no coupling
  std::string rest = "";           ///< further fields of the scene
};

inline std::string scene_json(const SceneParts& parts) {
  return R"({"name": "s", "bodies": [)" + parts.bodies + R"(], "tools": [)" + parts.tools + "]" +
         (parts.coupling.empty() ? "" : R"(, "coupling": )" + parts.coupling) +
         (parts.rest.empty() ? "" : ", " + parts.rest) + "}";
}

inline std::shared_ptr<const server::LoadedScene> load_parts(const SceneParts& parts) {
  return test::scene_of(scene_json(parts));
}

inline std::filesystem::path shipped_scene(const std::string& name) {
  return test::source_path("server/scenes") / (name + ".json");
}

}  // namespace tandem::physics

/// Loads a shipped scene into a variable. If a required Debian package with data is missing, the test fails with a
/// message that names the package.
#define TANDEM_LOAD_SCENE(variable, scene_name)                                              \
  std::shared_ptr<const ::tandem::server::LoadedScene> variable;                             \
  try {                                                                                      \
    (variable) = ::tandem::server::load_scene(::tandem::physics::shipped_scene(scene_name)); \
  } catch (const ::tandem::server::SceneError& error) {                                      \
    FAIL() << error.what();                                                                  \
  }
