// Tests training and validation of the classifier with synthetic EEG, for which the best possible accuracy is known.
#include "devices/eeg/classifier/model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/base/json.hpp"
#include "common/base/random.hpp"
#include "devices/eeg/classifier/sigmoid.hpp"
#include "devices/eeg/classifier/signal.hpp"
#include "devices/eeg/classifier/validation.hpp"
#include "devices/eeg/sources/generator.hpp"
#include "devices/eeg/sources/recorded_source.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::eeg {
namespace {

using testing::HasSubstr;

/// Returns a calibration with the generated sessions of the numbers `first` to `last`.
Calibration sessions(GeneratorSettings settings, std::uint64_t first, std::uint64_t last) {
  Calibration calibration;
  for (std::uint64_t session = first; session <= last; ++session) {
    settings.session = session;
    Recording recording = generate(settings);
    recording.origin = "session " + std::to_string(session);
    add_session(calibration, recording);
  }
  return calibration;
}

template <class Function>
std::string message_of(const Function& function) {
  try {
    function();
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

/// Returns a recording whose samples are all zero, for tests of labels.
Recording silence(double length_s) {
  Recording recording{.origin = "quiet.edf", .format = {{"F3"}, 128, {}}, .samples_uv = {{}}, .annotations = {}};
  recording.samples_uv[0].assign(static_cast<std::size_t>(length_s * 128), 0);
  return recording;
}

TEST(Classifier, ReachesTheBayesAccuracyOnHeldOutSessions) {
  GeneratorSettings settings;
  settings.seed = test::test_seed(1);
  settings.bayes_accuracy = 0.9;
  settings.blocks = 60;
  settings.windows_per_block = 5;
  const Model model = train(sessions(settings, 1, 3), kDefaultPenalty);
  const Accuracy accuracy = validate(model, sessions(settings, 4, 6), 1000, 1);
  EXPECT_GE(accuracy.windows, 850U);
  EXPECT_NEAR(accuracy.share, 0.9, 0.03);
  EXPECT_TRUE(accuracy.is_above_chance());
  EXPECT_LT(accuracy.p_value, 0.01);
}

TEST(Classifier, ProbabilitiesAreCalibrated) {
  GeneratorSettings settings;
  settings.seed = 2;
  settings.channels = {"F3", "F4", "O1", "O2"};
  settings.bayes_accuracy = 0.8;
  settings.blocks = 100;
  const Model model = train(sessions(settings, 1, 2), kDefaultPenalty);
  const Calibration test = sessions(settings, 3, 4);
  double expected = 0, correct = 0;
  for (const LabelledWindow& one : test.windows) {
    const Valence valence = model.valence(one.features);
    EXPECT_GE(valence.confidence, 0.5);
    EXPECT_NEAR(valence.confidence, (1 + std::abs(valence.value)) / 2, 1e-12);
    expected += valence.confidence;
    correct += (valence.value > 0) == one.is_positive ? 1 : 0;
  }
  const auto count = static_cast<double>(test.windows.size());
  EXPECT_NEAR(expected / count, correct / count, 0.05) << "mean confidence is the share of correct signs";
}

TEST(NoEffect, AccuracyIsInTheBandOfChanceForSeventeenOfTwentySeeds) {
  GeneratorSettings settings;
  settings.channels = {"F3", "F4", "O1", "O2"};
  settings.bayes_accuracy = 0.5;
  settings.block_effect = 0.5;
  settings.blocks = 20;
  settings.windows_per_block = 3;
  int inside = 0;
  for (settings.seed = 100; settings.seed < 120; ++settings.seed) {
    const Calibration calibration = sessions(settings, 1, 3);
    const auto folds = split(calibration, SplitBy::kSessions, 0, settings.seed);
    const Accuracy accuracy = validate(calibration, folds, kDefaultPenalty, 1000, settings.seed);
    inside += accuracy.share >= accuracy.chance_low && accuracy.share <= accuracy.chance_high ? 1 : 0;
  }
  EXPECT_GE(inside, 17);
}

class Split : public testing::Test {
 protected:
  static GeneratorSettings small() {
    GeneratorSettings settings;
    settings.channels = {"F3", "O1"};
    settings.blocks = 8;
    settings.windows_per_block = 3;
    return settings;
  }
};

TEST_F(Split, ThatSharesBlocksIsRefusedWithTheReason) {
  const Calibration calibration = sessions(small(), 1, 2);
  const auto folds = split(calibration, SplitBy::kWindows, 4, 1);
  const std::string message = message_of([&] { validate(calibration, folds, 0.01, 100, 1); });
  EXPECT_THAT(message, HasSubstr("are in the training and in the test"));
  EXPECT_THAT(message, HasSubstr("accuracy would be too high"));
  EXPECT_THAT(message, HasSubstr("split by sessions or by blocks"));
}

TEST_F(Split, BySessionsAndByBlocksTestsEachWindowOnce) {
  const Calibration calibration = sessions(small(), 1, 3);
  for (const SplitBy by : {SplitBy::kSessions, SplitBy::kBlocks}) {
    const auto folds = split(calibration, by, 4, 1);
    check_split(calibration, folds);
    std::vector<int> tested(calibration.windows.size());
    for (const Fold& fold : folds) {
      EXPECT_EQ(fold.test.size() + fold.training.size(), calibration.windows.size());
      for (const std::size_t w : fold.test) ++tested[w];
    }
    EXPECT_THAT(tested, testing::Each(1));
  }
}

TEST_F(Split, NeedsEnoughSessionsOrBlocks) {
  const Calibration calibration = sessions(small(), 1, 1);
  EXPECT_THAT(message_of([&] { split(calibration, SplitBy::kSessions, 0, 1); }),
              HasSubstr("by sessions needs at least 2"));
  EXPECT_THAT(message_of([&] { split(calibration, SplitBy::kBlocks, 9, 1); }),
              HasSubstr("blocks of each state needs at least 9"));
}

TEST_F(Split, ACopyOfASessionIsRefused) {
  Calibration calibration;
  Recording recording = generate(small());
  recording.origin = "a.edf";
  add_session(calibration, recording);
  recording.origin = "copy.edf";
  EXPECT_THAT(message_of([&] { add_session(calibration, recording); }),
              HasSubstr("copy.edf: has the same samples as a.edf"));
}

TEST_F(Split, AModelIsNotTestedWithItsTrainingData) {
  const Calibration calibration = sessions(small(), 1, 1);
  const Model model = train(calibration, 0.01);
  EXPECT_THAT(message_of([&] { validate(model, calibration, 100, 1); }),
              HasSubstr("session 1: the model was trained with this recording; test it with another session"));
}

TEST_F(Split, ARecordingOfTheTrainingIsRefusedWithOtherBlocks) {
  Recording recording = generate(small());
  Calibration training, test;
  add_session(training, recording);
  const Model model = train(training, 0.01);
  for (Annotation& one : recording.annotations) one.onset_s += 1;
  add_session(test, recording);
  for (const CalibrationBlock& block : test.blocks)
    EXPECT_THAT(model.trained_blocks, testing::Not(testing::Contains(block.fingerprint))) << "the blocks must differ";
  EXPECT_THAT(message_of([&] { validate(model, test, 100, 1); }), HasSubstr("was trained with this recording"));
  // A recording that occurs twice in one calibration must be detected as a copy, even if its blocks differ.
  EXPECT_THAT(message_of([&] { add_session(training, recording); }), HasSubstr("has the same samples as"));
}

TEST_F(Split, APieceOfATrainingRecordingIsRefusedByItsBlocks) {
  Recording recording = generate(small());
  Calibration training, test;
  add_session(training, recording);
  for (std::vector<double>& channel : recording.samples_uv) channel.push_back(0);
  recording.annotations.back().duration_s = 12.0;
  add_session(test, recording);
  EXPECT_THAT(message_of([&] { validate(train(training, 0.01), test, 100, 1); }),
              HasSubstr("the model was trained with block"));
}

TEST(SplitByBlocks, BlocksWithoutWindowsGetNoFold) {
  // Twelve blocks of alternating state. In the first eight blocks, all windows have artefacts and are therefore left
  // out.
  Calibration calibration;
  calibration.sessions = {"a.edf"};
  for (std::size_t b = 0; b < 12; ++b) {
    const bool is_positive = b % 2 == 0;
    calibration.blocks.push_back({0, is_positive, std::to_string(b)});
    if (b >= 8) calibration.windows.push_back({{}, is_positive, b});
  }
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const Fold& fold : split(calibration, SplitBy::kBlocks, 2, seed)) {
      std::multiset<bool> states;
      for (const std::size_t w : fold.test) states.insert(calibration.windows[w].is_positive);
      EXPECT_EQ(states, (std::multiset<bool>{false, true})) << "each fold tests both states, seed " << seed;
    }
  }
  EXPECT_THAT(message_of([&] { split(calibration, SplitBy::kBlocks, 3, 1); }),
              HasSubstr("needs at least 3 of them, and there are 2"));
}

TEST(Labels, ABlockLastsItsDurationOrUntilTheNextLabel) {
  Recording recording = silence(100);
  recording.annotations = {
      {50, std::nullopt, "positive"}, {10, 20.0, "negative"}, {70, std::nullopt, "negative"}, {12, {}, "blink"}};
  const auto blocks = blocks_of(recording, {});
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_EQ(blocks[0].begin_s, 10);
  EXPECT_EQ(blocks[0].end_s, 30);
  EXPECT_EQ(blocks[1].end_s, 70);
  EXPECT_TRUE(blocks[1].is_positive);
  EXPECT_EQ(blocks[2].end_s, 100);
}

TEST(Labels, TrialsOfOneStateThatFollowEachOtherAreOneBlock) {
  Recording recording = silence(100);
  recording.annotations = {
      {0, 10.0, "positive"}, {10, 10.0, "positive"}, {20, 10.0, "negative"}, {40, 10.0, "negative"}};
  const auto blocks = blocks_of(recording, {});
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_EQ(blocks[0].end_s, 20);
}

TEST(Labels, MistakesAreNamed) {
  Recording recording = silence(100);
  EXPECT_THAT(message_of([&] { blocks_of(recording, {}); }),
              HasSubstr("quiet.edf: no annotation is 'negative' or 'positive'"));
  recording.annotations = {{0, 30.0, "positive"}, {10, 10.0, "negative"}};
  EXPECT_THAT(message_of([&] { blocks_of(recording, {}); }), HasSubstr("labels overlap at 10 s"));
  EXPECT_THAT(message_of([&] { blocks_of(recording, {"x", "x"}); }), HasSubstr("both labels are 'x'"));
}

TEST(Windows, EachLiesInOneBlockAndArtefactsAreCounted) {
  GeneratorSettings settings;
  settings.channels = {"F3", "F4", "O1", "O2"};
  settings.blinks_per_min = 6;
  settings.bad_contacts_per_hour = 60;
  settings.blocks = 60;
  const Recording recording = generate(settings);
  Calibration calibration;
  add_session(calibration, recording);
  // Counts the windows that contain a whole blink or at least 3 s of bad contact, according to the annotations.
  std::size_t hit = 0;
  for (std::size_t w = 0; w < 300; ++w) {
    const double begin_s = 4.0 * static_cast<double>(w), end_s = begin_s + 4;
    const bool is_hit = std::ranges::any_of(recording.annotations, [&](const Annotation& one) {
      const bool is_blink = one.text == "blink";
      if (!is_blink && !one.text.starts_with("bad contact")) return false;
      const double inside = std::min(end_s, one.onset_s + *one.duration_s) - std::max(begin_s, one.onset_s);
      return inside >= (is_blink ? *one.duration_s - 1e-9 : 3.0);
    });
    hit += is_hit ? 1U : 0U;
  }
  const ArtefactCount& count = calibration.artefacts.front();
  EXPECT_GT(hit, 50U);
  EXPECT_EQ(count.windows(), 300U);
  EXPECT_EQ(count.windows() - count.flagged(), calibration.windows.size()) << "none is lost without being counted";
  EXPECT_GE(count.flagged(), hit);
  EXPECT_LE(count.flagged(), 2 * hit) << "windows at the edge of an artefact, and few others";
  EXPECT_THAT(count.text(), HasSubstr("of them with artefacts and not used"));
}

TEST(Windows, WithoutArtefactsAreNotFlagged) {
  GeneratorSettings settings;
  settings.blocks = 40;
  Calibration calibration;
  add_session(calibration, generate(settings));
  EXPECT_LE(calibration.artefacts.front().flagged(), 2U) << calibration.artefacts.front().text();
}

TEST(Sigmoid, RecoversALogisticModel) {
  Random random(test::test_seed(9));
  std::vector<std::pair<double, bool>> decisions;
  for (int i = 0; i < 20'000; ++i) {
    const double f = random.normal();
    decisions.emplace_back(f, random.uniform() < 1 / (1 + std::exp(-(2 * f + 0.5))));
  }
  const Sigmoid fitted = fit_sigmoid(decisions);
  EXPECT_NEAR(fitted.slope, 2, 0.1);
  EXPECT_NEAR(fitted.offset, 0.5, 0.1);
}

TEST(Sigmoid, IsFiniteForDataThatIsSeparableOrReversed) {
  std::vector<std::pair<double, bool>> separable, reversed;
  for (int i = -50; i < 50; ++i) {
    separable.emplace_back(i + 0.5, i >= 0);
    reversed.emplace_back(i + 0.5, i < 0);
  }
  EXPECT_GT(fit_sigmoid(separable).slope, 0);
  EXPECT_TRUE(std::isfinite(fit_sigmoid(separable).slope));
  EXPECT_EQ(fit_sigmoid(reversed).slope, 0) << "reversed decisions must give slope 0";
}

class ModelFile : public testing::Test {
 protected:
  ModelFile() : file_(std::filesystem::temp_directory_path() / ("model_" + std::to_string(::getpid()) + ".json")) {
    GeneratorSettings settings;
    settings.channels = {"F3", "O1"};
    settings.blocks = 8;
    calibration_ = sessions(settings, 1, 1);
    model_ = train(calibration_, kDefaultPenalty);
    save_model(model_, file_);
    std::ifstream in(file_);
    std::ostringstream text;
    text << in.rdbuf();
    json_ = boost::json::parse(text.str());
  }
  ~ModelFile() override { std::filesystem::remove(file_); }

