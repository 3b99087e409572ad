// Test rig in which rendering laws (coupling laws) are compared and calibrated. It simulates a control loop of one
// hand, one device, one coupling, one tool and at most one plane. Law, solver and velocity estimator are those of live
// sessions.
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
  /// true: velocity estimated from encoder positions; false: true velocity of the hand
  bool estimates_velocity = true;
  std::optional<double> plane_z_m;  ///< height of a fixed plane with normal +z that stops the tool's origin
  double contact_n_per_m = 20000;   ///< contact stiffness between the plane and the tool
  double friction = 0.5;
  bool is_passivity_controlled = false;  ///< whether a passivity controller acts; it uses reported positions
  std::uint64_t seed = 1;
};

/// State after a tick. All quantities are in the world frame W, which equals the device frame D here.
struct HandRigTick {
  Duration at{0};
  Pose X_WH;                  ///< true (not reported) pose of the handle
  Twist V_WH;                 ///< true twist of the handle
  Pose X_WT;                  ///< pose of the tool at the end of the step that begins at this tick
  Twist V_WT;                 ///< twist of the tool at the end of the same step
  Wrench on_hand_W;           ///< wrench on the hand, about the handle, displayed until the next tick
  Wrench on_tool_W;           ///< wrench of the coupling, about the tool
  double normal_force_n = 0;  ///< normal force of the contact
  /// Work of the hand up to this tick: −Σ F_j·(x_{j+1} − x_j) − Σ τ_j·θ_j. F and τ are displayed force and torque; x is
  /// the true position, and θ_j the true rotation from tick j to j + 1.
  double hand_work_j = 0;
  /// hand_work_j computed from the reported positions instead of the true ones; a passivity controller has only the
  /// reported ones
  double reported_work_j = 0;
};

/// Returns parameters of a simulated hand with the impedance of a hand in check_coupling(). The entry for "no hand" is
/// not a valid argument.
devices::HandParameters hand_of(const haptics::CheckedHand& checked);

/// Steps device, coupling and tool together.
class HandRig {
 public:
  /// Creates the rig.
  /// In      path  intended trajectory of the hand
  /// Fails   std::invalid_argument: unknown law
  HandRig(const HandRigSettings& settings, devices::HandPath path);
  ~HandRig();
  HandRig(HandRig&&) noexcept;

  HandRigTick tick();
  /// Moves the handle by a prescribed translation and rotation, which replace the simulated hand. A test uses it to
  /// choose the motion of each tick by itself. The law receives positions quantised by the encoder. The returned state
  /// contains the true positions.
  HandRigTick tick_driven(const Vec3& step_W, const Vec3& turn_W = Vec3::Zero());
  double withheld_j() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
