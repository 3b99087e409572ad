// Tests the geometry that is drawn for a scene, without a window.
#include "client/view/drawn_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <stop_token>

#include "common/docking/molecule_asset.hpp"
#include "common/geometry/drawing_asset.hpp"
#include "common/geometry/tessellation.hpp"
#include "proto/soft_shape.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

Vec3 vector_of(const std::array<float, 3>& a) {
  return {a[0], a[1], a[2]};
}

DrawnMesh drawn(const geometry::TriangleMesh& mesh) {
  DrawnMesh out;
  append_mesh(out, mesh, Pose{}, {1, 1, 1, 1});
  return out;
}

std::vector<Rgba> yellow(const docking::Molecule& molecule) {
  return std::vector<Rgba>(molecule.size(), Rgba{1, 1, 0, 1});
}

std::string add_asset(AssetMap& assets, const std::vector<std::byte>& bytes) {
  const proto::Sha256 hash = proto::sha256_of(bytes);
  assets[hash] = std::make_shared<const proto::Bytes>(bytes.begin(), bytes.end());
  return {reinterpret_cast<const char*>(hash.data()), hash.size()};
}

/// Adds an asset with the drawing of a mesh. The drawing belongs to a surface asset, which these tests do not provide.
/// Returns the hash of that surface asset.
std::string add_drawing(wire::Joined& joined, AssetMap& assets, const geometry::TriangleMesh& mesh) {
  const std::string surface(32, 's');
  wire::AssetInfo& info = *joined.add_assets();
  info.set_kind(geometry::kDrawingAssetKind);
  info.set_coarse_of(surface);
  info.set_sha256(add_asset(assets, geometry::drawing_asset_bytes(geometry::shaded(mesh))));
  return surface;
}

wire::Body& add_box(wire::Scene& scene, const std::string& name, const Vec3& at, double edge_m, double mass_kg) {
  wire::Body& body = *scene.add_bodies();
  body.set_name(name);
  body.set_mass_kg(mass_kg);
  for (const double x : at) body.mutable_placement()->add_position_m(x);
  for (int i = 0; i < 3; ++i) body.add_shapes()->mutable_box()->add_size_m(edge_m);
  wire::Shape shape;
  for (int i = 0; i < 3; ++i) shape.mutable_box()->add_size_m(edge_m);
  body.clear_shapes();
  *body.add_shapes() = shape;
  return body;
}

TEST(DrawnMesh, ABoxHasEdgesAndABallHasNone) {
  for (const Vertex& vertex : drawn(geometry::tessellated_box({0.1, 0.2, 0.3}))) {
    EXPECT_NEAR(vector_of(vertex.normal).cwiseAbs().maxCoeff(), 1, 1e-6) << "square to its face";
  }
  for (const Vertex& vertex : drawn(geometry::tessellated_sphere(1))) {
    EXPECT_GT(vector_of(vertex.normal).dot(vector_of(vertex.position_m)), 0.999);
  }
}

TEST(DrawnMesh, OmitsInvalidTriangles) {
  geometry::TriangleMesh mesh = geometry::tessellated_box({1, 1, 1});
  mesh.triangles[0] = {0, 1, 99};
  mesh.triangles[1] = {-1, 1, 2};
  mesh.triangles[2] = {3, 3, 3};
  EXPECT_THAT(drawn(mesh), SizeIs(3 * 9));
}

TEST(DrawnMesh, AMoleculesAtomsHaveTheColoursOfTheirElements) {
  docking::Molecule molecule;
  molecule.positions_angstrom = {{0, 0, 0}, {3, 0, 0}, {6, 0, 0}};
  molecule.mass_u = {12.011, 15.9994, 1.008};
  DrawnMesh out;
  append_balls(out, molecule, 0.01, atom_colors(molecule, MoleculeStyle::kByElement, {0.25F, 0.5F, 0.75F, 1}));
  double reach_m = 0;
  std::set<std::array<std::uint8_t, 4>> carbons, oxygens;
  for (const Vertex& vertex : out) {
    if (vertex.position_m[0] < 0.0145F) carbons.insert(vertex.color);
    if (vertex.position_m[0] > 0.0180F && vertex.position_m[0] < 0.045F) oxygens.insert(vertex.color);
    reach_m = std::max(reach_m, vector_of(vertex.position_m).x());
  }
  EXPECT_THAT(carbons, testing::ElementsAre(std::array<std::uint8_t, 4>{64, 128, 191, 255}));
  ASSERT_THAT(oxygens, SizeIs(1));
  EXPECT_GT((*oxygens.begin())[0], 180) << "red";
  EXPECT_NEAR(reach_m, 0.06 + 0.011, 1e-6) << "a hydrogen's radius";
}

