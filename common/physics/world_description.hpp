// Plain data from which a world is built. The server creates it from a scene file, a client from received data.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/mass_properties.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"
#include "common/physics/coupling_in_force.hpp"
#include "common/physics/effects/effect_settings.hpp"
#include "common/physics/joints/joint.hpp"
#include "common/physics/rigid_body.hpp"
#include "common/physics/touch_model.hpp"

namespace tandem::physics {

struct WorldLimits {
  double body_speed_m_per_s = 10;        ///< faster bodies are slowed to this speed, and a fault is reported
  double grab_reach_m = 0.02;            ///< distance up to which a body can be grabbed
  std::uint32_t contact_points = 768;    ///< limit for each pair of shapes in a step
  std::size_t contact_pairs = 64;        ///< limit on the pairs of shapes that are close to each other
  std::uint32_t atom_pairs = 2'500'000;  ///< limit on the atom pairs of the molecular field in a step
  double bounds_m = 10;                  ///< a free body farther than this from the origin returns to its start
  double reset_after_s = 30;             ///< time after which a room without users is reset; 0: never
};

struct BodyDescription {
  TouchModel touch;
  MassProperties mass;
  BodyTraits traits;
  Pose X_WB;                                          ///< start pose
  bool is_graspable = false;                          ///< possible only for a body with a mass
  std::shared_ptr<const docking::Molecule> molecule;  ///< molecule, with its centre of mass at the origin; null: none
  std::optional<Joint> anchor;                        ///< joint to the start pose; possible only for a body with a mass
};

struct ToolDescription {
  TouchModel touch;
  MassProperties mass;
  double friction = 0.5;
  Pose X_WT;                              ///< start pose
  std::optional<std::size_t> holds_body;  ///< index of the body that the tool holds from the start
};

/// The displayed molecular force has its knee at this fraction of the molecular force limit (felt_share()).
inline constexpr double kKneeOfLimit = 0.25;

/// Description of a world. It does not change while the world runs.
struct WorldDescription {
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double step_s = 1e-3;
  WorldLimits limits;
  std::vector<BodyDescription> bodies;  ///< body_id_at(i) is the id of bodies[i]
  std::vector<ToolDescription> tools;
  SceneCoupling coupling;
  // Scales from molecular quantities to those of the world; work is scaled consistently with length and force
  // (MolecularForces).
  double metres_per_angstrom = 0.01;                ///< S_x
  double newtons_per_kcal_per_mol_angstrom = 0.03;  ///< S_f
  double molecular_force_limit_n = 20;              ///< smooth limit on the molecular force between two bodies
  docking::FieldModel field_model;
  // The following members determine which fraction of the molecular field is displayed (felt_share()).
  double molecular_zero_kt = 0;               ///< height of the zero area (no force) above the minimum [kT]; 0: none
  double molecular_minimum_kcal_per_mol = 0;  ///< lowest energy of two molecules
  /// Energy of the knee, above which the displayed force is reduced.
  double molecular_knee_kcal_per_mol = 0;
  std::vector<EffectSettings> effects;
};

}  // namespace tandem::physics
