// Everything that a world is made from, as plain data: the server makes it from a scene file, a client from what it was
// sent.
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
  double body_speed_m_per_s = 10;        ///< faster bodies are slowed to this, and reported
  double grab_reach_m = 0.02;            ///< a body farther than this is not grabbed
  std::uint32_t contact_points = 768;    ///< of a pair of shapes and step
  std::size_t contact_pairs = 64;        ///< of shapes near each other at a time
  std::uint32_t atom_pairs = 2'500'000;  ///< of the molecular field, each step
  double bounds_m = 10;                  ///< a body farther from the origin, in nobody's hand, returns to its start
  double reset_after_s = 30;             ///< an empty room's; 0: never
};

struct BodyDescription {
  TouchModel touch;
  MassProperties mass;
  BodyTraits traits;
  Pose X_WB;                                          ///< start pose
  bool is_graspable = false;                          ///< only of a body with a mass
  std::shared_ptr<const docking::Molecule> molecule;  ///< origin: its centre of mass; null: feels no molecular field
  std::optional<Joint> anchor;                        ///< to the start pose; only of a body with a mass
};

struct ToolDescription {
  TouchModel touch;
  MassProperties mass;
  double friction = 0.5;
  Pose X_WT;                              ///< start pose
  std::optional<std::size_t> holds_body;  ///< from the start; index into bodies
};

/// A knee of what is felt of a molecular field is where so much of its force limit is.
inline constexpr double kKneeOfLimit = 0.25;

/// Immutable while a world runs.
struct WorldDescription {
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double step_s = 1e-3;
  WorldLimits limits;
  std::vector<BodyDescription> bodies;  ///< body_id_at(i) is bodies[i]
  std::vector<ToolDescription> tools;
  SceneCoupling coupling;
  // How molecular quantities become device-sized ones, kept consistent in work (MolecularForces).
  double metres_per_angstrom = 0.01;                ///< S_x
  double newtons_per_kcal_per_mol_angstrom = 0.03;  ///< S_f
  double molecular_force_limit_n = 20;  ///< the molecular force between two bodies is bounded smoothly by this
  docking::FieldModel field_model;
  // Of what is felt of it.
  double molecular_zero_kt = 0;               ///< nothing so near to the minimum; 0: no zero area
  double molecular_minimum_kcal_per_mol = 0;  ///< the least energy of two molecules
  double molecular_knee_kcal_per_mol = 0;     ///< above it, less than all
  std::vector<EffectSettings> effects;
};

}  // namespace tandem::physics
