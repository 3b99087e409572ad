// Tests mass and inertia of a tool or a held body at the grip, from the mass properties that the server computes and
// sends. The results are compared with closed forms and numerical integrals, and checked for the shipped scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "client/haptics/coupling_check.hpp"
#include "common/base/random.hpp"
#include "proto/placement.hpp"
#include "proto/world_from_wire.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using Mat3 = Eigen::Matrix3d;

/// The server's reply to a user who joins with this tool.
wire::Joined joined_of(const server::LoadedScene& scene, std::uint32_t tool) {
  wire::Joined joined = test::minimal_joined();
  *joined.mutable_scene() = scene.description;
  joined.clear_tool_masses();
  for (const physics::ToolDescription& each : scene.world.tools) *joined.add_tool_masses() = test::on_wire(each.mass);
  for (const physics::BodyDescription& each : scene.world.bodies) *joined.add_body_masses() = test::on_wire(each.mass);
  joined.set_tool(tool);
  return joined;
}

/// Returns the smallest and the largest mass and inertia by which body 0 resists a motion of the grip `p_BT`. They are
/// computed from the mass properties that the client receives.
std::array<physics::MovedMass, 2> body_at(const server::LoadedScene& scene, const Vec3& p_BT) {
  const auto mass = proto::mass_from_wire(joined_of(scene, 0).body_masses(0));
  return resistance_at(mass.value(), p_BT, true);
}

/// Returns the inertia tensor of a point mass about the origin.
Mat3 inertia_of(double mass_kg, const Vec3& p) {
  return mass_kg * (p.squaredNorm() * Mat3::Identity() - p * p.transpose());
}

double largest_eigenvalue(const Mat3& matrix) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(matrix).eigenvalues()[2];
}
double smallest_eigenvalue(const Mat3& matrix) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(matrix).eigenvalues()[0];
}

TEST(TrueInertia, OfALongRodHeldAtOneEndIsTheClosedForm) {
  // A rod of 30 cm and 50 g with a square section of 6 mm. It is rotated in its body, so its principal axes differ from
  // the body's axes.
  const auto scene = physics::load_parts({.bodies = R"({"name": "rod", "mass_kg": 0.05, "graspable": true, "shapes": [
        {"box": {"size_m": [0.3, 0.006, 0.006]}, "placement": {"rotation_xyz_deg": [0, 40, 30]}}]})"});
  const double degree = std::numbers::pi / 180;
  const Vec3 axis =
      Eigen::AngleAxisd(30 * degree, Vec3::UnitZ()) * (Eigen::AngleAxisd(40 * degree, Vec3::UnitY()) * Vec3::UnitX());
  const double m = 0.05, length = 0.3, width = 0.006;
  const double across = m * (length * length + width * width) / 12;
  const auto [least, most] = body_at(*scene, -0.5 * length * axis);
  EXPECT_NEAR(most.inertia_kg_m2, across + m * length * length / 4, 1e-9 * across) << "m (L²/3 + w²/12)";
  EXPECT_NEAR(most.mass_kg, m, 1e-12);
  EXPECT_NEAR(least.inertia_kg_m2, m * width * width / 6, 1e-9 * across) << "turned about its axis";
  EXPECT_NEAR(least.mass_kg, 1 / (1 / m + length * length / 4 / across), 1e-9 * m) << "a quarter: its far end swings";
  const auto [least_central, most_central] = body_at(*scene, Vec3::Zero());
  EXPECT_NEAR(most_central.inertia_kg_m2, across, 1e-9 * across);
  EXPECT_NEAR(least_central.mass_kg, m, 1e-9 * m) << "no lever, no swing";
}

/// Integrals over the volume of a closed surface with density 1: volume, first moment, and inertia about the point
/// `about`. Each triangle forms a tetrahedron with the origin. The four-point rule is exact for quadratic polynomials.
struct Integral {
  double volume = 0;
  Vec3 first_moment = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
};
Integral integrated(const server::SolidShape& shape, const Vec3& about) {
  const Pose X_BS = proto::pose_from_placement(shape.shape.placement());
  constexpr double kNear = 0.5854101966249685, kFar = 0.1381966011250105;
  Integral sum;
  for (const auto& [i, j, k] : shape.mesh->triangles) {
    const auto at = [&](int index) { return X_BS * shape.mesh->vertices[static_cast<std::size_t>(index)]; };
    const std::array<Vec3, 3> corners{at(i), at(j), at(k)};
    const double volume = corners[0].dot(corners[1].cross(corners[2])) / 6;
    const Vec3 all = corners[0] + corners[1] + corners[2];
    std::array<Vec3, 4> places;
    for (std::size_t n = 0; n < 3; ++n) places[n] = kFar * all + (kNear - kFar) * corners[n];
    places[3] = kFar * all;
    sum.volume += volume;
    for (const Vec3& place : places) {
      sum.first_moment += volume / 4 * place;
      sum.inertia += inertia_of(volume / 4, place - about);
    }
  }
  return sum;
}

