// Tests the files that a scene names: meshes, the cache of their contact shapes, and the assets announced to clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/geometry/tessellation.hpp"
#include "server/assets/scene_file.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Creates a temporary folder for the files of a test.
class SceneFiles : public ::testing::Test {
 protected:
  SceneFiles() : directory_(std::filesystem::path(::testing::TempDir()) / unique_name()) {
    std::filesystem::create_directories(directory_);
  }
  ~SceneFiles() override { std::filesystem::remove_all(directory_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(directory_ / name) << text; }
  std::shared_ptr<const LoadedScene> load(const std::string& json) const {
    return load_scene_text(json, "test.json", directory_);
  }
  std::string refusal(const std::string& json) const {
    try {
      load(json);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "accepted";
  }

  std::filesystem::path directory_;

 private:
  static std::string unique_name() {
    const auto* const info = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("tandem_") + info->test_suite_name() + "_" + info->name();
    std::replace(name.begin(), name.end(), '/', '_');
    return name;
  }
};

// A tetrahedron with edges of length 2 along the axes, and two parts that must be skipped: a triangle without area and
// a line.
constexpr const char* kTetrahedron =
    "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\n"
    "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 2 2\nl 1 2\n";

std::string mesh_body(const std::string& mesh_fields, const std::string& body_fields = "") {
  return physics::scene_json(
      {.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": "t.obj")" + mesh_fields + "}}]" + body_fields + "}"});
}

TEST_F(SceneFiles, MeshIsScaledToItsLargestSizeAndCentred) {
  write("t.obj", kTetrahedron);
  const auto scene = load(mesh_body(R"(, "largest_size_m": 0.1, "centre": true)"));
  const geometry::TriangleMesh& mesh = *scene->body_shapes[0][0].mesh;
  EXPECT_EQ(mesh.triangles.size(), 4U);
  Vec3 low = mesh.vertices[0], high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  EXPECT_TRUE(low.isApprox(Vec3::Constant(-0.05), 1e-9)) << low.transpose();
  EXPECT_TRUE(high.isApprox(Vec3::Constant(0.05), 1e-9)) << high.transpose();
  EXPECT_NEAR(scene->description.bodies(0).shapes(0).mesh().scale(), 0.05, 1e-12);
}

TEST_F(SceneFiles, DroppedTrianglesAreNoted) {
  write("t.obj", kTetrahedron);
  EXPECT_THAT(load(mesh_body(""))->notes,
              ::testing::ElementsAre("t.obj: a solid of 4 triangles: closed, 1.33e+06 cm³",
                                     HasSubstr("1 triangle without area"),
                                     ::testing::AllOf(HasSubstr("t.obj: contact"), HasSubstr("points every"))));
}

TEST_F(SceneFiles, EachPartOfAMeshIsNoted) {
  write("t.obj", std::string(kTetrahedron) + "v 5 0 0\nv 6 0 0\nv 5 1 0\nf 5 6 7\n");
  EXPECT_THAT(load(mesh_body(R"(, "scale": 0.01)"))->notes,
              ::testing::IsSupersetOf({HasSubstr("t.obj: a solid of 4 triangles: closed, 1.33 cm³"),
                                       HasSubstr("t.obj: a sheet of 1 triangle: open, 1 hole")}));
}

TEST_F(SceneFiles, ShapesThatAreTooThinToHoldAreNotedByNameWithTheRemedy) {
  const auto notes_of = [this](double radius_m) {
    return load(physics::scene_json({.bodies = R"({"name": "wire", "shapes": [{"capsule": {"radius_m": )" +
                                               std::to_string(radius_m) + R"(, "length_m": 0.02}}]})"}))
        ->notes_for_users;
  };
  EXPECT_THAT(notes_of(5e-5), Contains(AllOf(HasSubstr("bodies[0].shapes[0] is 0.1 mm thick, too thin to hold"),
                                             HasSubstr("make it 0.15 mm thick or more"))));
  EXPECT_THAT(notes_of(1e-4), Not(Contains(HasSubstr("thick"))));
}

TEST_F(SceneFiles, MeshOfAnUnlikelySizeIsNotedWithTheFieldThatMendsIt) {
  write("t.obj", "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n");
  const auto notes_of = [this](const std::string& fields) { return load(mesh_body(fields))->notes; };
  const auto asks_for_scale = Contains(AllOf(HasSubstr("m large, if a unit of the file is"), HasSubstr("scale")));
  EXPECT_THAT(notes_of(R"(, "scale": 2)"),
              Contains("t.obj: 4 m large, if a unit of the file is 2 m: is that right? Else "
                       "give the mesh scale (0.001 if the file is in millimetres) or "
                       "largest_size_m"));
  EXPECT_THAT(notes_of(R"(, "scale": 0.0001)"), asks_for_scale);
  EXPECT_THAT(notes_of(R"(, "largest_size_m": 0.0002)"), Not(asks_for_scale)) << "this one was meant";
  EXPECT_THAT(refusal(mesh_body(R"(, "scale": 100)")),
              AllOf(HasSubstr("which is 200 m large"), HasSubstr("0.001 if the file is in millimetres")));
}

TEST_F(SceneFiles, MeshesOfAnUnlikelySizeAreReportedBeforeAnythingIsBuilt) {
  write("t.obj", kTetrahedron);
  write("u.obj", "v 0 0 0\nv 5 0 0\nv 0 5 0\nf 1 2 3\n");  // a sheet, which is built much faster than a solid
  std::vector<std::string> events;
  SceneLoading loading;
  loading.cache_directory.clear();
  loading.warn = [&events](const std::string& warning) { events.push_back(warning); };
  loading.progress = [&events](const std::string&, double) { events.push_back("built"); };
  load_scene_text(
      physics::scene_json({.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": "t.obj", "scale": 0.01}}]},
                                                   {"name": "b", "shapes": [{"mesh": {"file": "u.obj"}}]})"}),
      "test.json", directory_, loading);
  ASSERT_GT(events.size(), 1U);
  EXPECT_THAT(events[0], AllOf(HasSubstr("u.obj: 5 m large"), HasSubstr("scale (0.001"), HasSubstr("largest_size_m")));
  EXPECT_THAT(std::vector(events.begin() + 1, events.end()), ::testing::Each("built"));
}

TEST_F(SceneFiles, MovingMeshHasTheInertiaOfItsSolid) {
  write("t.obj", kTetrahedron);
  const MassProperties mass = load(mesh_body("", R"(, "mass_kg": 3)"))->world.bodies[0].mass;
  // Expected inertia of a tetrahedron with the mass m and three edges of the length a = 2 along the axes:
  // 1. Its centroid is at a/4 on each axis. About it, ∫x² = 3ma²/80 and ∫xy = −ma²/80.
  // 2. The matrix of these second moments has the eigenvalues ma²/80·(1, 4, 4).
  // 3. Each principal inertia is the sum of two eigenvalues: ma²/80·(8, 5, 5).
  EXPECT_TRUE(mass.X_BC.p.isApprox(Vec3::Constant(0.5), 1e-9));
  const double ma2 = 3.0 * 4.0;
  EXPECT_NEAR(mass.principal_inertia_kg_m2.maxCoeff(), 8 * ma2 / 80, 1e-9);
  EXPECT_NEAR(mass.principal_inertia_kg_m2.minCoeff(), 5 * ma2 / 80, 1e-9);
  EXPECT_NEAR(mass.principal_inertia_kg_m2.sum(), 18 * ma2 / 80, 1e-9);
}

TEST_F(SceneFiles, BrokenMeshesAreRefused) {
  write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(refusal(mesh_body("", R"(, "mass_kg": 1)")),
              AllOf(HasSubstr("bodies[0].mass_kg is 1, but a shape encloses no volume"),
                    HasSubstr("a sheet has none of its own"), HasSubstr("make it static (0)")));
  write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\n");
  EXPECT_THAT(refusal(mesh_body("")), HasSubstr("t.obj, which cannot be touched: no triangle"));
  write("t.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(refusal(mesh_body("")), HasSubstr("t.obj, which"));
  write("t.obj", std::string("\0\1\2garbage", 10));
  EXPECT_THAT(refusal(mesh_body("")), HasSubstr("t.obj, which has no triangle; export"));
  write("t.obj", "");
  EXPECT_THAT(refusal(mesh_body("")), HasSubstr("t.obj, which is empty; export the mesh again"));
}

TEST_F(SceneFiles, BinaryPlyMayBeginWithTheByteOfANewline) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
  const auto append = [&ply](const auto& value) { ply.append(reinterpret_cast<const char*>(&value), sizeof value); };
  // The lowest byte of 0.04 in single precision is 10, the code of a line feed. A reader that splits the binary body
  // into lines fails here.
  for (const float x : {0.04F, 0.F, 0.F, 0.F, 0.F, 0.F, 0.F, 0.04F, 0.F, 0.F, 0.F, 0.04F}) append(x);
  for (const auto& corners : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
    ply += '\3';
    for (const int corner : corners) append(corner);
  }
  write("t.ply", ply);
  const auto scene =
      load(physics::scene_json({.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": "t.ply"}}], "mass_kg": 1})"}));
  EXPECT_NEAR(scene->world.bodies[0].mass.X_BC.p.sum(), 0.03, 1e-8);
}

TEST_F(SceneFiles, MeshWithoutTrianglesOrInAnotherFormatIsRefusedInWordsOfItsOwn) {
  const auto refusal_of = [this](const std::string& name, const std::string& text) {
    write(name, text);
    return refusal(
        physics::scene_json({.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": ")" + name + R"("}}]})"}));
  };
  const std::string vertices = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n";
  EXPECT_THAT(refusal_of("cloud.ply", vertices + "property float z\nend_header\n0 0 0\n"),
              AllOf(HasSubstr("cloud.ply, which has no triangle: its elements are"), HasSubstr("export its surface")));
  EXPECT_THAT(refusal_of("lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n"),
              HasSubstr("lines.obj, which has no triangle"));
  EXPECT_THAT(refusal_of("other.stl", kTetrahedron),
              AllOf(HasSubstr("other.stl, which is not a mesh"), HasSubstr("in the format that its name says"),
                    Not(HasSubstr("give a file such as"))));
  EXPECT_THAT(refusal_of("mesh.xyz", "nothing that anybody reads"), HasSubstr("give .obj, .stl, .ply"));
  EXPECT_THAT(refusal_of("t.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99\n"),
              HasSubstr("t.off, which has a face with an index beyond its last vertex"));
  EXPECT_THAT(refusal_of("t.gltf", R"({"asset": {"version": "2.0"}, "scene": 0})"),
              AllOf(HasSubstr("t.gltf, which is not a mesh"), HasSubstr("; export the mesh again")));
  std::filesystem::create_directory(directory_ / "d.obj");
  EXPECT_THAT(refusal(physics::scene_json({.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": "d.obj"}}]})"})),
              HasSubstr("d.obj, which is a folder; give a file in it"));
}

TEST_F(SceneFiles, MeshThatDeclaresMoreThanItHoldsIsRefusedBeforeItIsAllocated) {
  write("t.ply",
        "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n");
  const std::string body = R"({"name": "a", "shapes": [{"mesh": {"file": "t.ply"}}]})";
  EXPECT_THAT(refusal(physics::scene_json({.bodies = body})),
              AllOf(HasSubstr("t.ply, which "), HasSubstr("export the mesh again")));
}

TEST_F(SceneFiles, MeshCannotBeReadWithoutTheReaderWhichIsNamed) {
  write("t.obj", kTetrahedron);
  setenv("TANDEM_MESH_READER", "/nowhere/reader", 1);
  const std::string text = refusal(mesh_body(""));
  unsetenv("TANDEM_MESH_READER");
  EXPECT_THAT(text, AllOf(HasSubstr("t.obj, which cannot be read, for /nowhere/reader cannot be started"),
                          HasSubstr("set TANDEM_MESH_READER")));
  EXPECT_EQ(refusal(mesh_body("")), "accepted");
}

TEST_F(SceneFiles, AFileThatIsNotAMeshIsRefusedWithTheReadersMessage) {
  write("t.obj", kTetrahedron);
  write("liar", "#!/bin/sh\nprintf 'M\\003\\000\\000\\000\\377\\377\\377\\377'\n");
  std::filesystem::permissions(directory_ / "liar", std::filesystem::perms::owner_all);
  setenv("TANDEM_MESH_READER", (directory_ / "liar").c_str(), 1);
  const std::string text = refusal(mesh_body(""));
  unsetenv("TANDEM_MESH_READER");
  EXPECT_THAT(text, HasSubstr("t.obj, which is so damaged that its reader fails; export the mesh again"));
}

TEST_F(SceneFiles, BuildingLongerThanAllowedIsRefusedWithTheRemedy) {
  write("t.obj", kTetrahedron);
  SceneLoading loading;
  loading.cache_directory.clear();
  loading.max_build = std::chrono::nanoseconds(1);
  try {
    load_scene_text(mesh_body(R"(, "largest_size_m": 0.05)"), "test.json", directory_, loading);
    FAIL() << "built within a nanosecond";
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("t.obj, which cannot be touched"), HasSubstr("--build-limit")));
  }
}

TEST_F(SceneFiles, SceneFileLargerThanAnyIsNotRead) {
  const std::filesystem::path file = directory_ / "sparse.json";
  write("sparse.json", "");
  std::filesystem::resize_file(file, std::uintmax_t{1} << 40U);
  try {
    load_scene(file);
    FAIL() << "a scene of a tebibyte was read";
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), HasSubstr("is larger than 1 MiB"));
  }
}

