// A session that fetches assets, and a simulated server that sends them.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/session/asset_store.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {

inline wire::Joined joined_with_asset(const std::string& bytes) {
  wire::Joined joined = test::minimal_joined();
  const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(bytes)));
  wire::AssetInfo& info = *joined.add_assets();
  info.set_sha256(hash.data(), hash.size());
  info.set_size_bytes(bytes.size());
  info.set_kind("contact");
  info.set_name("thing.obj");
  return joined;
}

inline SessionSettings fetching(const std::string& kind) {
  SessionSettings settings;
  settings.asset_kinds = {kind};
  settings.silence_timeout = std::chrono::minutes(1);  // the simulated server sends no states
  return settings;
}

inline wire::ServerControl answer_to(const wire::ClientControl& request, const std::string& bytes) {
  wire::ServerControl answer;
  answer.set_request(request.request());
  wire::AssetChunk& chunk = *answer.mutable_asset_chunk();
  chunk.set_sha256(request.get_asset().sha256());
  chunk.set_offset(request.get_asset().offset());
  chunk.set_total_bytes(bytes.size());
  chunk.set_data(bytes.substr(request.get_asset().offset(), request.get_asset().max_bytes()));
  return answer;
}

/// Answers each asset request with the content of the requested hash, or with the first content if no hash matches.
/// Ends when no request has arrived for 100 polls. Returns the number of bytes sent.
inline std::size_t serve_assets(test::SessionBench& bench, const std::vector<std::string>& contents) {
  std::size_t served = 0;
  for (int idle = 0; idle < 100; ++idle) {
    const auto requests = std::exchange(bench.transport.messages, {});
    for (const wire::ClientControl& request : requests) {
      if (!request.has_get_asset()) continue;
      const auto is_it = [&request](const std::string& bytes) {
        const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(bytes)));
        return request.get_asset().sha256() == std::string(reinterpret_cast<const char*>(hash.data()), hash.size());
      };
      const auto found = std::ranges::find_if(contents, is_it);
      const wire::ServerControl answer = answer_to(request, found == contents.end() ? contents.front() : *found);
      served += answer.asset_chunk().data().size();
      bench.deliver(answer);
      idle = 0;
    }
    bench.wait(std::chrono::milliseconds(1));
  }
  return served;
}

inline std::size_t serve_assets(test::SessionBench& bench, const std::string& bytes) {
  return serve_assets(bench, std::vector{bytes});
}

inline void join(test::SessionBench& bench, const wire::Joined& joined) {
  bench.session.on_connected(bench.now);
  bench.deliver_welcome();
  bench.transport.messages.clear();
  bench.deliver_joined(joined);
}

inline void lose_the_connection_and_join_again(test::SessionBench& bench, const wire::Joined& joined) {
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(250));
  join(bench, joined);
}

/// A session that joins a scene with one asset. It looks up the asset in the store before it sends a request to the
/// server.
struct StoreBench {
  explicit StoreBench(std::shared_ptr<AssetStore> store, const wire::Joined& joined)
      : bench([&store] {
          SessionSettings settings = fetching("contact");
          settings.asset_store = std::move(store);
          return settings;
        }()) {
    bench.session.on_assets = [this] { ++announced; };
    join(bench, joined);
  }

  test::SessionBench bench;
  int announced = 0;
};

}  // namespace tandem::client
