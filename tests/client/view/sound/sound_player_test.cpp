// Tests the sound player with a sink that stores the samples that it receives. The tests wait for states, never for a
// fixed time, so that they do not depend on the speed of the machine.
#include "client/view/sound/sound_player.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <iterator>
#include <mutex>
#include <thread>
#include <vector>

namespace tandem::client {
namespace {

constexpr auto kPatience = std::chrono::seconds(60);

/// State of a fake sink, and the samples that it has received. The record exists longer than the sink.
class Record {
 public:
  void add(std::span<const std::int16_t> samples) {
    const std::lock_guard lock(mutex_);
    samples_.insert(samples_.end(), samples.begin(), samples.end());
    changed_.notify_all();
  }
  void set(bool& flag) {
    const std::lock_guard lock(mutex_);
    flag = true;
    changed_.notify_all();
  }
  /// Waits until the condition holds, or until kPatience has passed. Returns whether it holds.
  bool wait(const std::function<bool(const Record&)>& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return condition(*this); });
  }
  bool holds(std::span<const std::int16_t> part) const { return !std::ranges::search(samples_, part).empty(); }
  bool is_empty() const { return samples_.empty(); }

  void count_open() {
    const std::lock_guard lock(mutex_);
    ++opened;
    is_opening = true;
    changed_.notify_all();
  }

  int opened = 0;  ///< calls of open()
  bool is_opening = false, is_closed = false, is_gone = false, is_released = false;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::int16_t> samples_;
};

struct Behaviour {
  bool has_device = true;
  bool blocks_open = false;  ///< true: open() returns only after the test has released the record
  bool is_full = false;      ///< true: write() accepts no samples
  bool is_lost = false;      ///< true: write() fails
};

class FakeSink : public SoundSink {
 public:
  FakeSink(std::shared_ptr<Record> record, Behaviour behaviour) : record_(std::move(record)), behaviour_(behaviour) {}
  ~FakeSink() override { record_->set(record_->is_gone); }
  bool open() override {
    record_->count_open();
    if (behaviour_.blocks_open) record_->wait([](const Record& record) { return record.is_released; });
    return behaviour_.has_device;
  }
  std::ptrdiff_t write(std::span<const std::int16_t> samples) override {
    if (behaviour_.is_lost) return -1;
    if (behaviour_.is_full) return 0;
    const auto part = samples.first(std::min<std::size_t>(480, samples.size()));
    record_->add(part);
    return static_cast<std::ptrdiff_t>(part.size());
  }
  void close() override { record_->set(record_->is_closed); }

 private:
  std::shared_ptr<Record> record_;
  Behaviour behaviour_;
};

class SoundPlayerTest : public testing::Test {
 protected:
  std::unique_ptr<SoundSink> sink(Behaviour behaviour = {}) const {
    return std::make_unique<FakeSink>(record_, behaviour);
  }
  LocalTime now() const { return clock_.now(); }

  SteadyClock clock_;
  std::shared_ptr<Record> record_ = std::make_shared<Record>();
};

TEST_F(SoundPlayerTest, PlaysWhatIsQueuedInOrder) {
  const auto contact = samples_of(Sound::kContact, 0.5), goal = samples_of(Sound::kGoal, 1);
  SoundPlayer player(sink());
  // A busy machine may start the thread late. The time stamp of the event is therefore in the future, so that the
  // player does not discard the event as late.
  const LocalTime at = now() + kPatience;
  EXPECT_TRUE(player.play(Sound::kContact, 0.5, at));
  EXPECT_TRUE(player.play(Sound::kGoal, 1, at));
  EXPECT_TRUE(record_->wait([&](const Record& record) { return record.holds(contact) && record.holds(goal); }));
}

TEST_F(SoundPlayerTest, ALateSoundIsDiscarded) {
  const auto late = samples_of(Sound::kFailure, 1), next = samples_of(Sound::kGrasp, 1);
  SoundPlayer player(sink());
  EXPECT_TRUE(player.play(Sound::kFailure, 1, now() - 2 * SoundPlayer::kMaxAge));
  EXPECT_TRUE(player.play(Sound::kGrasp, 1, now() + kPatience));
  EXPECT_TRUE(record_->wait([&](const Record& record) { return record.holds(next); }));
  EXPECT_FALSE(record_->holds(late));
}

