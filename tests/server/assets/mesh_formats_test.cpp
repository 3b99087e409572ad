// Compares generated mesh files of every format with the surface that they represent. The tests detect a parser that
// misreads a file without an error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "common/base/random.hpp"
#include "server/assets/mesh_file.hpp"
#include "tests/support/mesh_files.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MeshFormats : public ::testing::Test {
 protected:
  MeshFormats() : directory_(std::filesystem::path(::testing::TempDir()) / "tandem_mesh_formats") {
    std::filesystem::create_directories(directory_);
  }
  ~MeshFormats() override { std::filesystem::remove_all(directory_); }

  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(directory_ / name, std::ios::binary) << bytes;
  }
  geometry::TriangleMesh read(const std::string& name, const std::string& bytes) const {
    write(name, bytes);
    return read_mesh_file(directory_ / name, "");
  }
  /// Reads the file and returns the error message. Without an error the result is empty, and the mesh is stored in
  /// `mesh` unless it is null.
  std::string refusal(const std::string& name, const std::string& bytes, geometry::TriangleMesh* mesh = nullptr) const {
    try {
      geometry::TriangleMesh is = read(name, bytes);
      if (mesh != nullptr) *mesh = std::move(is);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  Vec3 size_of(const std::string& name, const std::string& bytes) const {
    const geometry::TriangleMesh mesh = read(name, bytes);
    Vec3 low = mesh.vertices.at(0), high = low;
    for (const Vec3& p : mesh.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    return high - low;
  }

  std::filesystem::path directory_;
};

/// A box of 1 by 2 by 3 units.
test::Surface box() {
  return test::prism({{0, 0}, {1, 0}, {1, 2}, {0, 2}}, 3);
}

/// A convex prism of about equal width and height, with random orientation, size and position.
struct Part {
  test::Surface surface;
  double scale = 1;
  double ratio = 0;  ///< distance of the part from the origin, divided by the size of the part
};

Part random_part(Random& random) {
  std::vector<Eigen::Vector2d> outline;
  const int corners = 3 + static_cast<int>(random.uniform() * 6);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.3 * random.uniform()) / corners;
    outline.emplace_back(std::cos(angle), std::sin(angle));
  }
  Part part{test::prism(outline, random.uniform(0.7, 2))};
  if (random.uniform() < 0.5) part.surface = test::reversed(part.surface);
  part.scale = std::pow(10, random.uniform(-6, 6));
  if (random.uniform() < 0.7) part.ratio = std::pow(10, random.uniform(0, 8));
  const auto direction = [&random] {
    return Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  };
  const Quat turn(Eigen::AngleAxisd(random.uniform(0, 6), direction().normalized()));
  const Vec3 offset = part.ratio * direction().normalized();
  for (Vec3& p : part.surface.vertices) p = part.scale * (turn * p + offset);
  return part;
}

/// A part, written in one file format, and the reason for which the reader may refuse the file.
struct Written {
  std::string name, bytes;
  bool is_single = false;     ///< true if the file or its parser uses single precision
  std::string refused_for{};  ///< glTF extension for which a refusal is allowed
  double unit = 1;            ///< factor from the file's unit to the result
};