TEST_F(SceneFiles, MeshFarFromItsOriginIsRefusedUntilItIsCentred) {
  std::string text;
  for (const char* corner : {"700 0 0", "700.05 0 0", "700 0.05 0", "700 0 0.05"})
    text += std::string("v ") + corner + "\n";
  write("t.obj", text + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_THAT(refusal(mesh_body("")),
              AllOf(HasSubstr("test.json: bodies[0].shapes[0].mesh.file is t.obj, which cannot be touched: the mesh"),
                    HasSubstr("reaches 700 m"), HasSubstr("\"centre\": true")));
  EXPECT_EQ(refusal(mesh_body(R"(, "centre": true)")), "accepted");
}

TEST_F(SceneFiles, BodyWithoutVolumeIsRefusedBeforeItsContactIsBuilt) {
  write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  SceneLoading loading;
  loading.cache_directory.clear();
  bool is_built = false;
  loading.progress = [&](const std::string&, double) { is_built = true; };
  const std::string sheet = R"("shapes": [{"mesh": {"file": "t.obj"}}])";
  for (const std::string& json :
       {mesh_body("", R"(, "mass_kg": 1)"), physics::scene_json({.tools = R"({"name": "t", )" + sheet + "}"})}) {
    EXPECT_THROW(load_scene_text(json, "test.json", directory_, loading), SceneError);
    EXPECT_FALSE(is_built);
  }
}

TEST_F(SceneFiles, AnOpenPartBesideAClosedOneIsTouchedToo) {
  write("t.obj",
        "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        "v 4 0 0\nv 6 0 0\nv 6 2 0\nv 4 2 0\nf 5 6 7\nf 5 7 8\n");
  const auto scene = load(mesh_body(R"(, "scale": 0.01)"));
  const contact::ContactShape& shape = *scene->world.bodies[0].touch.parts[0].shape;
  EXPECT_GT(shape.high_S.x(), 0.059);
  EXPECT_LT(shape.field->distance_m(Vec3(0.05, 0.01, 0)), 0) << "a plate";
  EXPECT_LT(shape.field->distance_m(Vec3(0.004, 0.004, 0.004)), 0) << "a solid";
  EXPECT_GT(shape.field->distance_m(Vec3(0.03, 0.01, 0)), 0);
  const auto surface = geometry::surface_from(*scene->assets[2].bytes);
  ASSERT_TRUE(surface.has_value());
  EXPECT_EQ(surface->triangles.size(), 6U);
}

TEST_F(SceneFiles, OfALargeAssetACoarseOneIsOfferedThatNamesIt) {
  std::ostringstream text;
  const geometry::TriangleMesh mesh = geometry::tessellated_sphere(0.04);
  for (const Vec3& p : mesh.vertices) text << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : mesh.triangles) text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  write("t.obj", text.str());
  const auto scene = load(mesh_body(""));
  const auto of_kind = [&scene](const std::string& kind) {
    return std::ranges::find(scene->assets, kind, &Asset::kind);
  };
  const auto fine = of_kind("contact"), coarse = of_kind("coarse-contact");
  ASSERT_NE(coarse, scene->assets.end());
  EXPECT_EQ(coarse->coarse_of, fine->sha256);
  EXPECT_LT(coarse->bytes->size(), fine->bytes->size() / 4);
  const auto shape = contact::contact_shape_from(octets_of(*coarse->bytes));
  ASSERT_NE(shape, nullptr);
  EXPECT_NEAR(shape->field->distance_m(Vec3(0.041, 0, 0)), 1e-3, 5e-4);
}

TEST_F(SceneFiles, AssetIsTheFileAndItsHash) {
  write("t.obj", kTetrahedron);
  const std::string body = R"("shapes": [{"mesh": {"file": "t.obj"}}]})";
  const auto scene = load(physics::scene_json({.bodies = R"({"name": "a", )" + body + R"(, {"name": "b", )" + body}));
  std::vector<std::string> kinds;
  for (const Asset& asset : scene->assets) kinds.push_back(asset.kind);
  ASSERT_THAT(kinds, testing::ElementsAre("mesh", "contact", "coarse-contact", "surface", "drawing"))
      << "a file used twice must be one asset, with one of each derived asset";
  EXPECT_EQ(scene->assets[0].name, "t.obj");
  EXPECT_EQ(scene->assets[0].kind, "mesh");
  EXPECT_EQ(scene->assets[0].bytes->size(), std::string(kTetrahedron).size());
  EXPECT_EQ(scene->assets[0].sha256, proto::sha256_of(*scene->assets[0].bytes));
  EXPECT_EQ(scene->assets[1].kind, "contact");
  EXPECT_EQ(scene->assets[1].sha256, proto::sha256_of(*scene->assets[1].bytes));
  const std::string& named = scene->description.bodies(1).shapes(0).mesh().contact_sha256();
  EXPECT_EQ(named, std::string(reinterpret_cast<const char*>(scene->assets[1].sha256.data()), 32))
      << "a client finds a mesh's contact asset by its hash";
}

TEST_F(SceneFiles, SurfaceAssetIsTheMeshAsItIsTouched) {
  write("t.obj", kTetrahedron);
  const auto scene = load(mesh_body(R"(, "largest_size_m": 0.1, "centre": true)"));
  const Asset& asset = scene->assets.at(scene->assets.size() - 2);
  EXPECT_EQ(asset.kind, "surface");
  EXPECT_EQ(asset.name, "t.obj.100000um.surface");
  EXPECT_EQ(asset.sha256, proto::sha256_of(*asset.bytes));
  EXPECT_EQ(scene->description.bodies(0).shapes(0).mesh().surface_sha256(),
            std::string(reinterpret_cast<const char*>(asset.sha256.data()), 32));
  const auto surface = geometry::surface_from(*asset.bytes);
  ASSERT_TRUE(surface.has_value());
  const geometry::TriangleMesh& mesh = *scene->body_shapes[0][0].mesh;
  EXPECT_EQ(surface->triangles, mesh.triangles);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_LT((surface->vertices[i] - mesh.vertices[i]).norm(), 1e-8) << "scaled and centred, in single precision";
  }
}

