// Tests the LSL source with a fake of liblsl (fake_lsl.cpp), which it loads by dlopen().
#include "devices/eeg/sources/lsl_source.hpp"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <thread>

namespace tandem::eeg {
namespace {

using testing::HasSubstr;

class Lsl : public testing::Test {
 protected:
  Lsl() : handle_(dlopen(TANDEM_FAKE_LSL, RTLD_NOW | RTLD_LOCAL)) {
    set<int>("fake_streams", 1);
    set<int>("fake_channels", 2);
    set<double>("fake_rate_hz", 128);
    set<const char*>("fake_labels", "F3");
    set<const char*>("fake_unit", "microvolts");
    set<int>("fake_error", 0);
    set<int>("fake_samples", 4);
  }
  ~Lsl() override { dlclose(handle_); }

  template <class T>
  T& variable(const char* name) {
    return *static_cast<T*>(dlsym(handle_, name));
  }
  template <class T>
  void set(const char* name, T value) {
    variable<T>(name) = value;
  }
  std::unique_ptr<EegSource> open() {
    settings_.library = TANDEM_FAKE_LSL;
    return open_lsl(settings_);
  }
  std::string refusal() {
    try {
      open();
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  LslSettings settings_;
  void* handle_;
};

TEST_F(Lsl, SuppliesItsSamplesWithNamesAndRateOfItsDescription) {
  const auto source = open();
  EXPECT_THAT(source->format().channels, testing::ElementsAre("F3", "O1"));
  EXPECT_EQ(source->format().rate_hz, 128);
  EXPECT_STREQ(&variable<char>("fake_property"), "type");
  EXPECT_STREQ(&variable<char>("fake_value"), "EEG");
  std::vector<double> frames;
  EXPECT_TRUE(source->read(frames, std::chrono::milliseconds(10)));
  EXPECT_THAT(frames, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST_F(Lsl, ConvertsTheUnitOfTheStream) {
  set<const char*>("fake_unit", "mV");
  std::vector<double> frames;
  open()->read(frames, std::chrono::milliseconds(10));
  EXPECT_EQ(frames[3], 3000);
}

TEST_F(Lsl, WithoutADescriptionChannelsHaveNumbers) {
  set<const char*>("fake_labels", nullptr);
  EXPECT_THAT(open()->format().channels, testing::ElementsAre("channel 1", "channel 2"));
}

TEST_F(Lsl, IsChosenByItsName) {
  settings_.stream = "my headset";
  open();
  EXPECT_STREQ(&variable<char>("fake_property"), "name");
  EXPECT_STREQ(&variable<char>("fake_value"), "my headset");
}

TEST_F(Lsl, ReleasesAllItsObjects) {
  set<int>("fake_streams", 3);
  open();
  EXPECT_EQ(variable<int>("fake_open_inlets"), 0);
  EXPECT_EQ(variable<int>("fake_infos"), 0);
}

TEST_F(Lsl, EachErrorNamesItsRemedy) {
  set<int>("fake_streams", 0);
  EXPECT_THAT(refusal(), HasSubstr("LSL finds no stream of the type EEG; start the headset's LSL program"));
  set<int>("fake_streams", 1);
  set<double>("fake_rate_hz", 0);
  EXPECT_THAT(refusal(), HasSubstr("'fake' has no constant rate"));
  set<double>("fake_rate_hz", std::nan(""));
  EXPECT_THAT(refusal(), HasSubstr("'fake' has no constant rate"));
  set<double>("fake_rate_hz", 128);
  set<int>("fake_channels", 100'000);
  EXPECT_THAT(refusal(), HasSubstr("has 100000 channels"));
  set<int>("fake_channels", 2);
  set<const char*>("fake_unit", "furlong");
  EXPECT_THAT(refusal(), HasSubstr("channel 'F3' has the unit 'furlong'"));
}

TEST_F(Lsl, ALostStreamIsReported) {
  const auto source = open();
  set<int>("fake_error", -2);
  std::vector<double> frames;
  try {
    source->read(frames, std::chrono::milliseconds(10));
    FAIL() << "nothing was reported";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the LSL stream was lost; start the headset's LSL program again"));
  }
}

TEST_F(Lsl, AStreamThatIsSilentCountsAsLost) {
  settings_.silent_for = std::chrono::milliseconds(50);
  const auto source = open();
  std::vector<double> frames;
  EXPECT_NO_THROW(source->read(frames, std::chrono::milliseconds(10)));
  EXPECT_EQ(frames.size(), 8U);
  set<int>("fake_samples", 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  try {
    source->read(frames, std::chrono::milliseconds(10));
    FAIL() << "nothing was reported";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the LSL stream sends nothing"));
  }
}

TEST(LslLibrary, AMissingOrIncompleteLibraryIsNamed) {
  for (const auto& [file, words] :
       {std::pair{"/nowhere/liblsl.so", "--library"}, {TANDEM_FAKE_LSL_WITHOUT_PULL, "it has no lsl_pull_chunk_d"}}) {
    LslSettings settings;
    settings.library = file;
    try {
      open_lsl(settings);
      FAIL() << file;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
}

}  // namespace
}  // namespace tandem::eeg
