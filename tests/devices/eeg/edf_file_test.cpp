// Tests EDF+ and BDF+ files: values must be exact after writing and reading, and an error must name the wrong field.
#include "devices/eeg/sources/edf_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/random.hpp"
#include "devices/eeg/sources/generator.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::eeg {
namespace {

using testing::HasSubstr;

/// Fixture with a temporary folder, which is removed at the end of the test.
class EdfFile : public testing::Test {
 protected:
  EdfFile() : folder_(std::filesystem::temp_directory_path() / ("edf_test_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~EdfFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }

  /// Returns random signals that use the whole range of the format. Each signal has a different rate.
  static EdfContent random_content(bool is_bdf, Random& random) {
    EdfContent content{.is_bdf = is_bdf, .record_s = 1, .signals = {}, .annotations = {}};
    const int high = is_bdf ? 8'388'607 : 32'767;
    for (int i = 0; i < 3; ++i) {
      const int rate = 64 << i;
      EdfSignal signal{.name = "EEG F" + std::to_string(i),
                       .unit = i == 2 ? "mV" : "uV",
                       .samples_per_record = rate,
                       .digital_min = -high - 1,
                       .digital_max = high,
                       .physical_min = -200.5,
                       .physical_max = 187.25,
                       .digital = {}};
      for (int n = 0; n < 5 * rate; ++n)
        signal.digital.push_back(static_cast<std::int32_t>(std::floor(random.uniform(-high - 1.0, high + 1.0))));
      signal.digital[0] = high;
      signal.digital[1] = -high - 1;
      content.signals.push_back(std::move(signal));
    }
    content.annotations = {{0.5, 1.25, "negative"}, {2, std::nullopt, "blink \xc3\xa9"}, {3.75, 0, "positive"}};
    return content;
  }

  std::string bytes_of(const std::string& name) const {
    std::ifstream in(path(name), std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  void write_bytes(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
  }
  /// Returns the message with which the file is refused; empty if it is accepted.
  std::string refusal_of(const std::string& name) const {
    try {
      read_edf(path(name));
      return "";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

TEST_F(EdfFile, DigitalValuesAndAnnotationsAreExactAfterARoundTrip) {
  Random random(test::test_seed(5));
  for (const bool is_bdf : {false, true}) {
    const EdfContent written = random_content(is_bdf, random);
    const auto file = path(is_bdf ? "a.bdf" : "a.edf");
    write_edf(file, written);
    const EdfContent read = read_edf(file);
    EXPECT_EQ(read.is_bdf, is_bdf);
    EXPECT_EQ(read.record_s, 1);
    ASSERT_EQ(read.signals.size(), written.signals.size());
    for (std::size_t i = 0; i < read.signals.size(); ++i) {
      const EdfSignal &a = read.signals[i], &b = written.signals[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.unit, b.unit);
      EXPECT_EQ(a.samples_per_record, b.samples_per_record);
      EXPECT_EQ(a.physical_min, b.physical_min);
      EXPECT_EQ(a.physical_max, b.physical_max);
      EXPECT_EQ(a.digital_min, b.digital_min);
      EXPECT_EQ(a.digital_max, b.digital_max);
      EXPECT_EQ(a.digital, b.digital);
    }
    ASSERT_EQ(read.annotations.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(read.annotations[i].onset_s, written.annotations[i].onset_s, 1e-9);
      EXPECT_EQ(read.annotations[i].duration_s, written.annotations[i].duration_s);
      EXPECT_EQ(read.annotations[i].text, written.annotations[i].text);
    }
  }
}

TEST_F(EdfFile, AnIndependentReaderFindsTheSameValues) {
  TANDEM_NEEDS_FILES("/usr/bin/save2gdf");
  Random random(test::test_seed(8));
  for (const bool is_bdf : {false, true}) {
    EdfContent content =
        edf_from({.origin = "", .format = {{"F3", "O1"}, 128, {}}, .samples_uv = {{}, {}}, .annotations = {}}, is_bdf);
    for (EdfSignal& one : content.signals) {
      for (int n = 0; n < 10 * 128; ++n) one.digital.push_back(static_cast<std::int32_t>(random.uniform(-2000, 2000)));
    }
    const std::string name = is_bdf ? "b.bdf" : "b.edf";
    write_edf(path(name), content);
    const std::string command =
        "save2gdf -f=CSV " + path(name).string() + " " + path("b.csv").string() + " >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    const EdfContent read = read_edf(path(name));
    std::ifstream in(path("b.csv"));
    std::string line;
    std::getline(in, line);
    EXPECT_EQ(line, "\"EEG F3 [uV]\",\"EEG O1 [uV]\"");
    std::size_t n = 0;
    for (; std::getline(in, line) && !line.empty(); ++n) {
      double values[2] = {};
      ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf", &values[0], &values[1]), 2) << line;
      for (std::size_t i = 0; i < 2; ++i) {
        // The independent reader prints physical values with six digits. Its rounding is smaller than a quarter of a
        // step of the converter.
        const double step = is_bdf ? 0.03125 : 0.125;
        ASSERT_NEAR(values[i], read.signals[i].physical(read.signals[i].digital[n]), step / 4) << name << " " << n;
        ASSERT_EQ(std::lround((values[i] - read.signals[i].physical(0)) / step), content.signals[i].digital[n]);
      }
    }
    EXPECT_EQ(n, 10U * 128);
  }
}

TEST_F(EdfFile, TheFileNamesNoPersonAndNoDate) {
  Random random(1);
  write_edf(path("a.edf"), random_content(false, random));
  EXPECT_THAT(bytes_of("a.edf").substr(8, 160), HasSubstr("Startdate 01-JAN-1985 X X X"));
  EXPECT_EQ(bytes_of("a.edf").substr(8, 8), "X X X X ");
}

TEST_F(EdfFile, AnExistingFileIsNotReplaced) {
  Random random(1);
  const EdfContent content = random_content(false, random);
  write_edf(path("a.edf"), content);
  EXPECT_THROW(write_edf(path("a.edf"), content), std::invalid_argument);
}

TEST_F(EdfFile, ARecordingIsInMicrovoltsWithTheNamesOfItsElectrodes) {
  Random random(2);
  EdfContent content = random_content(false, random);
  for (EdfSignal& one : content.signals) one.samples_per_record = 64;
  for (EdfSignal& one : content.signals) one.digital.resize(64 * 5);
  write_edf(path("a.edf"), content);
  const Recording all = read_recording(path("a.edf"), {});
  EXPECT_THAT(all.format.channels, testing::ElementsAre("F0", "F1", "F2"));
  EXPECT_EQ(all.format.rate_hz, 64);
  const double step = (187.25 + 200.5) / 65535;
  EXPECT_NEAR(all.samples_uv[0][7], -200.5 + (content.signals[0].digital[7] + 32768) * step, 1e-9);
  EXPECT_NEAR(all.samples_uv[2][7], 1000 * (-200.5 + (content.signals[2].digital[7] + 32768) * step), 1e-6);
  const Recording one = read_recording(path("a.edf"), {"F2", "F0"});
  EXPECT_THAT(one.format.channels, testing::ElementsAre("F2", "F0"));
  EXPECT_EQ(one.samples_uv[1], all.samples_uv[0]);
}

TEST_F(EdfFile, ChannelsThatDoNotFitAreRefusedByName) {
  Random random(2);
  EdfContent content = random_content(false, random);
  content.signals[0].unit = "degC";
  write_edf(path("a.edf"), content);
  const auto message = [&](const std::vector<std::string>& channels) {
    try {
      read_recording(path("a.edf"), channels);
      return std::string();
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
  };
  EXPECT_THAT(message({"F9"}), HasSubstr("has no channel 'F9'; it has F0 [degC], F1 [uV], F2 [mV]"));
  EXPECT_THAT(message({"F0"}), HasSubstr("unit of channel 'F0' is 'degC'"));
  EXPECT_THAT(message({}), HasSubstr("F1 and F2 have different rates"));
}

TEST_F(EdfFile, EachWrongFieldIsNamed) {
  Random random(3);
  write_edf(path("good.edf"), random_content(false, random));
  const std::string good = bytes_of("good.edf");
  const std::size_t signals = 4;  // three signals and the annotations
  const auto field = [&](std::size_t offset, std::size_t size) { return 256 + signals * offset + 1 * size; };
  const struct {
    std::size_t place;
    std::string bytes;
    std::string named;
  } cases[] = {{0, "1       ", "version is '1'"},
               {10, "\x01", "patient is"},
               {184, "99999999", "header bytes is '99999999'"},
               {192, "EDF+D", "reserved is 'EDF+D"},
               {236, "-1      ", "number of records is '-1'; the recording was not finished"},
               {236, "9       ", "number of records is '9'; the header announces"},
               {236, "x       ", "number of records is 'x'"},
               {244, "0       ", "duration of a record is '0'"},
               {244, "nan     ", "duration of a record is 'nan'"},
               {252, "0   ", "number of signals is '0'"},
               {252, "9999", "number of signals is '9999'"},
               {field(104, 8), "abc     ", "signals[1].physical minimum is 'abc'"},
               {field(112, 8), "-200.5  ", "signals[1].physical maximum is '-200.5'"},
               {field(120, 8), "-40000  ", "signals[1].digital minimum is '-40000'"},
               {field(128, 8), "-32768  ", "signals[1].digital maximum is '-32768'"},
               {field(216, 8), "0       ", "signals[1].samples is '0'"},
               {field(216, 8), "99999999", "signals[1].samples is '99999999'"}};
  for (const auto& one : cases) {
    std::string bytes = good;
    bytes.replace(one.place, one.bytes.size(), one.bytes);
    write_bytes("bad.edf", bytes);
    EXPECT_THAT(refusal_of("bad.edf"), HasSubstr("bad.edf: " + one.named));
  }
  EXPECT_THAT(refusal_of("nowhere.edf"), HasSubstr("nowhere.edf: is no file"));
}

TEST_F(EdfFile, ATruncatedFileIsRefusedAtEveryLength) {
  Random random(4);
  EdfContent content = random_content(true, random);
  write_edf(path("good.bdf"), content);
  const std::string good = bytes_of("good.bdf");
  for (std::size_t size = 0; size < good.size(); size += 1 + size / 40) {
    write_bytes("cut.bdf", good.substr(0, size));
    EXPECT_NE(refusal_of("cut.bdf"), "") << size;
  }
}

TEST_F(EdfFile, AMutatedFileIsReadOrRefused) {
  Random random(test::test_seed(6));
  std::size_t read = 0;
  for (const bool is_bdf : {false, true}) {
    write_edf(path("good"), random_content(is_bdf, random));
    const std::string good = bytes_of("good");
    std::filesystem::remove(path("good"));
    for (int trial = 0; trial < 1500; ++trial) {
      std::string bytes = good;
      const int changes = 1 + static_cast<int>(random.uniform() * 4);
      for (int i = 0; i < changes; ++i) {
        // Half of the changes are in the header, which contains most of the structure.
        const double reach = random.uniform() < 0.5 ? 1280 : static_cast<double>(bytes.size());
        bytes[static_cast<std::size_t>(random.uniform() * reach)] = static_cast<char>(random.next_u32());
      }
      write_bytes("mutated", bytes);
      if (refusal_of("mutated").empty()) ++read;
    }
  }
  EXPECT_GT(read, 300U) << "changes of samples are no errors";
}

}  // namespace
}  // namespace tandem::eeg