TEST_F(SceneFiles, ContactAssetOfAMeshComesFromTheCacheTheSecondTime) {
  write("t.obj", kTetrahedron);
  SceneLoading loading;
  loading.cache_directory = directory_ / "cache";
  const auto load_with_cache = [&] {
    return load_scene_text(mesh_body(R"(, "largest_size_m": 0.02)"), "test.json", directory_, loading);
  };
  const auto built = load_with_cache();
  EXPECT_THAT(built->notes.back(), HasSubstr("contact built in"));
  const auto cached = load_with_cache();
  EXPECT_THAT(cached->notes.back(), HasSubstr("contact from cache in"));
  EXPECT_EQ(built->assets[1].sha256, cached->assets[1].sha256);

  // A truncated cache entry must be discarded and built again.
  const auto entry = *std::filesystem::directory_iterator(loading.cache_directory);
  std::filesystem::resize_file(entry.path(), entry.file_size() / 2);
  const auto rebuilt = load_with_cache();
  EXPECT_THAT(rebuilt->notes.back(), HasSubstr("contact built in"));
  EXPECT_EQ(built->assets[1].sha256, rebuilt->assets[1].sha256) << "equal meshes must give equal bytes";
  EXPECT_THAT(load_with_cache()->notes.back(), HasSubstr("contact from cache in")) << "and is kept again";
}

