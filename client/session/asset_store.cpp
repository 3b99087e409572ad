#include "client/session/asset_store.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <fstream>
#include <mutex>
#include <span>
#include <stop_token>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/folders.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExtension = ".asset";

struct Entry {
  fs::file_time_type used;
  std::uint64_t bytes = 0;
  fs::path file;
};

std::vector<Entry> entries_in(const fs::path& directory) {
  std::vector<Entry> entries;
  std::error_code error;
  for (fs::directory_iterator item(directory, error), end; !error && item != end; item.increment(error)) {
    if (item->path().extension() != kExtension) continue;
    std::error_code problem;
    const std::uint64_t bytes = item->file_size(problem);
    const auto used = problem ? fs::file_time_type{} : item->last_write_time(problem);
    if (!problem) entries.push_back({used, bytes, item->path()});
  }
  return entries;
}

std::future<FoundAsset> answered(FoundAsset found) {
  std::promise<FoundAsset> promise;
  promise.set_value(std::move(found));
  return promise.get_future();
}

class MemoryAssetStore final : public AssetStore {
 public:
  std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t size_bytes) override {
    const auto found = assets_.find(hash);
    const bool is_here = found != assets_.end() && found->second->size() == size_bytes;
    return answered(is_here ? found->second : nullptr);
  }
  void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) override {
    assets_[hash] = bytes;
  }

 private:
  AssetMap assets_;
};

class DiskAssetStore final : public AssetStore {
 public:
  DiskAssetStore(fs::path directory, std::uint64_t limit_bytes, ReadAsset read)
      : directory_(std::move(directory)),
        limit_bytes_(limit_bytes),
        read_(std::move(read)),
        worker_([this](const std::stop_token& stop) {
          realtime::drop_realtime();
          work_until(stop);
        }) {}

  std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t size_bytes) override;
  void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) override;

 private:
  using Kept = std::pair<proto::Sha256, std::shared_ptr<const proto::Bytes>>;
  struct Lookup {
    proto::Sha256 hash{};
    std::uint64_t size_bytes = 0;
    std::promise<FoundAsset> answer{};
  };

  void work_until(const std::stop_token& stop);
  FoundAsset read(const Lookup& wanted) const noexcept;
  fs::path file_of(const proto::Sha256& hash) const;
  void make_room_for(std::uint64_t bytes) const;

  fs::path directory_;
  std::uint64_t limit_bytes_;
  ReadAsset read_;
  std::mutex mutex_;  // protects lookups_ and waiting_; not locked during disk access
  std::condition_variable_any news_;
  std::deque<Lookup> lookups_;
  std::deque<Kept> waiting_;  ///< assets that are still to be written to files
  std::jthread worker_;       ///< last member: starts after, and ends before, the members that it uses
};

fs::path DiskAssetStore::file_of(const proto::Sha256& hash) const {
  return directory_ / (proto::hex(hash) + kExtension);
}

std::future<FoundAsset> DiskAssetStore::find(const proto::Sha256& hash, std::uint64_t size_bytes) {
  const std::scoped_lock lock(mutex_);
  const auto waits = std::ranges::find(waiting_, hash, &Kept::first);
  if (waits != waiting_.end()) return answered(waits->second->size() == size_bytes ? waits->second : nullptr);
  if (size_bytes > limit_bytes_) return answered(nullptr);
  lookups_.push_back({hash, size_bytes});
  news_.notify_one();
  return lookups_.back().answer.get_future();
}

FoundAsset DiskAssetStore::read(const Lookup& wanted) const noexcept try {
  const fs::path file = file_of(wanted.hash);
  std::error_code error;
  // Only regular files are read, because reading a named pipe would block this thread forever.
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) != wanted.size_bytes || error) return nullptr;
  auto bytes = read_(file);
  if (!bytes || bytes->size() != wanted.size_bytes || proto::sha256_of(*bytes) != wanted.hash) {
    fs::remove(file, error);
    return nullptr;
  }
  // Marks the file as recently used by its time stamp. make_room_for() removes the least recently used files.
  fs::last_write_time(file, fs::file_time_type::clock::now(), error);
  return std::make_shared<const proto::Bytes>(std::move(*bytes));
} catch (const std::exception&) {
  return nullptr;  // the memory may not suffice for the file; the asset is then fetched from the server
}

void DiskAssetStore::keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) {
  if (bytes->size() > limit_bytes_) return;
  {
    const std::scoped_lock lock(mutex_);
    waiting_.emplace_back(hash, bytes);
  }
  news_.notify_one();
}

/// Loop of the worker thread. All disk access is on this thread, because the force must not wait for a disk. When
/// stopped, the loop drops the pending look-ups but writes the pending files.
void DiskAssetStore::work_until(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (news_.wait(lock, stop, [this] { return !waiting_.empty() || !lookups_.empty(); })) {
    if (stop.stop_requested()) lookups_.clear();
    if (!lookups_.empty()) {
      Lookup next = std::move(lookups_.front());
      lookups_.pop_front();
      lock.unlock();
      next.answer.set_value(read(next));
      lock.lock();
    } else if (!waiting_.empty()) {
      const Kept next = waiting_.front();
      lock.unlock();
      make_room_for(next.second->size());
      replace_cache_file(file_of(next.first), {std::span<const std::byte>(*next.second)});
      lock.lock();
      waiting_.pop_front();
    }
  }
}

void DiskAssetStore::make_room_for(std::uint64_t bytes) const {
  std::vector<Entry> entries = entries_in(directory_);
  std::ranges::sort(entries, {}, &Entry::used);
  std::uint64_t total = bytes;
  for (const Entry& entry : entries) total += entry.bytes;
  for (const Entry& entry : entries) {
    if (total <= limit_bytes_) return;
    std::error_code error;
    fs::remove(entry.file, error);
    total -= entry.bytes;
  }
}

}  // namespace

std::shared_ptr<AssetStore> memory_asset_store() {
  return std::make_shared<MemoryAssetStore>();
}

std::optional<proto::Bytes> read_asset_file(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return std::nullopt;
  proto::Bytes bytes(static_cast<std::size_t>(size));
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  return stream ? std::optional(std::move(bytes)) : std::nullopt;
}

std::shared_ptr<AssetStore> disk_asset_store(fs::path directory, std::uint64_t limit_bytes, ReadAsset read) {
  return std::make_shared<DiskAssetStore>(std::move(directory), limit_bytes, std::move(read));
}

}  // namespace tandem::client
