// Plays short sounds in a thread of its own, which no other thread waits for.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "client/view/sound/tones.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// Output for samples: one channel at kSampleRate_hz.
///
/// Thread  the player's
class SoundSink {
 public:
  virtual ~SoundSink() = default;
  /// Opens the device. Returns false if there is none; then the player plays nothing more.
  virtual bool open() = 0;
  /// Writes the first samples that fit, without waiting for room. Returns their number, or a negative number if the
  /// device is lost.
  virtual std::ptrdiff_t write(std::span<const std::int16_t> samples) = 0;
  /// Releases the device for other programs, until the next open().
  virtual void close() = 0;
};

/// Thread  play(): one thread, which never waits; the sink is used by the player's thread only
class SoundPlayer {
 public:
  static constexpr std::size_t kMaxQueued = 8;
  /// Age at which a queued sound is discarded: a late contact would be misleading.
  static constexpr Duration kMaxAge{std::chrono::milliseconds(250)};
  /// Silence after which the device is released.
  static constexpr Duration kIdle{std::chrono::seconds(2)};
  /// Longest wait for the thread at the end. A thread that a sound system holds longer is left behind.
  static constexpr Duration kMaxEnd{std::chrono::milliseconds(100)};

  explicit SoundPlayer(std::unique_ptr<SoundSink> sink);
  ~SoundPlayer();
  SoundPlayer(const SoundPlayer&) = delete;
  SoundPlayer& operator=(const SoundPlayer&) = delete;

  /// Queues a sound. Returns false if the queue is full or there is no device; the sound is then discarded.
  /// In      at  time of the event, of SteadyClock
  bool play(Sound sound, double gain, LocalTime at);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace tandem::client