TEST(TrueInertia, OfABunnyHeldByTheEarIsThatOfNumericalIntegration) {
  TANDEM_LOAD_SCENE(scene, "two_bunnies");
  const server::SolidShape& shape = scene->body_shapes[0][0];
  const Pose X_BS = proto::pose_from_placement(shape.shape.placement());
  ASSERT_EQ(shape.mesh_kind, geometry::SurfaceKind::kSolid) << "else its hull's mass is meant";
  Vec3 ear = Vec3::Zero();
  for (const Vec3& vertex : shape.mesh->vertices) ear = (X_BS * vertex).z() > ear.z() ? X_BS * vertex : ear;
  ASSERT_GT(ear.norm(), 0.03);
  const Integral whole = integrated(shape, ear);
  const double density = scene->world.bodies[0].mass.mass_kg / whole.volume;
  const auto [least, most] = body_at(*scene, ear);
  EXPECT_NEAR(most.inertia_kg_m2, density * largest_eigenvalue(whole.inertia), 1e-6 * most.inertia_kg_m2);
  const Vec3 centre = whole.first_moment / whole.volume;
  const Mat3 about_centre = density * integrated(shape, centre).inertia;
  EXPECT_NEAR(least.inertia_kg_m2, smallest_eigenvalue(about_centre), 1e-6 * least.inertia_kg_m2);
  EXPECT_GT(most.inertia_kg_m2, 2 * least.inertia_kg_m2);
  // A common approximation is the inertia of a rod of 5 cm with the body's mass. It is less than a fifth of the true
  // inertia. Fails if the approximation is used.
  EXPECT_GT(most.inertia_kg_m2, 5 * 0.1 * 0.05 * 0.05 / 12);
}

TEST(TrueInertia, OfAMoleculeHeldAtItsLastAtomIsTheSumOverItsAtoms) {
  TANDEM_LOAD_SCENE(scene, "docking_helices");
  const docking::Molecule& molecule = *scene->world.bodies[0].molecule;
  const double scale = scene->description.molecular_field().metres_per_angstrom();
  const Vec3 grip = scale * molecule.positions_angstrom.back();
  double total_u = 0;
  for (const double mass_u : molecule.mass_u) total_u += mass_u;
  const double kg_per_u = scene->world.bodies[0].mass.mass_kg / total_u;
  Mat3 about_grip = Mat3::Zero(), about_centre = Mat3::Zero();
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    const double atom_kg = kg_per_u * molecule.mass_u[i];
    // The mass m of each atom is spread by 1 Å along each axis. This adds 2 m · (1 Å)² to each principal moment.
    const Mat3 own = 2 * atom_kg * scale * scale * Mat3::Identity();
    about_grip += inertia_of(atom_kg, scale * molecule.positions_angstrom[i] - grip) + own;
    about_centre += inertia_of(atom_kg, scale * molecule.positions_angstrom[i]) + own;
  }
  const auto [least, most] = body_at(*scene, grip);
  EXPECT_NEAR(most.inertia_kg_m2, largest_eigenvalue(about_grip), 1e-6 * most.inertia_kg_m2);
  EXPECT_NEAR(least.inertia_kg_m2, smallest_eigenvalue(about_centre), 1e-6 * least.inertia_kg_m2);
  EXPECT_LT(least.mass_kg, 0.6 * most.mass_kg)
      << "a helix held at its end yields by rotation, so its effective mass is smaller";
}

