// See alsa_sink.hpp. The header of alsa-lib is not needed: the declarations below follow the documentation of alsa-lib
// 1.2, "PCM (digital audio) interface" (alsa-project.org).
#include "client/view/sound/alsa_sink.hpp"

#include <algorithm>
#include <cerrno>
#include <exception>
#include <optional>

#include "devices/vendor_library.hpp"

namespace tandem::client {
namespace {

constexpr int kPlayback = 0, kNonBlocking = 1;
constexpr int kFormatS16 = 2;  ///< SND_PCM_FORMAT_S16_LE
constexpr int kInterleaved = 3;
constexpr unsigned kLatency_us = 40'000;

using ErrorHandler = void(const char*, int, const char*, int, const char*, ...);
void ignore_error(const char*, int, const char*, int, const char*, ...) {}

/// Functions of the library that are used.
struct Alsa {
  Alsa();

  devices::VendorLibrary library;
  int (*set_error_handler)(ErrorHandler*) = nullptr;
  int (*open)(void** pcm, const char* name, int stream, int mode) = nullptr;
  int (*set_params)(void* pcm, int format, int access, unsigned channels, unsigned rate, int resamples,
                    unsigned latency_us) = nullptr;
  long (*write)(void* pcm, const void* samples, unsigned long count) = nullptr;
  int (*recover)(void* pcm, int error, int is_silent) = nullptr;
  int (*close)(void* pcm) = nullptr;
};

Alsa::Alsa() : library("sound library", {}, {"libasound.so.2"}) {
  library.find(set_error_handler, "snd_lib_error_set_handler");
  library.find(open, "snd_pcm_open");
  library.find(set_params, "snd_pcm_set_params");
  library.find(write, "snd_pcm_writei");
  library.find(recover, "snd_pcm_recover");
  library.find(close, "snd_pcm_close");
  library.require_all();
  set_error_handler(ignore_error);
}

class AlsaSink : public SoundSink {
 public:
  AlsaSink() = default;
  ~AlsaSink() override { close(); }
  AlsaSink(const AlsaSink&) = delete;
  AlsaSink& operator=(const AlsaSink&) = delete;

  bool open() override;
  std::ptrdiff_t write(std::span<const std::int16_t> samples) override;
  void close() override;

 private:
  std::optional<Alsa> alsa_;
  void* pcm_ = nullptr;
};

bool AlsaSink::open() {
  try {
    if (!alsa_) alsa_.emplace();
  } catch (const std::exception&) {
    return false;  // without the library, there is no sound
  }
  if (alsa_->open(&pcm_, "default", kPlayback, kNonBlocking) < 0) {
    pcm_ = nullptr;
    return false;
  }
  if (alsa_->set_params(pcm_, kFormatS16, kInterleaved, 1, kSampleRate_hz, 1, kLatency_us) >= 0) return true;
  close();
  return false;
}

// Writes samples. An underrun (EPIPE) is normal at the end of a sound, so the device recovers from it at the next
// write.
std::ptrdiff_t AlsaSink::write(std::span<const std::int16_t> samples) {
  const long written = alsa_->write(pcm_, samples.data(), samples.size());
  if (written >= 0 || written == -EAGAIN) return std::max(written, 0L);
  return alsa_->recover(pcm_, static_cast<int>(written), 1) < 0 ? -1 : 0;
}

void AlsaSink::close() {
  if (pcm_ != nullptr) alsa_->close(pcm_);
  pcm_ = nullptr;
}

}  // namespace

std::unique_ptr<SoundSink> alsa_sink() {
  return std::make_unique<AlsaSink>();
}

}  // namespace tandem::client
