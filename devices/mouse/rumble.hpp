// Displays force by the rumble motors of a game pad, for users of a mouse (Linux evdev, FF_RUMBLE).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

namespace tandem::devices {

/// Sends the strength to the game pad, at most 50 times a second. A separate thread does so, because the pad may be
/// slow. An effect lasts 0.2 s and is renewed while show() is called. The rumble therefore ends by itself if the
/// program ends or is stopped, or if the haptic loop hangs. A pad that was unplugged is opened again.
class Rumble {
 public:
  /// Fails   std::runtime_error: the device file cannot be opened, or the pad has no rumble motors
  explicit Rumble(std::string node);
  /// Stops the motors and ends the thread.
  ~Rumble();
  Rumble(const Rumble&) = delete;
  Rumble& operator=(const Rumble&) = delete;

  /// Sets the strength of the rumble.
  /// In      share  fraction of the maximum strength, clamped to 0..1; NaN counts as 0
  /// Thread  haptic: one atomic store
  void show(double share) noexcept;

 private:
  void run();
  bool send(double share);

  std::string node_;
  int pad_ = -1;     ///< file descriptor of the pad; negative: not connected
  int effect_ = -1;  ///< id of the effect in the pad; negative: no effect was uploaded
  std::atomic<float> share_{0};
  std::atomic<std::uint32_t> shows_{0};  ///< number of calls of show()
  std::atomic<bool> should_stop_{false};
  std::thread thread_;
};

/// Opens the game pad that an option selects.
/// In      wish  "off": returns null. "auto": the first usable pad, or null if there is none. Otherwise a device file,
///               /dev/input/eventN
/// Fails   std::runtime_error: the device file is unusable, see Rumble
std::unique_ptr<Rumble> open_rumble(const std::string& wish);

}  // namespace tandem::devices
