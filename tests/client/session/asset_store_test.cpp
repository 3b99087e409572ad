// Tests the asset store on disk. Lookups run on a separate thread while the session continues.
#include "client/session/asset_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <random>
#include <set>
#include <span>
#include <thread>

#include "client/session/asset_fetcher.hpp"
#include "tests/client/session/assets_bench.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

class DiskStore : public ::testing::Test {
 protected:
  DiskStore() : directory_(std::filesystem::temp_directory_path() / ("tandem_store_" + std::to_string(getpid()))) {
    std::filesystem::remove_all(directory_);
  }
  ~DiskStore() override { std::filesystem::remove_all(directory_); }

  static std::shared_ptr<const proto::Bytes> bytes_of(char letter, std::size_t count) {
    return std::make_shared<const proto::Bytes>(count, static_cast<std::byte>(letter));
  }
  static FoundAsset found_in(AssetStore& store, const proto::Sha256& hash, std::uint64_t size) {
    return store.find(hash, size).get();
  }
  std::filesystem::path only_file() const { return std::filesystem::directory_iterator(directory_)->path(); }

  std::filesystem::path directory_;
};

TEST_F(DiskStore, ReturnsAssetsThatAnotherProgramStored) {
  const auto bytes = bytes_of('a', 1000);
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  EXPECT_EQ(found_in(*disk_asset_store(directory_), hash, 1000), nullptr);
  disk_asset_store(directory_)->keep(hash, bytes);
  EXPECT_EQ(found_in(*disk_asset_store(directory_), hash, 999), nullptr) << "another size is another asset";
  const auto found = found_in(*disk_asset_store(directory_), hash, 1000);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(*found, *bytes);
}

TEST_F(DiskStore, AStoredAssetIsAvailableAtOnceEvenBeforeItIsWritten) {
  const auto store = disk_asset_store(directory_);
  for (char letter = 'a'; letter <= 'z'; ++letter) {
    const auto bytes = bytes_of(letter, 100'000);
    const proto::Sha256 hash = proto::sha256_of(*bytes);
    store->keep(hash, bytes);
    const auto found = found_in(*store, hash, 100'000);
    ASSERT_NE(found, nullptr) << letter;
    EXPECT_EQ(*found, *bytes);
  }
}

TEST_F(DiskStore, NeverGivesBytesOfAnotherHashAndRemovesThem) {
  const auto bytes = bytes_of('a', 1000);
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  disk_asset_store(directory_)->keep(hash, bytes);
  const auto store = disk_asset_store(directory_);
  std::fstream(only_file(), std::ios::binary | std::ios::in | std::ios::out).seekp(500).put('b');
  EXPECT_EQ(found_in(*store, hash, 1000), nullptr);
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(DiskStore, StaysWithinItsLimitByRemovingTheLeastRecentlyUsedFiles) {
  // Opens the store for one statement. At the end of the statement, the store is destroyed and has written its files,
  // as at the end of a program.
  const auto store = [this] { return disk_asset_store(directory_, 2500); };
  std::vector<proto::Sha256> hashes;
  for (const char letter : {'a', 'b', 'c'}) {
    const auto bytes = bytes_of(letter, 1000);
    hashes.push_back(proto::sha256_of(*bytes));
    store()->keep(hashes.back(), bytes);
    // The file times decide which file is the oldest. They are set explicitly, because the clock of a file system may
    // have a low resolution.
    const auto hours = std::chrono::hours(letter == 'a' ? 1 : 2);
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      if (letter == 'c') continue;
      std::filesystem::last_write_time(entry, std::filesystem::file_time_type::clock::now() - hours);
    }
    if (letter != 'b') continue;
    EXPECT_NE(found_in(*store(), hashes[0], 1000), nullptr) << "used now, so b is the oldest";
  }
  EXPECT_NE(found_in(*store(), hashes[0], 1000), nullptr);
  EXPECT_EQ(found_in(*store(), hashes[1], 1000), nullptr);
  EXPECT_NE(found_in(*store(), hashes[2], 1000), nullptr);
  const auto huge = bytes_of('d', 3000);
  store()->keep(proto::sha256_of(*huge), huge);
  EXPECT_EQ(found_in(*store(), proto::sha256_of(*huge), 3000), nullptr);
  EXPECT_NE(found_in(*store(), hashes[0], 1000), nullptr) << "an asset that is too large must not evict others";
}

/// Blocks the reading of a file until open() is called.
struct Gate {
  void open() {
    const std::scoped_lock lock(mutex);
    is_open = true;
    news.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex);
    reader = std::this_thread::get_id();
    ++reads;
    news.wait(lock, [this] { return is_open; });
  }

  std::mutex mutex;
  std::condition_variable news;
  bool is_open = false;
  int reads = 0;
  std::thread::id reader;
};

TEST_F(DiskStore, IsReadByASeparateThreadWhileTheIoThreadContinues) {
  const std::string content(150'000, 'v');
  const auto bytes = bytes_of('v', content.size());
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  disk_asset_store(directory_)->keep(hash, bytes);
  Gate gate;
  const auto store = disk_asset_store(directory_, kDefaultAssetStoreBytes, [&gate](const std::filesystem::path& file) {
    gate.pass();
    return read_asset_file(file);
  });
  // This thread acts as the io thread of the session. If it read a file, it would wait at the closed gate forever.
  StoreBench bench(store, joined_with_asset(content));
  bench.bench.wait(AssetFetcher::kStoreTimeout / 2);
  EXPECT_EQ(bench.bench.state(), "active");
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kNone);
  EXPECT_TRUE(bench.bench.transport.messages.empty()) << "the server is queried after the store";
  store->keep(proto::sha256_of(*bytes_of('w', 10)), bytes_of('w', 10));
  gate.open();
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (bench.bench.session.asset_level() != AssetLevel::kFull && std::chrono::steady_clock::now() < give_up) {
    bench.bench.session.poll(bench.bench.now);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(bench.bench.session.assets().size(), 1U);
  EXPECT_EQ(gate.reads, 1);
  EXPECT_NE(gate.reader, std::this_thread::get_id());
  EXPECT_EQ(serve_assets(bench.bench, content), 0U);
}

/// A store in virtual time that completes lookups in order, one for each call of answer_one().
class SlowStore final : public AssetStore {
 public:
  std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t) override {
    lookups.emplace_back(hash, std::promise<FoundAsset>());
    return lookups.back().second.get_future();
  }
  void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) override {
    contents[hash] = bytes;
  }
  void answer_one() {
    if (lookups.empty()) return;
    const auto found = contents.find(lookups.front().first);
    lookups.front().second.set_value(found == contents.end() ? nullptr : found->second);
    lookups.pop_front();
  }

  AssetMap contents;
  std::deque<std::pair<proto::Sha256, std::promise<FoundAsset>>> lookups;
};

