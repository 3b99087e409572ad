// A game pad's motors as a sign of force, for somebody whose mouse shows none: Linux' evdev, FF_RUMBLE.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

namespace tandem::devices {

/// Sends how strong it is to the pad, 50 times a second at most, from a thread of its own, for the pad may take its time.
/// An effect lasts 0.2 s, and is repeated while show() is called: neither a program that dies or is stopped nor a haptic loop that
/// hangs leaves a pad rumbling. A pad that is unplugged is opened again.
class Rumble {
 public:
  /// Fails   std::runtime_error: it cannot be opened, or does not rumble
  explicit Rumble(std::string node);
  /// The motors stand still.
  ~Rumble();
  Rumble(const Rumble&) = delete;
  Rumble& operator=(const Rumble&) = delete;

  /// In      share  of what the motors can, 0 to 1; anything else counts as the nearest, and NaN as 0
  /// Thread  haptic: one atomic store
  void show(double share) noexcept;

 private:
  void run();
  bool send(double share);

  std::string node_;
  int pad_ = -1;     ///< below 0: not there
  int effect_ = -1;  ///< the pad's number of it; below 0: none yet
  std::atomic<float> share_{0};
  std::atomic<std::uint32_t> shows_{0};  ///< calls of show()
  std::atomic<bool> should_stop_{false};
  std::thread thread_;
};

/// In      wish  "off": null. "auto": the first pad that can be opened, else null. Else a node, /dev/input/eventN
/// Fails   std::runtime_error, of a node: as Rumble
std::unique_ptr<Rumble> open_rumble(const std::string& wish);

}  // namespace tandem::devices
