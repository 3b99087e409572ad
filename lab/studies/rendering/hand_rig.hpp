// A control loop of one hand, one device, one coupling, one tool and at most one plane. Rendering laws are compared,
// calibrated and reproduced in it. Law, solver, hand and velocity estimator are the same as in live sessions.
//
//   simulated hand ─▶ encoder ─▶ velocity ─▶ coupling ⇄ tool (contact solver) ⇄ plane
//         ▲──────── force held for one period ◀── passivity controller ◀──┘
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "common/haptics/passivity/coupling_passivity_controller.hpp"
#include "common/haptics/velocity_estimator.hpp"
#include "devices/sim/sim_device.hpp"

namespace tandem::lab {

struct HandRigSettings {
  std::string law = "stable-dynamic";
  haptics::CouplingParameters coupling;
  double rate_hz = 1000;
  double tool_mass_kg = 0.1;
  Vec3 tool_inertia_kg_m2{4e-5, 4e-5, 4e-5};
  Vec3 gravity_m_per_s2 = Vec3::Zero();
  devices::HandParameters hand;  ///< hand that holds the device; see holding(hand, profile)
  /// true: the velocity is estimated from encoder positions; false: the hand's true velocity is used
  bool estimates_velocity = true;
  std::optional<double> plane_z_m;  ///< height of a fixed plane with normal +z that stops the tool's origin
  double contact_n_per_m = 20000;   ///< contact stiffness between that plane and the tool
  double friction = 0.5;
  bool is_passivity_controlled = false;  ///< the passivity controller is enabled; it uses the reported positions
  std::uint64_t seed = 1;
};

/// State after a tick. All quantities are in W, which equals D here.
struct HandRigTick {
  Duration at{0};
  Pose X_WH;                  ///< true pose of the handle, not the reported one
  Twist V_WH;                 ///< true twist of the handle
  Pose X_WT;                  ///< pose of the tool at the end of the step that begins now
  Twist V_WT;                 ///< twist of the tool at the end of the same step
  Wrench on_hand_W;           ///< wrench displayed from now to the next tick, about the handle
  Wrench on_tool_W;           ///< wrench of the coupling, about the tool
  double normal_force_n = 0;  ///< normal force of the contact
  /// Work of the hand up to this tick: −Σ F_j·(x_{j+1} − x_j) − Σ τ_j·θ. F and τ are the displayed values; x and θ are
  /// the true ones.
  double hand_work_j = 0;
  /// The same work, computed from the reported positions. A passivity controller has only these.
  double reported_work_j = 0;
};

/// Returns parameters of a simulated hand with the impedance of a hand in check_coupling(). The entry that stands for
/// "no hand" is not valid.
devices::HandParameters hand_of(const haptics::CheckedHand& checked);

/// Steps device, coupling and tool together.
class HandRig {
 public:
  /// In      path  intended trajectory of the hand
  /// Fails   std::invalid_argument: unknown law
  HandRig(const HandRigSettings& settings, devices::HandPath path);
  ~HandRig();
  HandRig(HandRig&&) noexcept;

  HandRigTick tick();
  /// Translates and rotates the handle by a prescribed step, which replaces the simulated hand. This is for drivers
  /// that choose the direction of each tick. The law receives positions from the encoder; the result in W has the true
  /// ones.
  HandRigTick tick_driven(const Vec3& step_W, const Vec3& turn_W = Vec3::Zero());
  double withheld_j() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