TEST(DrawnMolecule, IsColouredByElementNameFirst) {
  docking::Molecule molecule;
  molecule.positions_angstrom.assign(4, Vec3::Zero());
  molecule.mass_u = {12.011, 14.027, 40.08, 65.4};
  const Rgba own{0.25F, 0.5F, 0.75F, 1};
  const auto by_mass = atom_colors(molecule, MoleculeStyle::kByElement, own);
  EXPECT_NE(by_mass[1], own) << "as heavy as nitrogen";
  EXPECT_EQ(by_mass[2], by_mass[3]) << "metals";
  EXPECT_NEAR(van_der_waals_radius_angstrom(molecule, 1), 1.55, 1e-9);
  molecule.elements = {"C", "C", "CA", "ZN"};
  const auto by_name = atom_colors(molecule, MoleculeStyle::kByElement, own);
  EXPECT_EQ(by_name[1], own) << "a carbon with its hydrogens united";
  EXPECT_NEAR(van_der_waals_radius_angstrom(molecule, 1), 1.70, 1e-9);
  EXPECT_EQ(by_name[2], by_mass[2]) << "calcium";
}

TEST(DrawnMolecule, IsColouredByChainAndByResidueWhereItHasNames) {
  docking::Molecule molecule;
  molecule.positions_angstrom.assign(6, Vec3::Zero());
  molecule.mass_u.assign(6, 12.011);
  const Rgba own{0.25F, 0.5F, 0.75F, 1};
  EXPECT_EQ(atom_colors(molecule, MoleculeStyle::kByChain, own), std::vector<Rgba>(6, own)) << "no names";
  molecule.chains = {"B", "B", "A", "C", "C", "A"};
  molecule.residue_names = {"ASP", "GLUH", "HSD", "ALA", "DG", "HOH"};
  const auto by_chain = atom_colors(molecule, MoleculeStyle::kByChain, own);
  EXPECT_EQ(by_chain[0], chain_color(0)) << "the first of the file";
  EXPECT_EQ(by_chain[2], chain_color(1));
  EXPECT_EQ(by_chain[5], chain_color(1)) << "again";
  EXPECT_EQ(by_chain[3], chain_color(2));
  EXPECT_EQ(chain_count(molecule), 3U);
  EXPECT_EQ(atom_colors(molecule, MoleculeStyle::kByChain, own, 3)[2], chain_color(4)) << "of a scene's next molecule";
  const auto by_residue = atom_colors(molecule, MoleculeStyle::kByResidue, own);
  EXPECT_EQ(by_residue[0], by_residue[1]) << "acidic, whatever its protons";
  EXPECT_THAT(std::set<Rgba>(by_residue.begin(), by_residue.end()), SizeIs(5));
}

TEST(DrawnScene, FocusesOnMovableBodiesAndNotOnTheTable) {
  wire::Joined joined = test::minimal_joined();
  add_box(*joined.mutable_scene(), "table", {0, 0, -0.5}, 1.0, 0);
  add_box(*joined.mutable_scene(), "cube", {0.02, 0, 0.03}, 0.04, 0.1);
  add_box(*joined.mutable_scene(), "block", {-0.06, 0, 0.02}, 0.04, 0);
  const DrawnScene scene = make_drawn_scene(joined, {});
  ASSERT_THAT(scene.bodies, SizeIs(3));
  EXPECT_THAT(scene.missing, SizeIs(0));
  EXPECT_LT(scene.focus_radius_m, 0.2);
  for (const std::size_t seen : {1U, 2U}) {
    const DrawnBody& body = scene.bodies[seen];
    EXPECT_LE((body.X_WB_start.p - scene.focus_W).norm() + body.radius_m, scene.focus_radius_m) << body.name;
  }
  EXPECT_NEAR(scene.floor_z_m, -1, 1e-6);
}

