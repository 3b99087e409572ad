// Prints a pair of molecules in a given pose, and the results of our kernels for the pair. compare_with_lammps.py
// passes the positions and parameters to LAMMPS and compares the energies and forces. The output is text with one
// record per line; numbers have the format %.17g.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "server/assets/structures/loader.hpp"

namespace {

using tandem::Pose;
using tandem::Vec3;
using tandem::docking::FieldResult;
using tandem::docking::Molecule;

void print_atoms(const char* which, const Molecule& molecule, const Pose& X_A, const std::vector<Vec3>& forces) {
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    const Vec3 p = X_A * molecule.positions_angstrom[i];
    const Vec3& f = forces[i];
    std::printf("atom %s %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", which, p.x(), p.y(), p.z(),
                molecule.sigma_angstrom[i], molecule.epsilon_kj_per_mol[i], f.x(), f.y(), f.z());
  }
}

void print_result(const std::string& kernel, const FieldResult& result) {
  const Vec3& f = result.force_on_b;
  const Vec3& t = result.torque_on_b;
  std::printf("result %s %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", kernel.c_str(), result.energy_kj_per_mol(),
              f.x(), f.y(), f.z(), t.x(), t.y(), t.z());
}

int dump(char** arguments) {
  const Molecule a = tandem::server::load_molecule(arguments[1], {{arguments[2]}}, arguments[4]);
  const Molecule b = tandem::server::load_molecule(arguments[1], {{arguments[3]}}, arguments[4]);
  double pose[7];
  for (int i = 0; i < 7; ++i) pose[i] = std::atof(arguments[5 + i]);
  const Pose X_AB = {{pose[0], pose[1], pose[2]}, tandem::Quat(pose[3], pose[4], pose[5], pose[6]).normalized()};
  std::vector<Vec3> forces_on_a;
  std::vector<Vec3> forces_on_b;
  const FieldResult exact = tandem::docking::exact_field(a, b, X_AB, {}, {&forces_on_a, &forces_on_b});
  print_atoms("A", a, Pose{}, forces_on_a);
  print_atoms("B", b, X_AB, forces_on_b);
  print_result("exact", exact);
  for (const std::string_view kernel : tandem::docking::MolecularField::available_kernels()) {
    tandem::docking::MolecularField field(a, b, {}, kernel);
    print_result(std::string(kernel), field.evaluate(X_AB));
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 12) {
    std::fprintf(stderr,
                 "usage: molecule_dump FILE.pdb CHAIN_A CHAIN_B FORCE_FIELD_DIR x y z qw qx qy qz  (pose of B "
                 "in A, Å)\n");
    return 2;
  }
  try {
    return dump(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "molecule_dump: %s\n", error.what());
    return 2;
  }
}
