// Tests the assets of a scene: they are fetched in chunks and stored by hash. A session looks them up in the store
// before it sends a request to the server.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <span>

#include "client/session/asset_fetcher.hpp"
#include "client/session/asset_store.hpp"
#include "common/net/fetch_rate.hpp"
#include "tests/client/session/assets_bench.hpp"

namespace tandem::client {
namespace {

TEST(SessionAssets, FetchesAnAssetOnceAndKeepsItOnlyWhenItsHashIsRight) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  test::SessionBench bench(fetching("contact"));
  join(bench, joined);
  EXPECT_EQ(serve_assets(bench, bytes), bytes.size());
  ASSERT_EQ(bench.session.assets().size(), 1U);
  EXPECT_EQ(bench.session.assets().begin()->second->size(), bytes.size());
  lose_the_connection_and_join_again(bench, joined);
  EXPECT_EQ(serve_assets(bench, bytes), 0U) << "it is here already";

  test::SessionBench cheated(fetching("contact"));
  join(cheated, joined);
  serve_assets(cheated, std::string(150'000, 'w'));
  EXPECT_TRUE(cheated.session.assets().empty());
  EXPECT_EQ(cheated.state(), "active") << "a bad file is no reason to let go of the hand";
}

TEST(SessionAssets, AsksTheStoreBeforeTheServerAndSaysOnceAJoinThatNothingMoreIsToCome) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  const auto store = memory_asset_store();
  StoreBench first(store, joined);
  EXPECT_EQ(first.announced, 0) << "it is not here yet";
  EXPECT_EQ(serve_assets(first.bench, bytes), bytes.size());
  EXPECT_EQ(first.announced, 1);
  StoreBench second(store, joined);
  EXPECT_EQ(serve_assets(second.bench, bytes), 0U);
  EXPECT_EQ(second.announced, 1);
  EXPECT_EQ(second.bench.session.assets().size(), 1U);
  StoreBench unstored(nullptr, test::minimal_joined());
  EXPECT_EQ(unstored.announced, 1) << "a scene without assets has them all";
  StoreBench cheated(nullptr, joined);
  serve_assets(cheated.bench, std::string(150'000, 'w'));
  EXPECT_EQ(cheated.announced, 1) << "the scene must be announced although an asset is damaged";
  EXPECT_TRUE(cheated.bench.session.assets().empty());
}

TEST(SessionAssets, FetchesOnlyTheRequestedKinds) {
  const std::string bytes(1000, 'v'), triangles(2000, 't');
  wire::Joined joined = joined_with_asset(bytes);
  *joined.add_assets() = joined_with_asset(triangles).assets(0);
  joined.mutable_assets(1)->set_kind("surface");
  *joined.add_assets() = joined_with_asset(std::string(3000, 'm')).assets(0);
  joined.mutable_assets(2)->set_kind("mesh");
  for (const std::string kind : {"contact", "surface"}) {
    const std::string& expected = kind == "surface" ? triangles : bytes;
    test::SessionBench bench(fetching(kind));
    join(bench, joined);
    EXPECT_EQ(serve_assets(bench, expected), expected.size());
    ASSERT_EQ(bench.session.assets().size(), 1U);
    EXPECT_EQ(bench.session.assets().begin()->second->size(), expected.size());
  }
}

TEST(SessionAssets, FetchesDrawingsAfterTactileAssetsAreAnnounced) {
  const std::string bytes(1000, 'v');
  wire::Joined joined = joined_with_asset(bytes);
  joined.mutable_assets(0)->set_kind("surface");
  SessionSettings settings = fetching("contact");
  settings.drawn_asset_kinds = {"surface"};
  test::SessionBench bench(settings);
  std::vector<std::size_t> here_when_announced;
  bench.session.on_assets = [&] { here_when_announced.push_back(bench.session.assets().size()); };
  join(bench, joined);
  EXPECT_EQ(here_when_announced, std::vector<std::size_t>{0});
  EXPECT_EQ(serve_assets(bench, bytes), bytes.size());
  EXPECT_EQ(bench.session.assets().size(), 1U);
  EXPECT_EQ(here_when_announced.size(), 1U);
}

TEST(SessionAssets, FetchesTheSmallestDrawingBeforeTactileAssetsAndTheOthersAfterwards) {
  const std::string felt(1000, 'c'), large(3000, 'd'), small(200, 'd');
  wire::Joined joined = joined_with_asset(felt);
  for (const std::string* drawing : {&large, &small}) {
    *joined.add_assets() = joined_with_asset(*drawing).assets(0);
    joined.mutable_assets(joined.assets_size() - 1)->set_kind("drawing");
    joined.mutable_assets(joined.assets_size() - 1)->set_coarse_of(std::string(32, 's'));
  }
  SessionSettings settings = fetching("contact");
  settings.drawn_asset_kinds = {"drawing"};
  test::SessionBench bench(settings);
  std::vector<std::size_t> here_when_announced;
  bench.session.on_assets = [&] { here_when_announced.push_back(bench.session.assets().size()); };
  join(bench, joined);
  EXPECT_EQ(serve_assets(bench, {felt, large, small}), felt.size() + large.size() + small.size());
  EXPECT_EQ(here_when_announced, std::vector<std::size_t>{2}) << "the small drawing and the tactile asset";
  EXPECT_EQ(bench.session.assets().size(), 3U);
}

TEST(SessionAssets, ADamagedDrawingDoesNotDelayTactileAssets) {
  const std::string felt(1000, 'c'), drawing(200, 'd');
  wire::Joined joined = joined_with_asset(felt);
  *joined.add_assets() = joined_with_asset(drawing).assets(0);
  joined.mutable_assets(1)->set_kind("drawing");
  SessionSettings settings = fetching("contact");
  settings.drawn_asset_kinds = {"drawing"};
  test::SessionBench bench(settings);
  join(bench, joined);
  serve_assets(bench, {felt, std::string(200, 'x')});
  EXPECT_EQ(bench.session.asset_level(), AssetLevel::kFull);
  EXPECT_EQ(bench.session.assets().size(), 1U);
}

/// An asset of 150,000 bytes, and a coarse substitute of 2,000 bytes.
struct CoarseAndFine {
  CoarseAndFine() : joined(joined_with_asset(fine)) {
    *joined.add_assets() = joined_with_asset(coarse).assets(0);
    joined.mutable_assets(1)->set_kind("coarse-contact");
    joined.mutable_assets(1)->set_coarse_of(joined.assets(0).sha256());
  }

  std::string fine = std::string(150'000, 'f');
  std::string coarse = std::string(2000, 'c');
  wire::Joined joined;
};

TEST(SessionAssets, FetchesAReplacementFirstAndAnnouncesBoth) {
  const CoarseAndFine assets;
  StoreBench bench(nullptr, assets.joined);
  std::vector<std::pair<AssetLevel, std::size_t>> announced;
  bench.bench.session.on_assets = [&] {
    announced.emplace_back(bench.bench.session.asset_level(), bench.bench.session.assets().size());
  };
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kNone);
  EXPECT_EQ(serve_assets(bench.bench, {assets.fine, assets.coarse}), assets.fine.size() + assets.coarse.size());
  const std::vector<std::pair<AssetLevel, std::size_t>> expected{{AssetLevel::kCoarse, 1}, {AssetLevel::kFull, 2}};
  EXPECT_EQ(announced, expected);

  const auto store = memory_asset_store();
  const auto bytes = std::as_bytes(std::span(assets.fine));
  store->keep(proto::sha256_of(bytes), std::make_shared<const proto::Bytes>(bytes.begin(), bytes.end()));
  StoreBench again(store, assets.joined);
  EXPECT_EQ(serve_assets(again.bench, {assets.fine, assets.coarse}), 0U) << "the stored asset needs no replacement";
  EXPECT_EQ(again.announced, 1);
}

TEST(SessionAssets, RequestsTheWholeAssetAlthoughItsReplacementIsDamaged) {
  const CoarseAndFine assets;
  StoreBench bench(nullptr, assets.joined);
  EXPECT_GT(serve_assets(bench.bench, {assets.fine, std::string(2000, 'x')}), assets.fine.size() - 1);
  EXPECT_EQ(bench.bench.session.assets().size(), 1U);
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, KeepsPiecesOfTheWholeAssetWhenTheConnectionIsLostAfterTheCoarseOne) {
  const CoarseAndFine assets;
  StoreBench bench(nullptr, assets.joined);
  std::size_t served = 0;
  while (served < assets.fine.size() / 2) {
    for (const wire::ClientControl& request : std::exchange(bench.bench.transport.messages, {})) {
      if (!request.has_get_asset() || served >= assets.fine.size() / 2) continue;
      const bool is_fine = request.get_asset().sha256() == assets.joined.assets(0).sha256();
      served += is_fine ? request.get_asset().max_bytes() : 0;
      bench.bench.deliver(answer_to(request, is_fine ? assets.fine : assets.coarse));
    }
    bench.bench.wait(std::chrono::milliseconds(1));
  }
  lose_the_connection_and_join_again(bench.bench, assets.joined);
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kCoarse);
  EXPECT_EQ(serve_assets(bench.bench, {assets.fine, assets.coarse}), assets.fine.size() - served);
}

TEST(SessionAssets, LimitsTheAssetsThatItRequests) {
  wire::Joined joined = test::minimal_joined();
  for (std::uint32_t i = 0; i < 1'500; ++i) {
    wire::AssetInfo& info = *joined.add_assets();
    std::string hash(32, 'h');
    std::memcpy(hash.data(), &i, sizeof i);
    info.set_sha256(hash);
    info.set_size_bytes(1);
    info.set_kind("contact");
  }
  test::SessionBench bench(fetching("contact"));
  join(bench, joined);
  std::size_t requests = 0;
  for (int idle = 0; idle < 200; ++idle) {
    for (const wire::ClientControl& request : std::exchange(bench.transport.messages, {})) {
      if (!request.has_get_asset()) continue;
      ++requests;
      idle = 0;
      wire::ServerControl refusal;
      refusal.set_request(request.request());
      refusal.mutable_error()->set_code(wire::ERROR_UNKNOWN_ASSET);
      bench.deliver(refusal);
    }
    bench.wait(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(requests, 1024U);
  EXPECT_EQ(bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, AnAssetCannotReplaceItself) {
  CoarseAndFine assets;
  assets.joined.mutable_assets(1)->set_sha256(assets.joined.assets(0).sha256());
  StoreBench bench(nullptr, assets.joined);
  EXPECT_EQ(serve_assets(bench.bench, {assets.fine}), assets.fine.size());
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, AFalseReplacementIsNotUsed) {
  using Damage = std::function<void(wire::AssetInfo&)>;
  const std::vector<Damage> damages{[](wire::AssetInfo& coarse) { coarse.set_kind("contact"); },
                                    [](wire::AssetInfo& coarse) { coarse.set_kind("molecule"); },
                                    [](wire::AssetInfo& coarse) { coarse.set_size_bytes(150'000); },
                                    [](wire::AssetInfo& coarse) { coarse.set_coarse_of(coarse.sha256()); },
                                    [](wire::AssetInfo& coarse) { coarse.set_coarse_of(coarse.coarse_of().substr(1)); },
                                    [](wire::AssetInfo& coarse) { coarse.set_coarse_of(""); }};
  for (const Damage& damage : damages) {
    CoarseAndFine assets;
    damage(*assets.joined.mutable_assets(1));
    StoreBench bench(nullptr, assets.joined);
    std::vector<AssetLevel> levels;
    bench.bench.session.on_assets = [&] { levels.push_back(bench.bench.session.asset_level()); };
    serve_assets(bench.bench, {assets.fine, assets.coarse});
    EXPECT_EQ(levels, std::vector{AssetLevel::kFull});
  }
  // Each of two assets names the other as its original. Fails if this cycle causes repeated fetches.
  CoarseAndFine cycle;
  cycle.joined.mutable_assets(0)->set_coarse_of(cycle.joined.assets(1).sha256());
  StoreBench bench(nullptr, cycle.joined);
  EXPECT_EQ(serve_assets(bench.bench, {cycle.fine, cycle.coarse}), cycle.fine.size() + cycle.coarse.size());
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, KeepsPiecesOfAnAssetWhenTheConnectionIsLost) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  StoreBench bench(nullptr, joined);
  std::size_t here = 0;
  while (here < bytes.size() / 2) {
    for (const wire::ClientControl& request : std::exchange(bench.bench.transport.messages, {})) {
      if (!request.has_get_asset()) continue;
      here += request.get_asset().max_bytes();
      bench.bench.deliver(answer_to(request, bytes));
    }
    bench.bench.wait(std::chrono::milliseconds(1));
  }
  lose_the_connection_and_join_again(bench.bench, joined);
  EXPECT_EQ(serve_assets(bench.bench, bytes), bytes.size() - here);
  EXPECT_EQ(bench.bench.session.assets().size(), 1U);
}

TEST(SessionAssets, RemovesAnAssetWhosePiecesDoNotMatchTheRequests) {
  const std::string bytes(150'000, 'v');
  using Damage = std::function<void(wire::ServerControl&)>;
  const std::vector<Damage> damages{
      [](wire::ServerControl& answer) { answer.mutable_asset_chunk()->mutable_data()->pop_back(); },
      [](wire::ServerControl& answer) { answer.mutable_asset_chunk()->mutable_data()->push_back('v'); },
      [](wire::ServerControl& answer) { answer.mutable_asset_chunk()->set_offset(7); },
      [](wire::ServerControl& answer) { answer.mutable_asset_chunk()->set_total_bytes(1U << 30U); },
      [](wire::ServerControl& answer) { answer.mutable_asset_chunk()->mutable_sha256()->front() ^= 1; }};
  for (const Damage& damage : damages) {
    StoreBench bench(nullptr, joined_with_asset(bytes));
    const auto requests = std::exchange(bench.bench.transport.messages, {});
    ASSERT_EQ(requests.size(), 2U) << "a pair, before anything is known of the line";
    wire::ServerControl answer = answer_to(requests[0], bytes);
    damage(answer);
    bench.bench.deliver(answer);
    bench.bench.deliver(answer_to(requests[1], bytes));
    EXPECT_EQ(bench.announced, 1) << "the scene must be announced although an asset is damaged";
    EXPECT_EQ(serve_assets(bench.bench, bytes), 0U);
    EXPECT_EQ(bench.bench.state(), "active");
  }
  StoreBench unrequested(nullptr, joined_with_asset(bytes));
  const auto requests = std::exchange(unrequested.bench.transport.messages, {});
  wire::ServerControl answer = answer_to(requests.at(1), bytes);
  unrequested.bench.deliver(answer);
  EXPECT_TRUE(unrequested.bench.session.assets().empty());
  EXPECT_EQ(unrequested.bench.state(), "active");
}

TEST(SessionAssets, AnswersToWhatWasAskedForBeforeTheKindsChangedTwiceSpoilNothing) {
  const std::string bytes(150'000, 'v');
  StoreBench bench(nullptr, joined_with_asset(bytes));
  const auto before = std::exchange(bench.bench.transport.messages, {});
  ASSERT_EQ(before.size(), 2U);
  bench.bench.session.set_asset_kinds({"surface"});
  bench.bench.session.set_asset_kinds({"contact"});
  bench.bench.wait(std::chrono::milliseconds(30));
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kNone);
  const auto after = std::exchange(bench.bench.transport.messages, {});
  for (const wire::ClientControl& request : before) bench.bench.deliver(answer_to(request, bytes));
  for (const wire::ClientControl& request : after) {
    if (request.has_get_asset()) bench.bench.deliver(answer_to(request, bytes));
  }
  serve_assets(bench.bench, bytes);
  EXPECT_EQ(bench.bench.session.assets().size(), 1U);
  EXPECT_EQ(bench.bench.session.asset_level(), AssetLevel::kFull);
}

TEST(SessionAssets, RequestsOneChunkAtATimeIfConfigured) {
  const std::string bytes(150'000, 'v');
  SessionSettings settings = fetching("contact");
  settings.fetches_one_at_a_time = true;
  test::SessionBench bench(settings);
  bench.session.on_connected(bench.now);
  bench.deliver_welcome();
  bench.transport.messages.clear();
  bench.deliver_joined(joined_with_asset(bytes));
  bench.wait(std::chrono::milliseconds(100));
  ASSERT_EQ(bench.transport.messages.size(), 1U);
  EXPECT_EQ(bench.transport.messages[0].get_asset().max_bytes(), proto::kAssetChunkBytes);
  EXPECT_EQ(serve_assets(bench, bytes), bytes.size());
  EXPECT_EQ(bench.session.assets().size(), 1U);
}

TEST(SessionAssets, HasNoMoreInFlightThanABoundHoweverFastTheLineIs) {
  const std::string bytes(4'000'000, 'v');
  StoreBench bench(nullptr, joined_with_asset(bytes));
  for (int i = 0; i < 100; ++i) {
    const auto requests = std::exchange(bench.bench.transport.messages, {});
    for (const wire::ClientControl& request : requests) {
      if (request.has_get_asset()) bench.bench.deliver(answer_to(request, bytes));
    }
    bench.bench.wait(std::chrono::milliseconds(1));
  }
  std::size_t in_flight = 0;
  for (int i = 0; i < 1000; ++i) {
    for (const wire::ClientControl& request : std::exchange(bench.bench.transport.messages, {})) {
      if (request.has_get_asset()) in_flight += request.get_asset().max_bytes();
    }
    bench.bench.wait(std::chrono::milliseconds(1));
  }
  EXPECT_LE(in_flight, net::FetchRate::kMaxInFlight);
}

TEST(AssetFetcher, PlansNoMoreThanItsLimitHoweverManyAreOffered) {
  AssetFetcher fetcher(1000);
  wire::Joined joined;
  for (const std::uint64_t size : {600ULL, 600ULL, 400ULL, ~0ULL}) {
    wire::AssetInfo& info = *joined.add_assets();
    info.set_sha256(std::string(31, 'h') + static_cast<char>('a' + joined.assets_size()));
    info.set_size_bytes(size);
  }
  EXPECT_EQ(fetcher.begin(joined.assets()).size(), 2U);
}

}  // namespace
}  // namespace tandem::client