TEST(DrawnScene, DrawsSurfacesAndMoleculesOnceAvailableAndListsMissingOnes) {
  AssetMap assets;
  wire::Joined joined = test::minimal_joined();
  wire::Scene& wire_scene = *joined.mutable_scene();
  wire_scene.mutable_molecular_field()->set_metres_per_angstrom(0.01);
  docking::Molecule molecule;
  molecule.positions_angstrom = {{0, 0, 0}};
  molecule.sigma_angstrom = {3.5};
  molecule.epsilon_kj_per_mol = {0.3};
  molecule.charge_e = {0};
  molecule.mass_u = {12.011};
  wire::Shape mesh, atoms;
  mesh.mutable_mesh()->set_surface_sha256(add_drawing(joined, assets, geometry::tessellated_box({0.1, 0.1, 0.1})));
  atoms.mutable_molecule()->set_asset_sha256(add_asset(assets, docking::molecule_asset_bytes(molecule)));
  for (const wire::Shape* shape : {&mesh, &atoms}) {
    wire::Body& body = *wire_scene.add_bodies();
    body.set_name(shape->has_mesh() ? "stone" : "methane");
    body.set_mass_kg(1);
    *body.add_shapes() = *shape;
  }
  const DrawnScene blind = make_drawn_scene(joined, {});
  EXPECT_THAT(blind.missing, testing::ElementsAre(HasSubstr("stone"), HasSubstr("methane")));
  const DrawnScene scene = make_drawn_scene(joined, assets);
  EXPECT_THAT(scene.missing, SizeIs(0));
  EXPECT_THAT(scene.bodies[0].mesh, SizeIs(36));
  EXPECT_GT(scene.bodies[1].mesh.size(), 300U);
}

TEST(DrawnScene, TheFinestAvailableLevelOfAMeshIsDrawn) {
  AssetMap coarse, all;
  wire::Joined joined = test::minimal_joined();
  add_drawing(joined, all, geometry::tessellated_sphere(0.1));
  const std::string surface = add_drawing(joined, coarse, geometry::tessellated_box({0.1, 0.1, 0.1}));
  all.insert(coarse.begin(), coarse.end());
  wire::Body& body = *joined.mutable_scene()->add_bodies();
  body.add_shapes()->mutable_mesh()->set_surface_sha256(surface);
  EXPECT_THAT(make_drawn_scene(joined, coarse).bodies[0].mesh, SizeIs(36));
  EXPECT_THAT(make_drawn_scene(joined, all).bodies[0].mesh,
              SizeIs(3 * geometry::tessellated_sphere(0.1).triangles.size()));
  body.mutable_shapes(0)->mutable_mesh()->set_surface_sha256(std::string(32, 't'));
  EXPECT_THAT(make_drawn_scene(joined, all).missing, SizeIs(1)) << "of another mesh";
}

TEST(DrawnScene, HostileBytesGiveOnlyValidDrawings) {
  AssetMap assets;
  wire::Joined joined = test::minimal_joined();
  wire::Body& body = *joined.mutable_scene()->add_bodies();
  body.set_name("\x1b[2J");
  body.add_shapes()->mutable_mesh()->set_surface_sha256(std::string(32, 's'));
  wire::AssetInfo& info = *joined.add_assets();
  info.set_kind(geometry::kDrawingAssetKind);
  info.set_coarse_of(std::string(32, 's'));
  info.set_sha256(add_asset(assets, {std::byte{1}, std::byte{2}}));
  body.add_shapes()->mutable_box()->add_size_m(1);
  body.add_shapes();
  const DrawnScene scene = make_drawn_scene(joined, assets);
  EXPECT_THAT(scene.missing, SizeIs(3));
  EXPECT_EQ(scene.bodies[0].name.find('\x1b'), std::string::npos);
}

