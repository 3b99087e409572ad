// Rumble of a game pad as a display of force, for users of a mouse: Linux evdev, FF_RUMBLE.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

namespace tandem::devices {

/// Sends the strength to the pad at most 50 times a second, from its own thread, because the pad may be slow. An effect
/// lasts 0.2 s and is repeated while show() is called. The rumble thus ends when the program dies or is stopped, or
/// when the haptic loop hangs. An unplugged pad is opened again.
class Rumble {
 public:
  /// Fails   std::runtime_error: the node cannot be opened, or has no rumble
  explicit Rumble(std::string node);
  /// Stops the motors.
  ~Rumble();
  Rumble(const Rumble&) = delete;
  Rumble& operator=(const Rumble&) = delete;

  /// In      share  share of the motors' maximum, clamped to 0 to 1; NaN counts as 0
  /// Thread  haptic: one atomic store
  void show(double share) noexcept;

 private:
  void run();
  bool send(double share);

  std::string node_;
  int pad_ = -1;     ///< negative: not connected
  int effect_ = -1;  ///< the pad's number of the effect; negative: none yet
  std::atomic<float> share_{0};
  std::atomic<std::uint32_t> shows_{0};  ///< number of calls of show()
  std::atomic<bool> should_stop_{false};
  std::thread thread_;
};

/// Opens the pad of an option.
/// In      wish  "off": null. "auto": the first usable pad, else null. Otherwise a node, /dev/input/eventN
/// Fails   std::runtime_error for a node, see Rumble
std::unique_ptr<Rumble> open_rumble(const std::string& wish);

}  // namespace tandem::devices