TEST(SessionAssets, AStoreThatNeverAnswersIsGivenUpAndTheServerQueried) {
  const std::string bytes(150'000, 'v');
  const auto store = std::make_shared<SlowStore>();
  StoreBench bench(store, joined_with_asset(bytes));
  bench.bench.wait(AssetFetcher::kStoreTimeout - std::chrono::milliseconds(2));
  EXPECT_TRUE(bench.bench.transport.messages.empty());
  EXPECT_EQ(serve_assets(bench.bench, bytes), bytes.size());
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, RequestsOnlyAssetsThatASlowStoreLacksForGeneratedScenes) {
  std::mt19937_64 random(test::test_seed(59));
  const auto below = [&random](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  for (int round = 0; round < 12; ++round) {
    const auto store = std::make_shared<SlowStore>();
    wire::Joined joined = test::minimal_joined();
    std::vector<std::string> contents;
    std::set<std::string> kept;
    std::size_t missing = 0;
    for (std::size_t i = 0, count = 1 + below(8); i < count; ++i) {
      contents.emplace_back(1 + below(100'000), static_cast<char>('a' + i));
      *joined.add_assets() = joined_with_asset(contents.back()).assets(0);
      const auto bytes = std::as_bytes(std::span(contents.back()));
      const bool is_kept = below(2) == 0;
      if (is_kept) {
        kept.insert(joined.assets(static_cast<int>(i)).sha256());
        store->keep(proto::sha256_of(bytes), std::make_shared<const proto::Bytes>(bytes.begin(), bytes.end()));
      } else {
        missing += contents.back().size();
      }
    }
    StoreBench bench(store, joined);
    std::size_t served = 0;
    for (int i = 0; i < 4000 && bench.bench.session.asset_level() != AssetLevel::kFull; ++i) {
      // The store answers rarely, but before its time-out.
      if (below(100) == 0 || i % 400 == 0) store->answer_one();
      for (const wire::ClientControl& request : std::exchange(bench.bench.transport.messages, {})) {
        if (!request.has_get_asset()) continue;
        const auto is_it = [&request](const std::string& bytes) {
          const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(bytes)));
          return proto::hash_from(request.get_asset().sha256()) == hash;
        };
        EXPECT_FALSE(kept.contains(request.get_asset().sha256())) << "the store has it";
        const wire::ServerControl answer = answer_to(request, *std::ranges::find_if(contents, is_it));
        served += answer.asset_chunk().data().size();
        bench.bench.deliver(answer);
      }
      bench.bench.wait(std::chrono::milliseconds(1));
      if (i % 500 == 250) lose_the_connection_and_join_again(bench.bench, joined);
    }
    EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull) << "round " << round;
    EXPECT_EQ(bench.bench.session.assets().size(), contents.size()) << "round " << round;
    EXPECT_GE(served, missing) << "round " << round;
  }
}

}  // namespace
}  // namespace tandem::client