/// A way to damage a cache entry.
struct BadEntry {
  const char* name;
  std::function<void(const std::filesystem::path& entry)> write_entry;
};
void PrintTo(const BadEntry& entry, std::ostream* os) {
  *os << entry.name;
}
class BadCache : public SceneFiles, public ::testing::WithParamInterface<BadEntry> {};

constexpr const char* kSmall = R"(, "largest_size_m": 0.01)";

TEST_P(BadCache, EntryIsIgnored) {
  write("t.obj", kTetrahedron);
  SceneLoading loading;
  loading.cache_directory = directory_ / "cache";
  const auto load_with_cache = [&] { return load_scene_text(mesh_body(kSmall), "test.json", directory_, loading); };
  const auto built = load_with_cache();
  const std::filesystem::path entry = std::filesystem::directory_iterator(loading.cache_directory)->path();
  std::filesystem::remove(entry);
  GetParam().write_entry(entry);
  const auto rebuilt = load_with_cache();
  EXPECT_THAT(rebuilt->notes.back(), HasSubstr("contact built in"));
  EXPECT_EQ(built->assets[1].sha256, rebuilt->assets[1].sha256);
  const bool is_replaced = !std::filesystem::is_directory(entry);
  EXPECT_THAT(load_with_cache()->notes.back(), HasSubstr(is_replaced ? "contact from cache in" : "cannot be written"));
}

