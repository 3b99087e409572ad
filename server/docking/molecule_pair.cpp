#include "server/docking/molecule_pair.hpp"

#include <algorithm>

#include "common/docking/atom_contacts.hpp"
#include "common/docking/exact_field.hpp"

namespace tandem::server {
namespace {

void write(const Pose& X, google::protobuf::RepeatedField<double>& out) {
  out.Clear();
  for (const double number : X.p) out.Add(number);
  for (const double number : {X.q.w(), X.q.x(), X.q.y(), X.q.z()}) out.Add(number);
}

/// Copies `count` atoms, beginning with atom `first`, with only the data that the energy depends on.
docking::Molecule part_of(const docking::Molecule& molecule, std::size_t first, std::size_t count) {
  const auto copy = [first, count](const auto& from, auto& to) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(first);
    to.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  docking::Molecule part;
  copy(molecule.positions_angstrom, part.positions_angstrom);
  copy(molecule.sigma_angstrom, part.sigma_angstrom);
  copy(molecule.epsilon_kj_per_mol, part.epsilon_kj_per_mol);
  copy(molecule.charge_e, part.charge_e);
  copy(molecule.mass_u, part.mass_u);
  part.mixes_arithmetically = molecule.mixes_arithmetically;
  return part;
}

}  // namespace

MoleculePair::MoleculePair(const Room& of, std::size_t first, std::size_t second)
    : scene_(of.shared_scene()),
      first_(body_id_at(first)),
      second_(body_id_at(second)),
      a_(scene_->world.bodies[first].molecule.get()),
      b_(scene_->world.bodies[second].molecule.get()),
      centre_a_(scene_->molecule_centres_angstrom[first]),
      centre_b_(scene_->molecule_centres_angstrom[second]),
      moves_first_(of.moves(first_)),
      moves_second_(of.moves(second_)) {}

Pose MoleculePair::relative(const Pose& X_WA, const Pose& X_WB) const {
  Pose X_AB = X_WA.inverse() * X_WB;
  X_AB.p /= scene_->world.metres_per_angstrom;
  return X_AB;
}

RoomCommand MoleculePair::placing(const Pose& X_AB) const {
  Pose X_SB = X_AB;
  X_SB.p *= scene_->world.metres_per_angstrom;
  RoomCommand command;
  command.kind = RoomCommand::Kind::kPlace;
  command.body = moves_second_ ? second_ : first_;
  command.beside = moves_second_ ? first_ : second_;
  command.X_SB = moves_second_ ? X_SB : X_SB.inverse();
  return command;
}

bool MoleculePair::evaluate_slice(PoseEnergy& energy) const {
  const std::size_t fits = std::max<std::size_t>(1, kMaxPairsInSlice / std::max<std::size_t>(1, b_->size()));
  const std::size_t count = std::min(fits, a_->size() - energy.atoms_done);
  const docking::FieldModel& model = scene_->world.field_model;
  const docking::FieldResult result =
      count == a_->size() ? docking::exact_field(*a_, *b_, energy.X_AB, model)
                          : docking::exact_field(part_of(*a_, energy.atoms_done, count), *b_, energy.X_AB, model);
  energy.lj_kj_per_mol += result.lennard_jones_kj_per_mol;
  energy.coulomb_kj_per_mol += result.coulomb_kj_per_mol;
  energy.atoms_done += count;
  return energy.atoms_done == a_->size();
}

wire::KeptPose MoleculePair::describe(const PoseEnergy& energy) const {
  const Pose& X_AB = energy.X_AB;
  wire::KeptPose pose;
  write(X_AB, *pose.mutable_in_first());
  pose.set_lj_kj_per_mol(energy.lj_kj_per_mol);
  pose.set_coulomb_kj_per_mol(energy.coulomb_kj_per_mol);
  pose.set_rmsd_angstrom(docking::rmsd_angstrom(*b_, as_in_files(), X_AB));
  pose.set_contacts(static_cast<std::uint32_t>(docking::atom_contacts(*a_, *b_, X_AB).size()));
  pose.set_hydrogen_bonds(static_cast<std::uint32_t>(docking::hydrogen_bonds(*a_, *b_, X_AB).size()));
  return pose;
}

}  // namespace tandem::server