Written written(const Part& part, Random& random) {
  const test::Surface& s = part.surface;
  const std::string far = std::to_string(part.scale * 1e7);
  const auto one_of = [&random](std::initializer_list<const char*> all) {
    return std::string(all.begin()[static_cast<std::size_t>(random.uniform() * static_cast<double>(all.size()))]);
  };
  const bool other = random.uniform() < 0.5;
  switch (static_cast<int>(random.uniform() * 11)) {
    case 0:
      return {"t.obj", test::obj_file(s, other)};
    case 1:
      return {"t.off", test::off_file(s)};
    case 2:
      return {"t.stl", test::stl_text(s)};
    case 3:
      return {"t.stl", test::stl_binary(s), true};
    case 4:
      return {"t.ply", test::ply_text(s)};
    case 5:
      return {"t.ply", test::ply_binary(s, other), !other};
    case 6:
      return {"t.ply", test::ply_strips(s, other)};
    case 7:
      return {"t.3ds", test::file_3ds(s, other ? 0.0254F : 0), true};
    case 8: {
      const std::string unit = one_of({"", "0.001", "0.0254"});
      const std::string node =
          one_of({"", ("<translate>" + far + " 0 3</translate>").c_str(), "<rotate>0 0 1 90</rotate>"});
      return {"t.dae", test::dae_file(s, {one_of({"", "X_UP", "Y_UP", "Z_UP"}), unit, node}), false, "",
              unit.empty() ? 1 : std::stod(unit)};
    }
    case 9: {
      const std::string extension = one_of({"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                            "KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "VENDOR_unknown"});
      const bool is_quantised = extension == "KHR_mesh_quantization";
      return {"t.glb", test::gltf_file(s, {.required = extension, .is_quantised = is_quantised}).file, true, extension};
    }
    default: {
      const std::string node = one_of({R"("mesh": 0)", (R"("mesh": 0, "translation": [)" + far + ", 5, 3]").c_str(),
                                       R"("mesh": 0, "rotation": [0.5, 0.5, 0.5, 0.5])"});
      return {"t.glb", test::gltf_file(s, {.required = one_of({"", "KHR_materials_unlit"}), .node = node}).file, true};
    }
  }
}

TEST_F(MeshFormats, EveryFileHasItsGeneratorsVolumeAndAreaOrIsRefusedByName) {
  constexpr int kFiles = 330;
  const std::uint64_t seed = test::test_seed(61);
  int read_files = 0, refused_far = 0;
  for (int trial = 0; trial < kFiles; ++trial) {
    Random random(seed + static_cast<std::uint64_t>(trial));
    const Part part = random_part(random);
    const Written file = written(part, random);
    const std::string at = "TANDEM_TEST_SEED=" + std::to_string(seed) + ", trial " + std::to_string(trial) + ", " +
                           file.name + ", distance " + std::to_string(part.ratio);
    geometry::TriangleMesh mesh;
    const std::string why = refusal(file.name, file.bytes, &mesh);
    if (!file.refused_for.empty()) {
      ASSERT_THAT(why, AllOf(HasSubstr(file.name), HasSubstr(file.refused_for))) << at;
      continue;
    }
    if (!why.empty()) {
      ++refused_far;
      ASSERT_TRUE(file.is_single && part.ratio > 60) << at << ": " << why;
      ASSERT_THAT(why, AllOf(HasSubstr(file.name), HasSubstr("too far from the origin"))) << at;
      continue;
    }
    ++read_files;
    const test::VolumeAndArea is = test::volume_and_area(mesh.vertices, mesh.triangles);
    const test::VolumeAndArea ought =
        test::volume_and_area(part.surface.vertices, test::fans_of(part.surface)) * file.unit;
    ASSERT_NEAR(is.volume / ought.volume, 1, 1e-4) << at;
    ASSERT_NEAR(is.area / ought.area, 1, 1e-4) << at;
  }
  EXPECT_GT(read_files, kFiles / 2);
  EXPECT_GT(refused_far, kFiles / 20);
}

