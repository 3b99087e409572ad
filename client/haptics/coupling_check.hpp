// Checks whether a scene's coupling is stable on this client's device. The verdict is quick and runs on the io thread.
// The explanation is slow and runs on a thread that may block.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/exchange/mailboxes.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "common/physics/coupling_in_force.hpp"
#include "devices/device_profile.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Least and greatest mass and moment of inertia with which a body resists a coupling that holds it at a point.
///
/// Model   grip T, c = p_TC to the centre of mass C, force f and torque τ at T. Newton and Euler about C, with the
///         centre's acceleration a_C = a + α × c (speeds are small: no terms in ω²):
///           f = m (a + α × c),   τ = I_C α + c × f
///         Greatest: the other motion is blocked. α = 0 gives f = m a. a = 0 gives τ = I_T α with the inertia about the
///         grip, I_T = I_C + m (c·c 1 − c cᵀ) (parallel axes); its largest principal moment counts.
///         Least: the other motion is free. f = 0 gives τ = I_C α; its smallest principal moment counts. τ = 0 gives
///         α = −I_C⁻¹ (c × f), so a = (1/m 1 + [c]×ᵀ I_C⁻¹ [c]×) f; the inverse of its largest eigenvalue counts.
///         The coupling's other stiffness lies between free and blocked, so the effective resistance lies in between.
/// Source  our derivation
/// In      mass  its mass is above 0
///         p_BT  grip point, in the body's own frame B
std::array<physics::MovedMass, 2> resistance_at(const MassProperties& mass, const Vec3& p_BT, bool is_held_body);

/// Resistances that the coupling may have to move: the user's tool, and the least and greatest of all bodies that the
/// tool could grab. A held body counts at its grip point. Any other body counts as held at its centre of mass, because
/// its grip is not yet known. Some coefficients depend on the moved mass (of a massless tool, or of the law
/// `adaptive`). They apply only to the present load, so only `held`, or else the tool, is listed.
///
/// In      p_BT  position of the tool on `held`, in the body's frame; null: not known
/// Out     empty when the server's masses of the tool or of bodies are missing or unusable
std::vector<physics::MovedMass> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law,
                                               BodyId held, const Vec3* p_BT = nullptr);

/// One check, with the data needed to explain it later.
struct CouplingCheck {
  std::uint64_t number = 0;  ///< number of this check, counted from 1; 0: nothing was checked
  bool is_refused = false;   ///< unstable on this device, or the moved mass is not known: must not be displayed
  HapticScene scene;
  std::vector<physics::MovedMass> moved;
};

/// True if the coupling that the haptic path would render of `scene` is stable with each thing in `moved`, or if its law
/// does not exist. Network delay is not modelled: its effect on the loop is measured in the lab.
///
/// Cost    with three things to move, in six axes: 0.6 ms at velocity windows of 4 periods, 4 ms at 20, the largest;
///         allocates
bool is_stable_coupling(const HapticScene& scene, const std::vector<physics::MovedMass>& moved,
                        const devices::DeviceProfile& device);

/// Explains a check and suggests remedies; contains kUnstable exactly where is_stable_coupling() is false.
///
/// Out     the graver finding each for translation and rotation, and one for a law that is active by itself; a single
///         finding when the moved mass is not known
/// Cost    6 ms; tens of milliseconds when a remedy is searched
/// Thread  any that may block
std::vector<haptics::StabilityFinding> explained(const CouplingCheck& check, const devices::DeviceProfile& device);

/// Debounces coefficient changes of a session. Coefficients come in bursts, one message each. A new stiffness with the
/// old damping is not an intended coupling, so the check waits for the end of the burst.
///
/// Thread  io
class CouplingWatch {
 public:
  /// Ours: the messages of one burst arrive together. An unstable coupling cannot grow meanwhile, because the
  /// coefficients are ramped over kCouplingRamp_s.
  static constexpr Duration kQuiet{std::chrono::milliseconds(50)};
  /// Longest interval between checks while a slider is dragged.
  static constexpr Duration kAtLatest{std::chrono::milliseconds(250)};
  /// A grip point that moves further on the body counts as another grip. Ours: a tenth of a small handle.
  static constexpr double kGripMoved_m = 0.005;

  /// Without a device every check passes.
  explicit CouplingWatch(std::optional<devices::DeviceProfile> device) : device_(std::move(device)) {}

  /// Notes that a coefficient or the held body changed.
  void note_change(LocalTime now);
  /// Notes the server's grip: the tool is at `p_BT` on the body it holds; an invalid id: it holds none.
  void note_grip(BodyId body, const Vec3& p_BT, LocalTime now);
  void forget_changes() { waits_ = false; }
  bool is_due(LocalTime now) const { return waits_ && now >= due_; }
  /// Returns whether `scene` may be displayed to a manipulator.
  bool check(const HapticScene& scene, const wire::Joined& joined, BodyId held);
  /// Result of the last check.
  const CouplingCheck& last() const { return last_; }

 private:
  std::optional<devices::DeviceProfile> device_;
  bool waits_ = false;
  LocalTime due_{};
  LocalTime latest_{};
  BodyId gripped_;
  Vec3 grip_B_ = Vec3::Zero();
  CouplingCheck last_;
};

}  // namespace tandem::client
