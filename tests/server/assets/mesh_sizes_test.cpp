// Tests values of a scene's files that are used as divisors: the size of a mesh and the mass of a molecule. Values near
// 0 must be refused, because otherwise poses and inertias would be infinite.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <regex>
#include <string>

#include "common/base/random.hpp"
#include "server/assets/mass_properties.hpp"
#include "server/assets/scene_file.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/degenerate_meshes.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MeshSizes : public ::testing::Test {
 protected:
  MeshSizes() : directory_(std::filesystem::path(::testing::TempDir()) / "tandem_mesh_sizes") {
    std::filesystem::create_directories(directory_);
  }
  ~MeshSizes() override { std::filesystem::remove_all(directory_); }

  void write(const geometry::TriangleMesh& mesh) const {
    std::ofstream file(directory_ / "t.obj");
    file.precision(17);
    for (const Vec3& p : mesh.vertices) file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    for (const auto& [a, b, c] : mesh.triangles) file << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
  }
  /// Returns the error message of loading the scene. If the scene loads, the message is empty and `loaded_` has the
  /// scene.
  std::string refusal(const std::string& mesh_fields) {
    const std::string shape = R"({"mesh": {"file": "t.obj")" + mesh_fields + "}}";
    try {
      SceneLoading loading;
      loading.cache_directory.clear();
      loaded_ = load_scene_text(physics::scene_json({.bodies = R"({"name": "a", "shapes": [)" + shape + "]}"}),
                                "test.json", directory_, loading);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path directory_;
  std::shared_ptr<const LoadedScene> loaded_;
};

TEST_F(MeshSizes, AMeshThatIsAPointIsRefusedByItsFileAndPlace) {
  write({{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}});
  for (const char* const fields : {"", R"(, "largest_size_m": 0.1)", R"(, "scale": 0.001)", R"(, "centre": true)"}) {
    EXPECT_THAT(refusal(fields), AllOf(HasSubstr("mesh.file is "), HasSubstr("t.obj"), HasSubstr("(1, 2, 3)"),
                                       HasSubstr("give the mesh of a surface")))
        << fields;
  }
}

TEST_F(MeshSizes, EveryDegenerateMeshIsRefusedInWordsOrHasNumbers) {
  const std::regex no_number("(^|[^a-z])(nan|inf)([^a-z]|$)", std::regex::icase);
  Random random(test::test_seed(59));
  int refused = 0;
  for (int trial = 0; trial < 30; ++trial) {
    write(test::degenerate_mesh(random));
    std::string fields;
    if (random.uniform() < 0.7) fields += R"(, "largest_size_m": )" + std::to_string(random.uniform(0.005, 0.02));
    if (fields.empty() && random.uniform() < 0.5) fields += R"(, "scale": 0.001)";
    if (random.uniform() < 0.5) fields += R"(, "centre": true)";
    const std::string problem = refusal(fields);
    refused += problem.empty() ? 0 : 1;
    ASSERT_FALSE(std::regex_search(problem, no_number)) << "trial " << trial << fields << ": " << problem;
    if (!problem.empty()) {
      ASSERT_THAT(problem, AllOf(HasSubstr("bodies[0].shapes[0].mesh"), HasSubstr("t.obj"))) << "trial " << trial;
      continue;
    }
    const wire::Mesh& mesh = loaded_->description.bodies(0).shapes(0).mesh();
    ASSERT_TRUE(std::isfinite(mesh.scale()) && mesh.scale() > 0) << "trial " << trial;
    ASSERT_TRUE(std::isfinite(mesh.largest_size_m()) && mesh.largest_size_m() > 0) << "trial " << trial;
    for (const Vec3& vertex : loaded_->body_shapes[0][0].mesh->vertices) ASSERT_TRUE(vertex.allFinite());
  }
  EXPECT_GT(refused, 5);
  EXPECT_LT(refused, 30) << "meshes with a surface must be loaded";
}

TEST(MassOfAMolecule, IsFiniteForAnyAtomMasses) {
  const std::uint64_t seed = test::test_seed(59);
  std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
  for (int trial = 0; trial < 200; ++trial) {
    docking::Molecule molecule = test::random_molecule(1 + random() % 8, random);
    const double scale = std::array{0.0, 1e-300, 1.0}.at(random() % 3);
    for (double& mass_u : molecule.mass_u) mass_u *= scale;
    molecule.centre();
    const MassProperties mass = mass_properties_of(0.2, molecule, 0.01);
    ASSERT_TRUE(mass.principal_inertia_kg_m2.allFinite()) << "trial " << trial << ", masses of " << scale;
    ASSERT_GT(mass.principal_inertia_kg_m2.minCoeff(), 0) << "trial " << trial << ", masses of " << scale;
    ASSERT_TRUE(is_finite(mass.X_BC)) << "trial " << trial;
  }
}

}  // namespace
}  // namespace tandem::server
