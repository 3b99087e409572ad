#include "server/assets/mass_properties.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "proto/placement.hpp"
#include "server/physics/convex_hull.hpp"

namespace tandem::server {
namespace {

using Mat3 = Eigen::Matrix3d;

/// Moments of a solid of density 1: volume, centre, and second moment S = Σ x xᵀ about the centre. S is stored instead
/// of the inertia tensor trace(S)·1 − S, because S is simpler to rotate and shift.
struct Solid {
  double volume = 0;
  Vec3 centre = Vec3::Zero();
  Mat3 second_moment = Mat3::Zero();
};

Solid diagonal_solid(double volume, double xx, double yy, double zz) {
  return {volume, Vec3::Zero(), volume * Vec3(xx, yy, zz).asDiagonal().toDenseMatrix()};
}

/// A cylinder along z with a hemisphere on each end.
Solid capsule(double radius, double length) {
  const double pi = std::numbers::pi;
  const double r2 = radius * radius;
  const double tube = pi * r2 * length;
  const double ball = 4.0 / 3.0 * pi * r2 * radius;
  // Second moment of a hemisphere along z: its flat side is at z = l/2, and its centroid is 3r/8 beyond it. Per volume,
  // ∫z² is therefore l²/4 + 2·(l/2)(3r/8) + r²/5.
  const double along = tube * length * length / 12 + ball * (length * length / 4 + 3 * length * radius / 8 + r2 / 5);
  const double across = tube * r2 / 4 + ball * r2 / 5;
  return {tube + ball, Vec3::Zero(), Vec3(across, across, along).asDiagonal()};
}

/// Returns the solid inside a closed mesh: the sum of the signed tetrahedra between the origin and each triangle.
/// Source  the moments of a tetrahedron (0, a, b, c): ∫x xᵀ = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ), s = a + b + c
Solid closed_mesh(const geometry::TriangleMesh& mesh) {
  Solid solid;
  Vec3 first_moment = Vec3::Zero();
  for (const auto& [i, j, k] : mesh.triangles) {
    const auto at = [&mesh](int index) { return mesh.vertices[static_cast<std::size_t>(index)]; };
    const Vec3 a = at(i), b = at(j), c = at(k), s = a + b + c;
    const double volume = a.dot(b.cross(c)) / 6;
    solid.volume += volume;
    first_moment += volume / 4 * s;
    solid.second_moment +=
        volume / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  if (solid.volume <= 0) return Solid{};
  solid.centre = first_moment / solid.volume;
  solid.second_moment -= solid.volume * solid.centre * solid.centre.transpose();
  return solid;
}

Solid solid_of(const SolidShape& solid) {
  const wire::Shape& shape = solid.shape;
  const double pi = std::numbers::pi;
  if (shape.has_sphere()) {
    const double r2 = shape.sphere().radius_m() * shape.sphere().radius_m();
    return diagonal_solid(4.0 / 3.0 * pi * r2 * shape.sphere().radius_m(), r2 / 5, r2 / 5, r2 / 5);
  }
  if (shape.has_box()) {
    const double x = shape.box().size_m(0), y = shape.box().size_m(1), z = shape.box().size_m(2);
    return diagonal_solid(x * y * z, x * x / 12, y * y / 12, z * z / 12);
  }
  if (shape.has_cylinder()) {
    const double r2 = shape.cylinder().radius_m() * shape.cylinder().radius_m();
    const double length = shape.cylinder().length_m();
    return diagonal_solid(pi * r2 * length, r2 / 4, r2 / 4, length * length / 12);
  }
  if (shape.has_capsule()) return capsule(shape.capsule().radius_m(), shape.capsule().length_m());
  if (solid.mesh == nullptr) return {};
  return closed_mesh(solid.mesh_kind == geometry::SurfaceKind::kSolid ? *solid.mesh
                                                                      : convex_hull(solid.mesh->vertices));
}

void add(Solid& sum, const Solid& part) {
  const double volume = sum.volume + part.volume;
  const Vec3 centre = (sum.volume * sum.centre + part.volume * part.centre) / volume;
  const Vec3 to_sum = sum.centre - centre;
  const Vec3 to_part = part.centre - centre;
  sum.second_moment +=
      part.second_moment + sum.volume * to_sum * to_sum.transpose() + part.volume * to_part * to_part.transpose();
  sum.centre = centre;
  sum.volume = volume;
}

/// Sets the principal axes. If the axes of the body frame B are principal axes already, they are used unchanged.
/// Symmetric bodies thus keep their frame.
void set_inertia(MassProperties& properties, const Mat3& second_moment) {
  const Mat3 inertia = second_moment.trace() * Mat3::Identity() - second_moment;
  const Mat3 coupled = inertia - inertia.diagonal().asDiagonal().toDenseMatrix();
  if (coupled.cwiseAbs().maxCoeff() <= 1e-9 * inertia.trace()) {
    properties.principal_inertia_kg_m2 = inertia.diagonal();
    return;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  Mat3 axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  properties.X_BC.q = Quat(axes).normalized();
  properties.principal_inertia_kg_m2 = solver.eigenvalues();
}

}  // namespace

MassProperties mass_properties_of(double mass_kg, const std::vector<SolidShape>& shapes) {
  MassProperties properties;
  properties.mass_kg = mass_kg;
  if (mass_kg <= 0) return properties;
  Solid body;
  for (const SolidShape& shape : shapes) {
    Solid solid = solid_of(shape);
    if (!(solid.volume > 0)) throw std::domain_error("a shape encloses no volume");
    const Pose X_BS = proto::pose_from_placement(shape.shape.placement());
    const Mat3 turn = X_BS.q.toRotationMatrix();
    solid.centre = X_BS * solid.centre;
    solid.second_moment = turn * solid.second_moment * turn.transpose();
    add(body, solid);
  }
  properties.X_BC.p = body.centre;
  set_inertia(properties, body.second_moment * (mass_kg / body.volume));
  return properties;
}

MassProperties mass_properties_of(double mass_kg, const docking::Molecule& molecule, double metres_per_angstrom) {
  MassProperties properties;
  properties.mass_kg = mass_kg;
  if (mass_kg <= 0) return properties;
  // Without masses, all atoms have equal weight, as in Molecule::centre().
  const bool has_masses = std::ranges::any_of(molecule.mass_u, [](double mass_u) { return mass_u > 0; });
  Mat3 second_moment = Mat3::Zero();
  double total_u = 0;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    const Vec3 p = molecule.positions_angstrom[i] * metres_per_angstrom;
    const double mass_u = has_masses ? molecule.mass_u[i] : 1;
    second_moment += mass_u * p * p.transpose();
    total_u += mass_u;
  }
  // The atoms may lie on a line. A thickness of 1 Å, about a bond length, keeps the inertia about that line above 0.
  const double thickness = metres_per_angstrom * metres_per_angstrom;
  set_inertia(properties, mass_kg * (second_moment / total_u + thickness * Mat3::Identity()));
  return properties;
}

}  // namespace tandem::server
