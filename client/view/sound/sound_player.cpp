#include "client/view/sound/sound_player.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <future>
#include <semaphore>
#include <thread>
#include <utility>

#include "common/realtime/ring.hpp"

namespace tandem::client {
namespace {

/// Period of checking whether the device's buffer has space again.
constexpr Duration kPoll{std::chrono::milliseconds(5)};
/// Time after which a device that accepts no samples counts as failed.
constexpr Duration kStuck{std::chrono::milliseconds(500)};
/// Length of the silence that is written after a sound. It makes a device start even if the sound is shorter than the
/// device's buffer. The silence is written in pieces, and only while no sound is queued, so that it does not delay the
/// next sound.
constexpr std::size_t kTail = static_cast<std::size_t>(0.1 * kSampleRate_hz);
constexpr std::size_t kTailPiece = kTail / 20;

struct Queued {
  Sound sound = Sound::kContact;
  double gain = 0;
  LocalTime at{};
};

}  // namespace

/// State of the player. The player and its thread share it, because the thread may outlive the player.
struct SoundPlayer::Shared {
  explicit Shared(std::unique_ptr<SoundSink> by) : sink(std::move(by)) {}

  void run();
  void play(const Queued& queued);
  bool write(std::span<const std::int16_t> samples);
  void write_or_close(std::span<const std::int16_t> samples);

  std::unique_ptr<SoundSink> sink;
  SteadyClock clock;
  realtime::Ring<Queued> queue{kMaxQueued};
  std::counting_semaphore<kMaxQueued + 1> work{0};  ///< counts the queued sounds, plus one for the end
  std::atomic<bool> is_ending{false};
  std::atomic<bool> has_no_device{false};
  bool is_open = false;
  std::size_t tail = 0;  ///< samples of silence that remain to be written
  std::thread thread;
  std::promise<void> end;
};

SoundPlayer::SoundPlayer(std::unique_ptr<SoundSink> sink) : shared_(std::make_shared<Shared>(std::move(sink))) {
  shared_->thread = std::thread([shared = shared_] { shared->run(); });
}

SoundPlayer::~SoundPlayer() {
  const std::future<void> end = shared_->end.get_future();
  shared_->is_ending = true;
  shared_->work.release();
  if (end.wait_for(kMaxEnd) == std::future_status::ready) {
    shared_->thread.join();
  } else {
    shared_->thread.detach();  // the thread may still use the shared state, which it keeps alive
  }
}

bool SoundPlayer::play(Sound sound, double gain, LocalTime at) {
  if (shared_->has_no_device || !shared_->queue.push({sound, gain, at})) return false;
  shared_->work.release();
  return true;
}

void SoundPlayer::Shared::run() {
  while (!is_ending) {
    Queued queued;
    if (!work.try_acquire_for(tail > 0 ? Duration{0} : kIdle)) {
      if (tail > 0) {
        const std::array<std::int16_t, kTailPiece> silence{};
        tail -= std::min(tail, kTailPiece);
        write_or_close(silence);
        continue;
      }
      if (std::exchange(is_open, false)) sink->close();
    } else if (!is_ending && queue.pop(queued)) {
      play(queued);
    }
  }
  if (is_open) sink->close();
  end.set_value();
}

void SoundPlayer::Shared::play(const Queued& queued) {
  if (has_no_device || clock.now() - queued.at > kMaxAge) return;
  if (!is_open) is_open = sink->open();
  has_no_device = !is_open;
  if (!is_open) return;
  tail = kTail;
  write_or_close(samples_of(queued.sound, queued.gain));
}

/// Writes all samples. If the device is lost or accepts none, closes the device.
void SoundPlayer::Shared::write_or_close(std::span<const std::int16_t> samples) {
  if (write(samples)) return;
  sink->close();
  is_open = false;
  tail = 0;
}

/// Writes all samples. Returns false if the device is lost, or has accepted no samples for kStuck.
bool SoundPlayer::Shared::write(std::span<const std::int16_t> samples) {
  LocalTime progress_at = clock.now();
  while (!samples.empty() && !is_ending) {
    const std::ptrdiff_t written = sink->write(samples);
    if (written < 0 || clock.now() - progress_at > kStuck) return false;
    samples = samples.subspan(std::min(samples.size(), static_cast<std::size_t>(written)));
    if (written > 0) {
      progress_at = clock.now();
    } else {
      std::this_thread::sleep_for(kPoll);
    }
  }
  return true;
}

}  // namespace tandem::client