TEST_F(SoundPlayerTest, AFullQueueRefusesSoundsAndDoesNotWait) {
  SoundPlayer player(sink({.blocks_open = true}));
  player.play(Sound::kContact, 1, now() + kPatience);
  ASSERT_TRUE(record_->wait([](const Record& record) { return record.is_opening; }));
  int accepted = 0;
  for (int i = 0; i < 1000; ++i) accepted += player.play(Sound::kContact, 1, now()) ? 1 : 0;
  EXPECT_EQ(accepted, static_cast<int>(SoundPlayer::kMaxQueued));
  record_->set(record_->is_released);
}

TEST_F(SoundPlayerTest, WithoutADeviceNothingIsPlayedAndNothingMoreIsQueued) {
  SoundPlayer player(sink({.has_device = false}));
  EXPECT_TRUE(player.play(Sound::kContact, 1, now() + kPatience));
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (player.play(Sound::kContact, 1, now()) && std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(player.play(Sound::kContact, 1, now()));
  EXPECT_TRUE(record_->is_empty());
}

TEST_F(SoundPlayerTest, ALostDeviceIsClosedAndOpenedAgain) {
  SoundPlayer player(sink({.is_lost = true}));
  player.play(Sound::kContact, 1, now() + kPatience);
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.is_closed; }));
  EXPECT_TRUE(player.play(Sound::kContact, 1, now() + kPatience));
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.opened == 2; }));
}

TEST_F(SoundPlayerTest, SilenceFollowsTheLastSoundAndDelaysNoOther) {
  std::vector<std::int16_t> expected = samples_of(Sound::kContact, 1);
  std::ranges::copy(samples_of(Sound::kGoal, 1), std::back_inserter(expected));
  expected.resize(expected.size() + static_cast<std::size_t>(0.1 * kSampleRate_hz));
  SoundPlayer player(sink({.blocks_open = true}));
  player.play(Sound::kContact, 1, now() + kPatience);
  ASSERT_TRUE(record_->wait([](const Record& record) { return record.is_opening; }));
  player.play(Sound::kGoal, 1, now() + kPatience);
  record_->set(record_->is_released);
  EXPECT_TRUE(record_->wait([&](const Record& record) { return record.holds(expected); }));
}

TEST_F(SoundPlayerTest, ADeviceWithoutRoomIsGivenUp) {
  SoundPlayer player(sink({.is_full = true}));
  player.play(Sound::kContact, 1, now() + kPatience);
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.is_closed; }));
}

TEST_F(SoundPlayerTest, AnIdleDeviceIsReleased) {
  const auto contact = samples_of(Sound::kContact, 1);
  SoundPlayer player(sink());
  player.play(Sound::kContact, 1, now() + kPatience);
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.is_closed; }));
  EXPECT_TRUE(record_->holds(contact));
}

TEST_F(SoundPlayerTest, EndsWhileASoundIsPlayed) {
  {
    SoundPlayer player(sink({.is_full = true}));
    player.play(Sound::kContact, 1, now() + kPatience);
    ASSERT_TRUE(record_->wait([](const Record& record) { return record.is_opening; }));
  }
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.is_gone; }));
}

TEST_F(SoundPlayerTest, EndsWhileTheSoundSystemHoldsTheThread) {
  {
    SoundPlayer player(sink({.blocks_open = true}));
    player.play(Sound::kContact, 1, now() + kPatience);
    ASSERT_TRUE(record_->wait([](const Record& record) { return record.is_opening; }));
  }
  EXPECT_FALSE(record_->is_gone) << "the thread still uses the sink";
  record_->set(record_->is_released);
  EXPECT_TRUE(record_->wait([](const Record& record) { return record.is_gone; }));
}

}  // namespace
}  // namespace tandem::client
