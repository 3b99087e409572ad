#include "lab/studies/contact/mesh_source.hpp"

#include <array>
#include <stdexcept>
#include <string_view>

#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/repair/mesh_bounds.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "server/assets/mesh_file.hpp"

namespace tandem::lab {
namespace {

struct Generated {
  std::string_view name;
  geometry::TriangleMesh (*make)();
};
constexpr std::array kGenerated{
    Generated{"peg", [] { return make_peg(); }}, Generated{"box_with_hole", [] { return make_box_with_hole(); }},
    Generated{"sphere", [] { return make_sphere(0.025, 4); }}, Generated{"cube", [] { return make_cube(0.05); }}};

std::string generated_names() {
  std::string names;
  for (const Generated& one : kGenerated) names += (names.empty() ? "" : ", ") + std::string(one.name);
  return names;
}

void place(geometry::TriangleMesh& mesh, double factor) {
  const Eigen::AlignedBox3d bounds = bounds_of(mesh);
  const Vec3 centre = (bounds.min() + bounds.max()) / 2;
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - centre) * factor;
}

}  // namespace

geometry::TriangleMesh mesh_from(const std::string& name, const std::string& option, double largest_size_m,
                                 std::optional<double> factor) {
  for (const Generated& one : kGenerated) {
    if (name != one.name) continue;
    geometry::TriangleMesh mesh = one.make();
    place(mesh, factor.value_or(1));
    return mesh;
  }
  geometry::TriangleMesh mesh;
  try {
    mesh = server::read_mesh_file(name, "give an existing file");
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(option + " is " + error.what() + "; or a generated mesh: " + generated_names());
  }
  try {
    place(mesh, factor.value_or(largest_size_m / geometry::mesh_bounds(mesh).sizes().maxCoeff()));
  } catch (const geometry::MeshError& error) {
    throw std::invalid_argument(option + " is " + name + ", which has no size: " + error.what());
  }
  return mesh;
}

}  // namespace tandem::lab