TEST_F(MeshFormats, DamagedFilesAreReadOrRefusedAndTheirReaderNeverFails) {
  const std::uint64_t seed = test::test_seed(61);
  const std::vector<std::pair<const char*, std::string>> files{
      {"t.obj", test::obj_file(box())},         {"t.off", test::off_file(box())},
      {"t.ply", test::ply_text(box())},         {"t.ply", test::ply_binary(box(), true)},
      {"t.ply", test::ply_strips(box(), true)}, {"t.stl", test::stl_text(box())},
      {"t.stl", test::stl_binary(box())},       {"t.glb", test::gltf_file(box()).file}};
  int refused = 0;
  for (std::size_t trial = 0; trial < 240; ++trial) {
    Random random(seed + trial);
    auto [name, bytes] = files[trial % files.size()];
    const auto place = [&] { return static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size())); };
    for (int change = 0; change < 3; ++change) {
      const double kind = random.uniform();
      if (kind < 0.6) bytes.at(place()) = static_cast<char>(random.next_u64());
      if (kind > 0.5 && kind < 0.8) bytes.erase(place(), 1 + random.next_u64() % 8);
      if (kind > 0.8) bytes.insert(place(), bytes.substr(place(), 1 + random.next_u64() % 8));
    }
    const std::string why = refusal(name, bytes);
    refused += why.empty() ? 0 : 1;
    ASSERT_THAT(why, ::testing::Not(HasSubstr("its reader fails"))) << name << ", trial " << trial;
  }
  EXPECT_GT(refused, 120);
}

TEST_F(MeshFormats, ConcaveFacesKeepTheirAreaAtAnySize) {
  const auto area = [](double scale) { return scale * scale * (2 * 4.5 + 11 * 1.5); };
  for (const double scale : {1e-9, 1e-3, 1.0, 1e9}) {
    test::Surface part = test::prism({{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2.5}, {0, 2.5}}, 1.5);
    for (Vec3& p : part.vertices) p *= scale;
    for (const auto& [name, bytes] : {std::pair{"t.obj", test::obj_file(part)},
                                      {"t.off", test::off_file(part)},
                                      {"t.ply", test::ply_text(part)},
                                      {"u.ply", test::ply_binary(part, true)}}) {
      const geometry::TriangleMesh mesh = read(name, bytes);
      EXPECT_NEAR(test::volume_and_area(mesh.vertices, mesh.triangles).area / area(scale), 1, 1e-6) << name << scale;
    }
  }
}

TEST_F(MeshFormats, UpAxisOfAFileIsUpInTheScene) {
  const Vec3 upright(1, 2, 3);
  for (const char* const axis : {"", "X_UP", "Y_UP", "Z_UP"}) {
    EXPECT_LT((size_of("t.dae", test::dae_file(box(), {axis, "", ""})) - upright).norm(), 1e-6) << axis;
  }
  EXPECT_LT((size_of("t.glb", test::gltf_file(box()).file) - upright).norm(), 1e-6);
  EXPECT_LT((size_of("t.3ds", test::file_3ds(box())) - upright).norm(), 1e-6);
  EXPECT_LT((size_of("t.obj", test::obj_file(box())) - upright).norm(), 1e-6);
}

TEST_F(MeshFormats, UnitOfAFileIsHonouredAndAnEditorsScaleIsNot) {
  EXPECT_NEAR(size_of("t.dae", test::dae_file(box(), {"Z_UP", "0.001", ""})).z(), 0.003, 1e-9);
  EXPECT_NEAR(size_of("t.3ds", test::file_3ds(box(), 0.0254F)).z(), 3, 1e-6);
}

TEST_F(MeshFormats, MirroredNodesAreNotInsideOut) {
  const auto volume = [this](const std::string& name, const std::string& bytes) {
    const geometry::TriangleMesh mesh = read(name, bytes);
    return test::volume_and_area(mesh.vertices, mesh.triangles).volume;
  };
  EXPECT_NEAR(volume("t.dae", test::dae_file(box(), {"", "", "<scale>-1 1 1</scale>"})), 6, 1e-5);
  EXPECT_NEAR(volume("t.glb", test::gltf_file(box(), {.node = R"("mesh": 0, "scale": [1, -2, 1])"}).file), 12, 1e-5);
}

TEST_F(MeshFormats, BuffersBesideAGltfAreRead) {
  const test::GltfFile file = test::gltf_file(box(), {.is_binary = false});
  write("buffer.bin", file.buffer);
  EXPECT_NEAR(size_of("t.gltf", file.file).z(), 3, 1e-6);
}