  std::string refusal_of(const boost::json::value& json) {
    std::ofstream(file_) << boost::json::serialize(json);
    return message_of([&] { load_model(file_); });
  }

  std::filesystem::path file_;
  Calibration calibration_;
  Model model_;
  boost::json::value json_;
};

TEST_F(ModelFile, DecidesAsTheModelThatWasSaved) {
  const Model loaded = load_model(file_);
  // The tolerance is not 0, because Boost.JSON 1.81 parses numbers with an error of up to one unit in the last place.
  for (const LabelledWindow& one : calibration_.windows)
    EXPECT_NEAR(loaded.valence(one.features).value, model_.valence(one.features).value, 1e-12);
  EXPECT_EQ(loaded.format.channels, model_.format.channels);
  EXPECT_EQ(loaded.trained_blocks, model_.trained_blocks);
  EXPECT_EQ(loaded.trained_sessions, model_.trained_sessions);
}

TEST_F(ModelFile, EachWrongFieldIsNamed) {
  const std::pair<const char*, boost::json::value> cases[] = {{"format", "other"},
                                                              {"version", 1},
                                                              {"channels", boost::json::array{}},
                                                              {"rate_hz", 0},
                                                              {"window", 3},
                                                              {"window", 1e9},
                                                              {"low_hz", -1},
                                                              {"high_hz", 1e9},
                                                              {"features", {"mean"}},
                                                              {"mean", {1, 2}},
                                                              {"weights", "x"},
                                                              {"slope", -1},
                                                              {"scale", {nullptr}},
                                                              {"trained_blocks", 1},
                                                              {"artefact_limits", 1},
                                                              {"unknown", 1},
                                                              {"trained_sessions", boost::json::array{}}};
  for (const auto& [name, value] : cases) {
    boost::json::value json = json_;
    json.as_object()[name] = value;
    const std::string message = refusal_of(json);
    EXPECT_NE(message, "") << name;
    // For an impossible filter or window, the message states its values instead of the name of the field.
    EXPECT_THAT(message, testing::AnyOf(HasSubstr(name), HasSubstr("a band of"), HasSubstr("a window of")));
  }
  EXPECT_EQ(refusal_of(json_), "");
}

TEST_F(ModelFile, AnotherHeadsetIsRefused) {
  EXPECT_THAT(message_of([&] {
                check_source(model_, {{"O1", "F3"}, 128, {}}, "x.edf");
              }),
              HasSubstr("x.edf: channels are O1,F3, and the model was trained with F3,O1"));
  EXPECT_THAT(message_of([&] { check_source(model_, {{"F3", "O1"}, 256, {}}, "x.edf"); }), HasSubstr("rate is 256"));
}

/// Stores the reports of a signal.
struct Reports final : SignalSink {
  void send(const SignalReport& report) override { all.push_back(report); }
  std::vector<SignalReport> all;
};

TEST_F(ModelFile, ASignalAgesWhileItsWindowsHaveArtefacts) {
  Recording recording = silence(20);
  Random random(1);
  recording.format = model_.format;
  recording.samples_uv.assign(2, std::vector<double>(128 * 20));
  for (std::size_t n = 0; n < recording.length(); ++n) {
    // After 8 s (sample 1024), one electrode has no contact: its signal is 0.
    for (std::size_t i = 0; i < 2; ++i) recording.samples_uv[i][n] = n >= 1024 && i == 1 ? 0 : 10 * random.normal();
  }
  ValenceSignal signal(model_, recording.format, "test");
  Reports reports;
  for (std::size_t n = 0; n < recording.length(); ++n) {
    const LocalTime now{from_seconds(static_cast<double>(n + 1) / 128)};
    signal.append(std::vector{recording.samples_uv[0][n], recording.samples_uv[1][n]}, now);
    if (n % 128 == 127) reports.send(signal.report(now));
  }
  EXPECT_FALSE(reports.all[2].value) << "the first window is not complete";
  ASSERT_TRUE(reports.all[3].value);
  EXPECT_EQ(reports.all[3].age, Duration{0});
  EXPECT_EQ(reports.all[8].value, reports.all[7].value);
  EXPECT_NEAR(to_seconds(reports.all[19].age), 12, 1e-6);
  EXPECT_THAT(reports.all[19].artefacts, HasSubstr("O1 flat"));
}

TEST_F(ModelFile, TheSamplesOfAReadHaveTheirOwnTimes) {
  // One call delivers 612 samples. The window of 512 samples therefore ends 100 samples before the end of the call.
  Random random(1);
  std::vector<double> frames_uv;
  for (std::size_t i = 0; i < 2 * 612; ++i) frames_uv.push_back(10 * random.normal());
  ValenceSignal signal(model_, model_.format, "test");
  const LocalTime end{std::chrono::seconds(7)};
  signal.append_all(frames_uv, end);
  ASSERT_TRUE(signal.report(end).value);
  EXPECT_NEAR(to_seconds(signal.report(end).age), 100 / model_.format.rate_hz, 1e-6);
}

TEST(JsonLine, HasTheValueItsConfidenceAndItsAge) {
  std::ostringstream out;
  JsonLineSink sink(out);
  sink.send({.name = "valence",
             .time = LocalTime(std::chrono::seconds(3)),
             .value = {},
             .confidence = 0,
             .age = {},
             .artefacts = "F7 flat"});
  sink.send({.name = "valence",
             .time = LocalTime(std::chrono::seconds(4)),
             .value = -0.5,
             .confidence = 0.75,
             .age = std::chrono::milliseconds(250),
             .artefacts = ""});
  std::istringstream in(out.str());
  std::string line;
  std::getline(in, line);
  const auto first = boost::json::parse(line).as_object();
  EXPECT_TRUE(first.at("value").is_null() && first.at("age_s").is_null());
  EXPECT_EQ(first.at("artefacts").as_string(), "F7 flat");
  std::getline(in, line);
  const auto second = boost::json::parse(line).as_object();
  EXPECT_EQ(second.at("value").as_double(), -0.5);
  EXPECT_EQ(second.at("confidence").as_double(), 0.75);
  EXPECT_EQ(second.at("age_s").as_double(), 0.25);
  EXPECT_FALSE(second.contains("artefacts"));
}

}  // namespace
}  // namespace tandem::eeg