/// Replaces the cache entry of this mesh by the entry of another mesh.
void write_foreign_entry(const std::filesystem::path& entry) {
  SceneLoading loading;
  loading.cache_directory = entry.parent_path() / "other";
  std::ofstream(entry.parent_path() / "t.obj")
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.5\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  load_scene_text(mesh_body(kSmall), "other.json", entry.parent_path(), loading);
  std::filesystem::rename(std::filesystem::directory_iterator(loading.cache_directory)->path(), entry);
}

INSTANTIATE_TEST_SUITE_P(
    SceneFiles, BadCache,
    ::testing::Values(BadEntry{"Directory", [](const auto& entry) { std::filesystem::create_directory(entry); }},
                      BadEntry{"Fifo", [](const auto& entry) { ASSERT_EQ(mkfifo(entry.c_str(), 0600), 0); }},
                      BadEntry{"Empty", [](const auto& entry) { std::ofstream touched(entry); }},
                      BadEntry{"HugeSparseFile",
                               [](const auto& entry) {
                                 std::ofstream touched(entry);
                                 touched.close();
                                 std::filesystem::resize_file(entry, 1ULL << 40U);
                               }},
                      BadEntry{"EntryOfAnotherMesh", write_foreign_entry}),
    [](const ::testing::TestParamInfo<BadEntry>& test) { return test.param.name; });

TEST_F(SceneFiles, ClientsSeeBaseNamesOnly) {
  std::filesystem::create_directory(directory_ / "secret");
  write("secret/t.obj", kTetrahedron);
  const std::string path = (directory_ / "secret" / "t.obj").string();
  const auto scene =
      load(physics::scene_json({.bodies = R"({"name": "a", "shapes": [{"mesh": {"file": ")" + path + R"("}}]})"}));
  EXPECT_EQ(scene->description.bodies(0).shapes(0).mesh().file(), "t.obj");
  EXPECT_EQ(scene->description.SerializeAsString().find("secret"), std::string::npos);
}

}  // namespace
}  // namespace tandem::server
