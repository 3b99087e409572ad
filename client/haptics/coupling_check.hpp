// Checks whether a scene's coupling is stable on this client's device. The check is fast enough for the io thread. A
// separate function explains the result and searches for remedies; it is slow and needs a thread that may block.
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

/// Returns the smallest and the largest effective mass and moment of inertia of a body that a coupling holds at a
/// point.
///
/// Model   Grip point T, c = p_TC to the centre of mass C, force f and torque τ at T. Newton and Euler about C, with
///         the acceleration a_C = a + α × c of the centre (speeds are small, so terms in ω² are neglected):
///           f = m (a + α × c),   τ = I_C α + c × f
///         Largest mass (rotation blocked): α = 0 gives f = m a. Largest inertia (translation blocked): a = 0 gives
///         τ = I_T α with the inertia about the grip, I_T = I_C + m (c·c 1 − c cᵀ) (parallel axes); the result is its
///         largest principal moment.
///         Smallest inertia (translation free): f = 0 gives τ = I_C α; the result is the smallest principal moment of
///         I_C. Smallest mass (rotation free): τ = 0 gives α = −I_C⁻¹ (c × f), so a = (1/m 1 + [c]×ᵀ I_C⁻¹ [c]×) f; the
///         result is the inverse of the largest eigenvalue of this matrix.
///         The coupling holds the body with a finite stiffness, between free and blocked. So the effective mass and
///         inertia lie between these limits.
/// Source  our derivation
/// In      mass  must have a mass above 0
///         p_BT  grip point, in the body's own frame B
std::array<physics::MovedMass, 2> resistance_at(const MassProperties& mass, const Vec3& p_BT, bool is_held_body);

/// Returns the effective masses that the coupling may have to move: that of the user's tool, and the smallest and the
/// largest mass of all bodies that the tool could grab. A held body is assumed to be held at its grip point. For every
/// other body the grip point is not known yet, so its centre of mass is assumed.
///
/// Exception: with a massless tool, or with the law `adaptive`, the coefficients are computed for the mass that is
/// moved now. Then the result contains only the masses of `held`, or only those of the tool if no body is held.
///
/// In      p_BT  position of the tool on `held`, in the body's frame; null if it is not known
/// Out     empty if the server's masses of the tool or of bodies are missing or unusable
std::vector<physics::MovedMass> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law,
                                               BodyId held, const Vec3* p_BT = nullptr);

/// Result of one check, with the data needed to explain it later.
struct CouplingCheck {
  std::uint64_t number = 0;  ///< number of this check, counted from 1; 0: no check has been made
  bool is_refused = false;   ///< true: the coupling must not be displayed, because it is unstable or a mass is unknown
  HapticScene scene;
  std::vector<physics::MovedMass> moved;
};

/// Returns true if the coupling of `scene`, bounded for the device, is stable with each mass in `moved`. Also returns
/// true if the scene's coupling law is unknown. The network delay is not modelled; the lab measures its effect on
/// stability.
///
/// Cost    with three masses in six axes: 0.6 ms for a velocity window of 4 periods, 4 ms for 20 periods (the maximum);
///         allocates
bool is_stable_coupling(const HapticScene& scene, const std::vector<physics::MovedMass>& moved,
                        const devices::DeviceProfile& device);

/// Explains the result of a check and searches for remedies. The findings include kUnstable exactly if
/// is_stable_coupling() returns false.
///
/// Out     the most severe finding for translation and the most severe one for rotation. A third finding is added if
///         the coupling law itself generates energy (find_active_law()). If the moved mass is not known, there is a
///         single finding
/// Cost    6 ms; tens of milliseconds if a remedy is searched for
/// Thread  any that may block
std::vector<haptics::StabilityFinding> explained(const CouplingCheck& check, const devices::DeviceProfile& device);

/// Checks the coupling of a session after changes. Changes arrive in bursts, one message per coefficient. An
/// intermediate combination, such as a new stiffness with the old damping, is not an intended coupling. So the check is
/// made at the end of the burst (debounce).
///
/// Thread  io
class CouplingWatch {
 public:
  /// Time without a change after which a burst counts as complete. Our choice: the messages of one burst arrive
  /// together. The time is short enough that an unstable oscillation cannot grow, because coefficients are ramped over
  /// kCouplingRamp_s.
  static constexpr Duration kQuiet{std::chrono::milliseconds(50)};
  /// Maximum time from the first change of a burst to the check. It is needed because a dragged slider may cause a long
  /// burst.
  static constexpr Duration kAtLatest{std::chrono::milliseconds(250)};
  /// Displacement of the grip point on the body above which the grip counts as new. Our choice: a tenth of a small
  /// handle.
  static constexpr double kGripMoved_m = 0.005;

  /// In      device  profile of the device; without a profile, check() always returns true
  explicit CouplingWatch(std::optional<devices::DeviceProfile> device) : device_(std::move(device)) {}

  /// Restarts the debounce after a change of a coefficient or of the held body.
  void note_change(LocalTime now);
  /// Notes the grip reported by the server: the tool holds `body` at the position `p_BT`. With an invalid id, the tool
  /// holds no body.
  void note_grip(BodyId body, const Vec3& p_BT, LocalTime now);
  void forget_changes() { waits_ = false; }
  bool is_due(LocalTime now) const { return waits_ && now >= due_; }
  /// Checks the coupling of `scene`. Returns true if the coupling may be displayed to a user who drives a tool.
  bool check(const HapticScene& scene, const wire::Joined& joined, BodyId held);
  /// Returns the result of the last check.
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