TEST_F(MeshFormats, IgnoredFeaturesOfGltfAreNamed) {
  const auto why = [this](const test::GltfOptions& options) {
    return refusal("t.glb", test::gltf_file(box(), options).file);
  };
  EXPECT_THAT(why({.is_quantised = true}),
              AllOf(HasSubstr("accessors[0].componentType is 5122"), HasSubstr("without quantisation")));
  EXPECT_THAT(why({.required = "VENDOR_unknown"}), HasSubstr("extensionsRequired uses VENDOR_unknown"));
  EXPECT_THAT(why({.mesh = R"("weights": [0, 0.5], )"}), HasSubstr("meshes[0].weights blend morph targets"));
  EXPECT_THAT(why({.primitive = R"("extensions": {"KHR_draco_mesh_compression": {"bufferView": 0}}, )"}),
              AllOf(HasSubstr("meshes[0].primitives[0] uses KHR_draco_mesh_compression"), HasSubstr("compression")));
  EXPECT_THAT(why({.node = R"("mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}})"}),
              HasSubstr("nodes[0] uses EXT_mesh_gpu_instancing"));
  EXPECT_THAT(refusal("t.gltf", R"({"asset": )"),
              HasSubstr("t.gltf, which is not a mesh in glTF: its JSON cannot be read"));
  EXPECT_EQ(why({.required = "KHR_materials_unlit", .mesh = R"("weights": [0], )"}), "");
}

TEST_F(MeshFormats, FilesThatEndTooSoonOrNameWrongVerticesAreRefused) {
  const auto without_end = [](std::string text, std::size_t lines) {
    for (; lines > 0; --lines) text.erase(text.find_last_of('\n', text.size() - 2) + 1);
    return text;
  };
  EXPECT_THAT(refusal("t.off", without_end(test::off_file(box()), 2)), HasSubstr("ends before its face 5 of 6"));
  EXPECT_THAT(refusal("t.ply", without_end(test::ply_text(box()), 1)),
              HasSubstr("ends too soon, in row 6 of 6 of its element \"face\""));
  EXPECT_THAT(refusal("t.stl", without_end(test::stl_text(box()), 3)), HasSubstr("facet 12 is cut off"));
  EXPECT_THAT(refusal("t.stl", test::stl_binary(box()) + std::string(50, '\0')),
              HasSubstr("declares 12 triangles and holds 13"));
  test::Surface wrong = box();
  wrong.faces[0][0] = 8;
  for (const auto& [name, bytes] : {std::pair{"t.obj", test::obj_file(wrong)},
                                    {"t.off", test::off_file(wrong)},
                                    {"t.ply", test::ply_text(wrong)},
                                    {"u.ply", test::ply_binary(wrong, true)}}) {
    EXPECT_THAT(refusal(name, bytes), HasSubstr("an index beyond its last vertex: vertex 8 of 8")) << name;
  }
}

TEST_F(MeshFormats, StatementsAndElementsThatAreNotReadAreNamed) {
  EXPECT_THAT(refusal("t.obj", test::obj_file(box()) + "surf 0 1 0 1 1 2 3 4\n"), HasSubstr("a statement surf"));
  EXPECT_THAT(refusal("t.off", "OFF BINARY\n"), HasSubstr("binary .off"));
  EXPECT_THAT(refusal(
                  "t.ply", test::ply_header(box(), "ascii", "float", "element range_grid 0\nproperty int a\n") + "1" +
                               [] {
                                 std::string text;
                                 for (const Vec3& p : box().vertices) text += " " + test::text_of(p);
                                 return text;
                               }()),
              AllOf(HasSubstr("which has no triangle"), HasSubstr("range_grid"), HasSubstr("tristrips")));
  EXPECT_THAT(refusal("t.fbx", "Kaydara FBX Binary"), HasSubstr("give .obj, .stl, .ply"));
}

}  // namespace
}  // namespace tandem::server
