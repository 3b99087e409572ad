// The two molecules of a room whose poses are saved: their bodies, and the energy of a relative pose.
#pragma once

#include <cstddef>
#include <memory>

#include "server/room/room.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

/// Maximum number of atom pairs evaluated in one slice of work. It bounds the time for which a slice delays the
/// requests of other rooms.
inline constexpr std::size_t kMaxPairsInSlice = 10'000'000;

/// Energy of a relative pose, summed in slices over the atoms of the first molecule.
struct PoseEnergy {
  Pose X_AB;  ///< pose of the second molecule in the frame of the first [Å]
  std::size_t atoms_done = 0;
  double lj_kj_per_mol = 0, coulomb_kj_per_mol = 0;
};

/// Two molecules of a scene. Requests move the second molecule, or the first if the second is static.
///
/// Thread  any; constant after construction
class MoleculePair {
 public:
  /// In      first, second  indices of the bodies that represent the molecules
  MoleculePair(const Room& of, std::size_t first, std::size_t second);

  const docking::Molecule& a() const { return *a_; }
  const docking::Molecule& b() const { return *b_; }
  BodyId first() const { return first_; }
  BodyId second() const { return second_; }
  const LoadedScene& scene() const { return *scene_; }
  /// Returns whether one of the molecules can be moved.
  bool moves() const { return moves_first_ || moves_second_; }
  std::size_t atom_pairs() const { return a_->size() * b_->size(); }

  /// Returns the relative pose of the molecules in their structure files [Å].
  Pose as_in_files() const { return {centre_b_ - centre_a_, Quat::Identity()}; }
  /// Returns the relative pose [Å] of bodies with these poses [m].
  Pose relative(const Pose& X_WA, const Pose& X_WB) const;
  /// Returns the command that moves one of the molecules, so that their relative pose becomes X_AB. Requires moves().
  RoomCommand placing(const Pose& X_AB) const;

  /// Evaluates the next slice of the energy of a pose, at most about kMaxPairsInSlice pairs of atoms. Returns true when
  /// the energy is complete.
  bool evaluate_slice(PoseEnergy& energy) const;
  /// Returns the data of a saved pose: its energy, its distance from the pose in the structure files, and its contacts.
  /// The fields for number, name and user are not set.
  wire::KeptPose describe(const PoseEnergy& energy) const;

 private:
  std::shared_ptr<const LoadedScene> scene_;
  BodyId first_, second_;
  const docking::Molecule* a_;
  const docking::Molecule* b_;
  Vec3 centre_a_, centre_b_;  ///< positions of the bodies' origins in the frames of the structure files [Å]
  bool moves_first_, moves_second_;
};

}  // namespace tandem::server
