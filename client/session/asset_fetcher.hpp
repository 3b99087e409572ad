// Fetches the files of a scene by content hash, in pieces, and keeps only what hashes right.
#pragma once

#include <cstdint>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/asset_store.hpp"
#include "common/base/time.hpp"
#include "common/secure/content_hasher.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Memory that a server can make a client use for assets.
inline constexpr std::uint64_t kMaxAssetBytes = 256ULL * 1024 * 1024;

using AssetInfos = google::protobuf::RepeatedPtrField<wire::AssetInfo>;

/// Asks for piece after piece, as many ahead as its caller lets it, and puts together what comes. What has come of an asset
/// is kept when the connection is lost, as long as the asset is wanted.
///
/// Thread  io
class AssetFetcher {
 public:
  /// Without an answer of the store for this long, the server is queried instead: a disk may hang.
  static constexpr Duration kStoreTimeout = std::chrono::seconds(1);

  /// In      store  queried before the server; what is fetched is kept there; null: none
  explicit AssetFetcher(std::uint64_t limit_bytes = kMaxAssetBytes, std::shared_ptr<AssetStore> store = nullptr)
      : limit_bytes_(limit_bytes), store_(std::move(store)) {}

  /// Starts to look for these in the store, in their order, within the limit.
  void look_up(const AssetInfos& wanted);
  /// Takes what the store has found so far. True: it has answered all look-ups.
  bool take_found();
  /// Drops the look-ups that the store does not answer (kStoreTimeout).
  void check_store(LocalTime now);

  /// A new list to fetch from the server, in its order, without what is here already. Returns one line for each asset that is
  /// left out (bad hash, over the limit).
  std::vector<std::string> begin(const AssetInfos& wanted);
  /// The connection is another one: what was asked for is not answered any more.
  void reconnect();
  bool has(const wire::AssetInfo& info) const;

  /// The next piece to ask for, of `max_bytes` at most, as request number `request`; empty while all is asked for.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, std::size_t max_bytes);
  /// Anything was asked for and not answered.
  bool is_awaiting() const { return !awaited_.empty(); }
  /// Answers come in the order of the requests: this one's is the next.
  bool is_next(std::uint32_t request) const { return is_awaiting() && awaited_.front().request == request; }
  /// Takes the answer to a request that is_next(). The problem when it cannot be used (its asset is then given up); else
  /// empty.
  std::string on_chunk(std::uint32_t request, const wire::AssetChunk& chunk);
  /// The server refused a request that is_next(): its asset is given up.
  void on_refused(std::uint32_t request);

  /// How many of these are still to come: on the list, not here, not left out, not given up.
  std::size_t left_of(const AssetInfos& some) const;
  const AssetMap& assets() const { return assets_; }
  std::uint64_t bytes() const { return held_bytes_; }

 private:
  struct Wanted {
    wire::AssetInfo info;
    proto::Sha256 hash{};
    std::uint64_t number = 0;    ///< no other one, of the same asset neither, has it
    proto::Bytes bytes{};        ///< that have come
    std::uint64_t asked_to = 0;  ///< all before it has come or is awaited
    secure::ContentHasher hasher{};
  };
  /// A piece that was asked for and not answered.
  struct Awaited {
    std::uint32_t request = 0;
    std::uint64_t wanted = 0;  ///< Wanted::number
    std::uint64_t offset = 0;
    std::size_t bytes = 0;
  };

  /// A query of the store.
  struct Lookup {
    proto::Sha256 hash{};
    std::uint64_t size_bytes = 0;
    std::future<FoundAsset> answer;
  };

  std::vector<std::string> add(const AssetInfos& wanted);
  std::string take(Wanted& wanted, const Awaited& awaited, const wire::AssetChunk& chunk);
  std::string finish(Wanted& wanted);

  std::uint64_t limit_bytes_;
  std::shared_ptr<AssetStore> store_;
  AssetMap assets_;
  std::uint64_t held_bytes_ = 0;
  std::uint64_t last_number_ = 0;
  std::deque<Wanted> wanted_;
  std::deque<Awaited> awaited_;
  std::deque<Lookup> lookups_;
  std::optional<LocalTime> store_answered_;  ///< or began to be waited for
};

}  // namespace tandem::client