TEST(DrawnScene, ASoftBlockIsDrawnAsItYields) {
  wire::Joined joined = test::minimal_joined();
  wire::SoftBody& pad = *joined.mutable_scene()->add_soft_bodies();
  pad.set_name("pad");
  for (const double size_m : {0.1, 0.2, 0.04}) pad.mutable_block()->add_size_m(size_m);
  pad.mutable_placement()->add_rotation_xyz_deg(0);
  pad.mutable_placement()->add_rotation_xyz_deg(0);
  pad.mutable_placement()->add_rotation_xyz_deg(90);
  const DrawnScene scene = make_drawn_scene(joined, {});
  ASSERT_THAT(scene.soft_bodies, SizeIs(1));
  const auto reach = [](const DrawnMesh& mesh) {
    Vec3 most = Vec3::Zero();
    for (const Vertex& vertex : mesh) most = most.cwiseMax(vector_of(vertex.position_m));
    return most;
  };
  EXPECT_LT((reach(scene.soft_bodies[0].mesh) - Vec3(0.05, 0.1, 0.02)).norm(), 1e-6);
  const std::vector<Vec3> offsets(proto::kSoftLatticePoints, Vec3(0.01, 0, 0));
  const Vec3 moved = reach(drawn_soft(scene.soft_bodies[0], offsets)) - reach(scene.soft_bodies[0].mesh);
  EXPECT_LT((moved - Vec3(0, -0.01, 0)).norm(), 1e-6) << "offsets are of the world, which is turned";
  EXPECT_THAT(drawn_soft(scene.soft_bodies[0], {offsets.data(), 7}), SizeIs(0));
}

TEST(DrawnScene, ASoftMeshFollowsTheReceivedNodes) {
  AssetMap assets;
  wire::Joined joined = test::minimal_joined();
  const geometry::TriangleMesh ball = geometry::decimated(geometry::tessellated_sphere(0.03), 1500);
  wire::SoftBody& soft = *joined.mutable_scene()->add_soft_bodies();
  soft.set_name("ball");
  soft.mutable_mesh()->set_surface_sha256(add_drawing(joined, assets, ball));
  for (const double degrees : {0, 0, 90}) soft.mutable_placement()->add_rotation_xyz_deg(degrees);
  EXPECT_THAT(make_drawn_scene(joined, {}).missing, testing::ElementsAre(HasSubstr("ball")));
  const DrawnScene scene = make_drawn_scene(joined, assets);
  EXPECT_THAT(scene.missing, SizeIs(0));
  ASSERT_THAT(scene.soft_bodies[0].mesh, SizeIs(3 * ball.triangles.size()));
  // Offsets as the server sends them for a sheared body: each node is displaced along the world's x axis by a tenth of
  // its height.
  std::vector<Vec3> offsets;
  for (const proto::NearPlaces& nodes : proto::soft_lattice_nodes(ball.vertices)) {
    Vec3 offset = Vec3::Zero();
    for (const auto& [node, weight] : nodes) offset += weight * 0.1 * ball.vertices[node].z() * Vec3::UnitX();
    offsets.push_back(offset);
  }
  const DrawnMesh sheared = drawn_soft(scene.soft_bodies[0], offsets);
  ASSERT_THAT(sheared, SizeIs(scene.soft_bodies[0].mesh.size()));
  for (std::size_t i = 0; i < sheared.size(); ++i) {
    const Vec3 was = vector_of(scene.soft_bodies[0].mesh[i].position_m), is = vector_of(sheared[i].position_m);
    EXPECT_LT((is - was - Vec3(0, -0.1 * was.z(), 0)).norm(), 1e-3) << "the body is turned by 90° about z";
  }
}

TEST(DrawnMesh, SticksAreWhereAtomsAreBonded) {
  docking::Molecule molecule;
  // The first two atoms are bonded carbons. Two hydrogens are bonded to the first carbon; they are close to each other
  // but not bonded. The third hydrogen is far away.
  molecule.positions_angstrom = {{0, 0, 0}, {1.54, 0, 0}, {0, 1.09, 0}, {9, 0, 0}, {-0.2, -1.07, 0}};
  molecule.mass_u = {12.011, 12.011, 1.008, 1.008, 1.008};
  DrawnMesh bonded, alone;
  append_sticks(bonded, molecule, 0.01, yellow(molecule));
  molecule.positions_angstrom = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {9, 0, 0}, {0, -4, 0}};
  append_sticks(alone, molecule, 0.01, yellow(molecule));
  DrawnMesh one;
  molecule.positions_angstrom = {{0, 0, 0}, {1.54, 0, 0}, {0, 4, 0}, {9, 0, 0}, {0, -4, 0}};
  append_sticks(one, molecule, 0.01, yellow(molecule));
  const std::size_t stick = one.size() - alone.size();
  EXPECT_GT(stick, 0U);
  EXPECT_EQ(bonded.size() - alone.size(), 3 * stick);
}

