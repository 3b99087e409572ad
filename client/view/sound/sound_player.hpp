// Plays short sounds on a thread of its own. No other thread waits for this thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "client/view/sound/tones.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// Output for samples: one channel at kSampleRate_hz.
///
/// Thread  the player's own thread
class SoundSink {
 public:
  virtual ~SoundSink() = default;
  /// Opens the device. Returns false if there is none; the player then remains silent.
  virtual bool open() = 0;
  /// Writes as many of the samples as fit into the device's buffer, without blocking. Returns the number of written
  /// samples, or a negative number if the device is lost.
  virtual std::ptrdiff_t write(std::span<const std::int16_t> samples) = 0;
  /// Releases the device for other programs, until the next open().
  virtual void close() = 0;
};

/// Thread  play(): one thread, which play() never blocks. The sink is used only by the player's own thread
class SoundPlayer {
 public:
  static constexpr std::size_t kMaxQueued = 8;
  /// Age at which a queued sound is discarded, because a late sound of a contact would be misleading.
  static constexpr Duration kMaxAge{std::chrono::milliseconds(250)};
  /// Silence after which the device is released.
  static constexpr Duration kIdle{std::chrono::seconds(2)};
  /// Longest time for which the destructor waits for the thread. If a sound system blocks the thread longer, the thread
  /// is detached.
  static constexpr Duration kMaxEnd{std::chrono::milliseconds(100)};

  explicit SoundPlayer(std::unique_ptr<SoundSink> sink);
  ~SoundPlayer();
  SoundPlayer(const SoundPlayer&) = delete;
  SoundPlayer& operator=(const SoundPlayer&) = delete;

  /// Queues a sound. Returns false if the queue is full or there is no device; the sound is then discarded.
  /// In      at  time of the event, by the clock SteadyClock
  bool play(Sound sound, double gain, LocalTime at);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace tandem::client