// Reference: the 6×6 mass matrix at the grip, [m 1, m [c]×ᵀ; m [c]×, I_T], and its inverse.
// - m is the mass, 1 the unit matrix, and I_T the inertia about the grip.
// - c is the centre of mass relative to the grip, and [c]× the matrix of the cross product with c.
TEST(TrueInertia, EqualsThatOfTheMassMatrixAtTheGrip) {
  Random random(17, 0);
  const auto any = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE("seed 17, body " + std::to_string(i));
    const MassProperties mass{0.02 + random.uniform(),
                              {0.05 * any(), quaternion_of(any())},
                              Vec3(1e-5 + 1e-4 * random.uniform(), 1e-5 + 1e-4 * random.uniform(), 1e-4)};
    const Vec3 p_BT = 0.05 * any();
    const Vec3 c = mass.X_BC.p - p_BT;
    Mat6 M = Mat6::Zero();
    for (int column = 0; column < 6; ++column) {
      // Each column of the mass matrix is the wrench that causes a unit acceleration, by the Newton–Euler equations.
      // Columns 0 to 2 are linear, columns 3 to 5 angular accelerations.
      const Vec3 a = column < 3 ? Vec3(Vec3::Unit(column)) : Vec3(Vec3::Zero());
      const Vec3 alpha = column < 3 ? Vec3(Vec3::Zero()) : Vec3(Vec3::Unit(column - 3));
      const Vec3 f = mass.mass_kg * (a + alpha.cross(c));
      const Vec3 turned = mass.X_BC.q.conjugate() * alpha;
      M.col(column) << f, mass.X_BC.q * (mass.principal_inertia_kg_m2.cwiseProduct(turned)) + c.cross(f);
    }
    ASSERT_LT((M - M.transpose()).norm(), 1e-12 * M.norm());
    const Mat6 mobility = M.inverse();
    const auto [least, most] = resistance_at(mass, p_BT, true);
    EXPECT_NEAR(most.mass_kg, largest_eigenvalue(M.topLeftCorner<3, 3>()), 1e-9);
    EXPECT_NEAR(most.inertia_kg_m2, largest_eigenvalue(M.bottomRightCorner<3, 3>()), 1e-9 * most.inertia_kg_m2);
    EXPECT_NEAR(least.mass_kg, 1 / largest_eigenvalue(mobility.topLeftCorner<3, 3>()), 1e-9);
    EXPECT_NEAR(least.inertia_kg_m2, 1 / largest_eigenvalue(mobility.bottomRightCorner<3, 3>()),
                1e-8 * least.inertia_kg_m2);
  }
}

/// Returns the spectral radius of the rotational loop, as it is reported to the user.
double spectral_radius_with(const MassProperties& tool) {
  wire::Joined joined = test::minimal_joined();
  *joined.mutable_tool_masses(0) = test::on_wire(tool);
  const haptics::CouplingLawInfo& law = *haptics::find_coupling_law("spring-damper");
  CouplingCheck check;
  check.number = 1;
  check.scene.law = static_cast<std::size_t>(&law - haptics::coupling_laws().data());
  check.moved = things_to_move(joined, law, BodyId{});
  for (const auto& finding : explained(check, devices::find_device_profile("sigma.7"))) {
    if (finding.is_rotation) return finding.spectral_radius;
  }
  return 0;
}

TEST(TrueInertia, OfALongRodMakesALoopThatHardlyDecays) {
  // A rod of 1 m and 0.3 kg, held at its end, has an inertia of 0.1 kg·m². A common approximation is a rod of 5 cm with
  // the same mass; its loop is clearly stable. Fails if the approximation is used for the long rod.
  const MassProperties rod{0.3, {Vec3(0.5, 0, 0), Quat::Identity()}, Vec3(2e-6, 0.025, 0.025)};
  const MassProperties pen{0.3, {}, Vec3::Constant(0.3 * 0.05 * 0.05 / 12)};
  EXPECT_LT(spectral_radius_with(pen), 0.9995) << "decays within 2 s";
  EXPECT_GT(spectral_radius_with(rod), 0.99999) << "within 100 s";
  EXPECT_LT(spectral_radius_with(rod), 1) << "still stable: for both, a tool in stiff contact is the worst case";
}

TEST(ShippedScenes, AreNeitherRefusedNorWarnedOfOnTheSimulatedDevice) {
  const devices::DeviceProfile device = devices::find_device_profile("sim");
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("server/scenes"))) {
    if (entry.path().extension() != ".json") continue;
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    TANDEM_LOAD_SCENE(scene, name);
    for (std::uint32_t tool = 0; tool < scene->world.tools.size(); ++tool) {
      SessionSettings settings;
      settings.device = device;
      test::SessionBench bench(settings);
      bench.join(joined_of(*scene, tool));
      EXPECT_EQ(bench.state(), "active") << bench.session.status().why;
      EXPECT_TRUE(bench.scene_may_display());
      EXPECT_THAT(explained(bench.session.coupling_check(), device), testing::IsEmpty());
    }
    ++scenes;
  }
  EXPECT_GE(scenes, 6);
}

}  // namespace
}  // namespace tandem::client
