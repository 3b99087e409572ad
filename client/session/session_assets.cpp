// Selects the assets of the joined scene to look up and fetch, and their order.
#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "client/session/session_impl.hpp"
#include "common/geometry/drawing_asset.hpp"

namespace tandem::client {
namespace {

/// Limit of each list, tactile and drawn assets; the rest is ignored. The server chooses the number of assets, and the
/// io thread scans the list for each chunk.
constexpr int kMaxAssets = 1024;

AssetInfos of_kinds(const std::vector<std::string>& kinds, const AssetInfos& offered) {
  AssetInfos wanted;
  for (const wire::AssetInfo& info : offered) {
    if (wanted.size() == kMaxAssets) break;
    if (std::ranges::find(kinds, info.kind()) != kinds.end()) *wanted.Add() = info;
  }
  return wanted;
}

/// Smallest drawing of each surface.
AssetInfos first_drawings(const AssetInfos& offered) {
  std::map<std::string_view, const wire::AssetInfo*> smallest;
  for (const wire::AssetInfo& info : offered) {
    if (info.kind() != geometry::kDrawingAssetKind) continue;
    const auto [known, is_first] = smallest.emplace(info.coarse_of(), &info);
    if (!is_first && info.size_bytes() < known->second->size_bytes()) known->second = &info;
  }
  AssetInfos first;
  for (const auto& [surface, info] : smallest) *first.Add() = *info;
  return first;
}

/// Coarse replacements, by the hash of the asset that they replace.
std::map<std::string_view, const wire::AssetInfo*> coarse_ones(const AssetInfos& offered) {
  std::map<std::string_view, const wire::AssetInfo*> coarse;
  for (const wire::AssetInfo& info : offered) {
    if (info.kind() == "coarse-contact") coarse.emplace(info.coarse_of(), &info);
  }
  return coarse;
}

/// Coarse replacement of `fine`; null: none. Entries of the wrong kind or size are not accepted as replacements.
const wire::AssetInfo* stand_in(const wire::AssetInfo& fine,
                                const std::map<std::string_view, const wire::AssetInfo*>& coarse) {
  const auto found = coarse.find(fine.sha256());
  const bool is_one = found != coarse.end() && fine.kind() == "contact" &&
                      found->second->size_bytes() < fine.size_bytes() && found->second->sha256() != fine.sha256();
  return is_one ? found->second : nullptr;
}

}  // namespace

/// Starts the look-ups in the store. A store on a disk answers later (continue_fetching()).
void ClientSession::Impl::fetch(bool is_connected_anew) {
  if (is_connected_anew) assets.reconnect();
  if (scene.joined()->assets_size() > kMaxAssets) {
    log("the scene has more than " + std::to_string(kMaxAssets) + " assets; those beyond may be left out");
  }
  assets.look_up(of_kinds(settings.asset_kinds, scene.joined()->assets()));
  fetch_step = FetchStep::kSelect;
  continue_fetching();
}

void ClientSession::Impl::continue_fetching() {
  while (fetch_step != FetchStep::kNone && assets.accept_found()) {
    switch (std::exchange(fetch_step, FetchStep::kNone)) {
      case FetchStep::kNone:
        break;
      case FetchStep::kSelect:
        plan_fetch();
        break;
      case FetchStep::kFetch: {
        AssetInfos all = first_drawings(of_kinds(settings.drawn_asset_kinds, scene.joined()->assets()));
        all.MergeFrom(felt_coarse);
        all.MergeFrom(felt_fine);
        for (const std::string& line : assets.begin(all)) log(line);
        announce_assets();
        break;
      }
      case FetchStep::kDrawings:
        for (const std::string& line : assets.begin(drawings_by_size())) log(line);
        break;
    }
  }
}

void ClientSession::Impl::plan_fetch() {
  const AssetInfos& offered = scene.joined()->assets();
  const auto coarse_of = coarse_ones(offered);
  AssetInfos first, fine;
  AssetInfos look_up = first_drawings(of_kinds(settings.drawn_asset_kinds, offered));
  for (const wire::AssetInfo& info : of_kinds(settings.asset_kinds, offered)) {
    const wire::AssetInfo* const coarse = assets.has(info) ? nullptr : stand_in(info, coarse_of);
    *first.Add() = coarse != nullptr ? *coarse : info;
    if (coarse != nullptr) *look_up.Add() = *coarse;
    if (coarse != nullptr) *fine.Add() = info;
  }
  felt_coarse = std::move(first);
  felt_fine = std::move(fine);
  assets.look_up(look_up);
  fetch_step = FetchStep::kFetch;
}

AssetInfos ClientSession::Impl::drawings_by_size() const {
  AssetInfos drawn = of_kinds(settings.drawn_asset_kinds, scene.joined()->assets());
  std::ranges::stable_sort(drawn, {}, &wire::AssetInfo::size_bytes);
  return drawn;
}

void ClientSession::Impl::fetch_drawn() {
  assets.look_up(drawings_by_size());
  fetch_step = FetchStep::kDrawings;
}

void ClientSession::Impl::request_assets(LocalTime now) {
  const auto bytes_to_request = [this, now] {
    if (!settings.fetches_one_at_a_time) return fetch_rate.bytes_to_request(now);
    return assets.is_awaiting() ? 0 : proto::kAssetChunkBytes;
  };
  // During planning the list may still hold assets of the previous scene.
  if (is_planning()) return;
  while (const std::size_t bytes = bytes_to_request()) {
    const auto wanted = assets.next_request(last_request + 1, bytes);
    if (!wanted) return;
    wire::ClientControl message;
    *message.mutable_get_asset() = *wanted;
    send_request(message);
    fetch_rate.note_request(now, wanted->max_bytes());
  }
}

/// Reports a higher asset level. At the full level the fetch of the remaining drawings begins.
void ClientSession::Impl::announce_assets() {
  if (asset_level == AssetLevel::kFull || is_planning()) return;
  const AssetLevel before = asset_level;
  if (assets.left_of(felt_coarse) == 0) asset_level = AssetLevel::kCoarse;
  if (asset_level == AssetLevel::kCoarse && assets.left_of(felt_fine) == 0) asset_level = AssetLevel::kFull;
  if (asset_level == before) return;
  if (owner.on_assets) owner.on_assets();
  if (asset_level == AssetLevel::kFull) fetch_drawn();
}

void ClientSession::Impl::receive_asset_chunk(const wire::ServerControl& message, LocalTime now) {
  if (assets.is_next(message.request())) fetch_rate.answered(now);
  const std::string problem = assets.on_chunk(message.request(), message.asset_chunk());
  if (!problem.empty()) log(problem);
  announce_assets();
  request_assets(now);
}

void ClientSession::set_asset_kinds(std::vector<std::string> kinds) {
  impl_->settings.asset_kinds = std::move(kinds);
  if (impl_->status.state != SessionState::kActive) return;
  impl_->asset_level = AssetLevel::kNone;
  impl_->fetch(false);
}

AssetLevel ClientSession::asset_level() const {
  return impl_->status.state == SessionState::kActive ? impl_->asset_level : AssetLevel::kNone;
}

}  // namespace tandem::client