TEST(DrawnMesh, AtomsOfLargeMoleculesAreOfFewTriangles) {
  for (const auto& [atoms, triangles] : {std::pair(100U, 512U), {5000U, 32U}, {30'000U, 8U}}) {
    docking::Molecule molecule;
    for (unsigned i = 0; i < atoms; ++i) molecule.positions_angstrom.emplace_back(1.5 * i, 0, 0);
    molecule.mass_u.assign(atoms, 12.011);
    DrawnMesh balls, sticks;
    append_balls(balls, molecule, 0.01, yellow(molecule));
    EXPECT_EQ(balls.size() / 3, std::size_t{triangles} * atoms);
    append_sticks(sticks, molecule, 0.01, yellow(molecule));
    EXPECT_LT(sticks.size() / 3, std::size_t{atoms} * (atoms > 20'000 ? 8 + 2 * 10 : 128 + 2 * 40));
  }
}

TEST(DrawnMesh, AMillionAtomsAreDrawnWithFewerBallsAndWithoutSticks) {
  docking::Molecule molecule;
  for (unsigned i = 0; i < 1'000'000; ++i) molecule.positions_angstrom.emplace_back(1.5 * i, 0, 0);
  molecule.mass_u.assign(1'000'000, 12.011);
  DrawnMesh balls, sticks;
  append_balls(balls, molecule, 0.01, yellow(molecule));
  EXPECT_EQ(balls.size() / 24, 250'000U);
  EXPECT_NEAR(balls.front().position_m[0], 0.01 * 1.5 * 1.5 + 0.017 * std::cbrt(4), 1e-5);
  append_sticks(sticks, molecule, 0.01, yellow(molecule));
  EXPECT_EQ(sticks.size(), balls.size());
}

/// Draws 3000 atoms at nearly the same position, which a hostile server may send. The number of tested pairs, and of
/// drawn sticks, must remain bounded.
TEST(DrawnMesh, TheNumberOfSticksOfAnAtomIsBounded) {
  docking::Molecule molecule;
  constexpr unsigned kAtoms = 3000;
  for (unsigned i = 0; i < kAtoms; ++i) molecule.positions_angstrom.emplace_back(1e-4 * i, 0, 0);
  molecule.mass_u.assign(kAtoms, 12.011);
  DrawnMesh balls, sticks;
  append_balls(balls, molecule, 0.01, yellow(molecule));
  append_sticks(sticks, molecule, 0.01, yellow(molecule));
  EXPECT_LE(sticks.size(), balls.size() + std::size_t{kAtoms} * 16 * 2 * 3 * 40);
}

TEST(DrawnMesh, NothingIsAppendedAfterAStopRequest) {
  docking::Molecule molecule;
  molecule.positions_angstrom.assign(5, Vec3::Zero());
  molecule.mass_u.assign(5, 12.011);
  std::stop_source stop;
  stop.request_stop();
  DrawnMesh out;
  append_balls(out, molecule, 0.01, yellow(molecule), stop.get_token());
  append_sticks(out, molecule, 0.01, yellow(molecule), stop.get_token());
  EXPECT_THAT(out, SizeIs(0));
}

TEST(DrawnScene, ToolsDifferInColour) {
  std::set<Rgba> colors;
  for (std::size_t tool = 0; tool < 6; ++tool) colors.insert(tool_color(tool));
  EXPECT_THAT(colors, SizeIs(6));
}

TEST(DrawnScene, ARayMeetsTheNearestBodyWhereItIs) {
  wire::Joined joined = test::minimal_joined();
  add_box(*joined.mutable_scene(), "near", {0, 0, 0}, 0.04, 0.1);
  add_box(*joined.mutable_scene(), "far", {0, 0, 0}, 0.04, 0.1);
  const DrawnScene scene = make_drawn_scene(joined, {});
  const Quat quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  const std::vector<Pose> X_WB{{{0, 0.2, 0}, quarter}, {{0, 0.5, 0}, Quat::Identity()}};
  const auto hit = first_hit(scene, X_WB, {0.01, -1, 0.005}, {0, 1, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->first, 0U);
  EXPECT_LT((X_WB[0] * hit->second - Vec3(0.01, 0.18, 0.005)).norm(), 1e-6);
  EXPECT_EQ(first_hit(scene, X_WB, {0.03, -1, 0}, {0, 1, 0}), std::nullopt) << "beside both";
  EXPECT_EQ(first_hit(scene, X_WB, {0, 1, 0}, {0, 1, 0}), std::nullopt) << "behind it";
}

}  // namespace
}  // namespace tandem::client
