// Tests the ALSA sink with a configuration that writes to a file instead of a sound card.
#include "client/view/sound/alsa_sink.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/needs.hpp"

namespace tandem::client {
namespace {

class AlsaSinkTest : public testing::Test {
 protected:
  AlsaSinkTest() {
    std::filesystem::create_directories(folder_);
    std::filesystem::remove(raw_);
  }
  ~AlsaSinkTest() override { unsetenv("ALSA_CONFIG_PATH"); }
  /// Sets the ALSA configuration. `name` must be new for each call, because the library reads a file of the same name
  /// only once.
  void configure(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    setenv("ALSA_CONFIG_PATH", (folder_ / name).c_str(), 1);
  }
  std::vector<std::int16_t> written() const {
    std::ifstream in(raw_, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    std::vector<std::int16_t> samples(bytes.size() / 2);
    std::memcpy(samples.data(), bytes.data(), 2 * samples.size());
    return samples;
  }
  static void write_all(SoundSink& sink, std::span<const std::int16_t> samples) {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!samples.empty()) {
      const std::ptrdiff_t count = sink.write(samples);
      ASSERT_GE(count, 0);
      samples = samples.subspan(static_cast<std::size_t>(count));
      if (count == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ASSERT_LT(std::chrono::steady_clock::now(), give_up);
    }
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / "alsa_sink";
  std::filesystem::path raw_ = folder_ / "out.raw";
};

TEST_F(AlsaSinkTest, WritesTheSamplesToTheDefaultDevice) {
  TANDEM_NEEDS_FILES("/usr/share/alsa/alsa.conf");
  configure("file.conf",
            "pcm.default { type file file \"" + raw_.string() + "\" format raw slave.pcm { type null } }\n");
  const auto sink = alsa_sink();
  ASSERT_TRUE(sink->open());
  std::vector<std::int16_t> samples = samples_of(Sound::kGoal, 1);
  const std::vector<std::int16_t> sound = samples;
  samples.resize(samples.size() + kSampleRate_hz);  // silence that pushes the sound through the buffers
  write_all(*sink, samples);
  sink->close();
  const auto received = written();
  EXPECT_FALSE(std::ranges::search(received, sound).empty()) << received.size() << " samples";
}

TEST_F(AlsaSinkTest, WithoutASoundCardThereIsNoneAndNothingIsPrinted) {
  configure("none.conf", "pcm.default { type hw card 31 device 0 }\n");
  testing::internal::CaptureStderr();
  EXPECT_FALSE(alsa_sink()->open());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace tandem::client
