// Whether a scene's coupling is fit for this client's device. The verdict is quick and the io thread's, the reasons
// take their time and are asked for by a thread that nobody waits for.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "devices/device_profile.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Something that the coupling may have to move.
struct MovedThing {
  double mass_kg = 0;  ///< 0: not known
  bool is_held_body = false;
};
/// The user's tool and the lightest and heaviest body that it could grab in this scene. Where coefficients follow what
/// is moved (a massless tool's, or those of `adaptive`), those of the moment go with nothing else: then what is moved
/// now, `held` or the tool.
std::vector<MovedThing> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law, BodyId held);

/// One check, with all that it takes to ask later what it found.
struct CouplingCheck {
  std::uint64_t number = 0;  ///< of the checks so far; 0: nothing was checked
  bool is_refused = false;   ///< unstable on this device: not to be displayed
  HapticScene scene;
  std::vector<MovedThing> moved;
};

/// What the haptic path would render of `scene` is stable with all that it moves, or has no loop of its own. It knows
/// nothing of the network: what delay does to the loop is measured in the lab.
///
/// Cost    with three things to move, in six axes: 0.6 ms at velocity windows of 4 periods, 4 ms at 20, the largest;
///         allocates
bool is_stable_coupling(const HapticScene& scene, const std::vector<MovedThing>& moved,
                        const devices::DeviceProfile& device);

/// Why, and what would do instead; kUnstable exactly where is_stable_coupling() is false.
///
/// Out     at most one finding each for translation and rotation, the graver, and one for a law that is active by
/// itself
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

  /// Without a device nothing is checked.
  explicit CouplingWatch(std::optional<devices::DeviceProfile> device) : device_(std::move(device)) {}

  /// A coefficient came, or what is held changed.
  void note_change(LocalTime now);
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
  CouplingCheck last_;
};

}  // namespace tandem::client
