// Whether a scene's coupling is fit for this client's device. The verdict is quick and the io thread's, the reasons
// take their time and are asked for by a thread that nobody waits for.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "common/physics/coupling_in_force.hpp"
#include "devices/device_profile.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// The least and the most mass and moment of inertia with which a body resists a coupling that holds it at a place.
///
/// Model   grip T, c = p_TC to the centre of mass C, force f and torque τ at T. Newton and Euler about C, with the
///         centre's acceleration a_C = a + α × c (speeds are small: no terms in ω²):
///           f = m (a + α × c),   τ = I_C α + c × f
///         Most: the other motion is held fast. α = 0 gives f = m a. a = 0 gives τ = I_T α with the inertia about the
///         grip, I_T = I_C + m (c·c 1 − c cᵀ) (parallel axes); its largest principal moment counts.
///         Least: the other motion is free. f = 0 gives τ = I_C α; its smallest principal moment counts. τ = 0 gives
///         α = −I_C⁻¹ (c × f), so a = (1/m 1 + [c]×ᵀ I_C⁻¹ [c]×) f; the inverse of its largest eigenvalue counts.
///         The coupling's other stiffness lies between free and fast, so what it feels lies between least and most.
/// Source  our derivation
/// In      mass  with a mass above 0
///         p_BT  where it is held, in its own frame B
std::array<physics::MovedMass, 2> resistance_at(const MassProperties& mass, const Vec3& p_BT, bool is_held_body);

/// What the coupling may have to move: the user's tool, and the least and the most that a body which it could grab
/// resists. A body that is held counts where it is held, any other as held at its centre of mass, for nobody knows
/// where it will be. Where coefficients follow what is moved (a massless tool's, or those of `adaptive`), those of the
/// moment go with nothing else: then what is moved now, `held` or the tool.
///
/// In      p_BT  where the tool is on `held`, in the body's frame; null: not known
/// Out     empty when the server's masses of tool or bodies are missing or of no use
std::vector<physics::MovedMass> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law,
                                               BodyId held, const Vec3* p_BT = nullptr);

/// One check, with all that it takes to ask later what it found.
struct CouplingCheck {
  std::uint64_t number = 0;  ///< of the checks so far; 0: nothing was checked
  bool is_refused = false;   ///< unstable on this device, or nothing is known of what it moves: not to be displayed
  HapticScene scene;
  std::vector<physics::MovedMass> moved;
};

/// What the haptic path would render of `scene` is stable with all that it moves, or has no loop of its own. It knows
/// nothing of the network: what delay does to the loop is measured in the lab.
///
/// Cost    with three things to move, in six axes: 0.6 ms at velocity windows of 4 periods, 4 ms at 20, the largest;
///         allocates
bool is_stable_coupling(const HapticScene& scene, const std::vector<physics::MovedMass>& moved,
                        const devices::DeviceProfile& device);

/// Why, and what would do instead; kUnstable exactly where is_stable_coupling() is false.
///
/// Out     at most one finding each for translation and rotation, the graver, and one for a law that is active by
///         itself; one alone when nothing is known of what is moved
/// Cost    6 ms; tens of milliseconds where a remedy is searched (thread any that nothing waits for)
std::vector<haptics::StabilityFinding> explained(const CouplingCheck& check, const devices::DeviceProfile& device);

/// Keeps up with a session's coupling. Coefficients come in bursts, one message each, and a new stiffness with the old
/// damping is no coupling that anybody meant: it waits for the end of the burst.
///
/// Thread  the session's
class CouplingWatch {
 public:
  /// Ours: the messages of one burst come together. What is unstable has no time to grow meanwhile, for the
  /// coefficients themselves take kCouplingRamp_s.
  static constexpr Duration kQuiet{std::chrono::milliseconds(50)};
  /// A slider that is dragged is looked at this often.
  static constexpr Duration kAtLatest{std::chrono::milliseconds(250)};
  /// A grip that moves on the body by more is another one. Ours: a tenth of a small handle.
  static constexpr double kGripMoved_m = 0.005;

  /// Without a device nothing is checked.
  explicit CouplingWatch(std::optional<devices::DeviceProfile> device) : device_(std::move(device)) {}

  /// A coefficient came, or what is held changed.
  void note_change(LocalTime now);
  /// The server's state: the tool is at `p_BT` on the body that it holds; an invalid id: it holds none.
  void note_grip(BodyId body, const Vec3& p_BT, LocalTime now);
  void forget_changes() { waits_ = false; }
  bool is_due(LocalTime now) const { return waits_ && now >= due_; }
  /// Whether `scene`, a manipulator's, may be displayed.
  bool check(const HapticScene& scene, const wire::Joined& joined, BodyId held);
  /// The last check.
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
