#include "client/session/asset_plan.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "common/geometry/drawing_asset.hpp"

namespace tandem::client {
namespace {

/// Maximum number of assets in each list (tactile, drawn); further assets are ignored. A limit is needed, because the
/// server determines the number of assets and the io thread searches the list for each piece.
constexpr int kMaxAssets = 1024;

AssetInfos of_kinds(const std::vector<std::string>& kinds, const AssetInfos& offered) {
  AssetInfos wanted;
  for (const wire::AssetInfo& info : offered) {
    if (wanted.size() == kMaxAssets) break;
    if (std::ranges::find(kinds, info.kind()) != kinds.end()) *wanted.Add() = info;
  }
  return wanted;
}

/// Returns the first drawing (the smallest one) of each surface. These drawings are fetched first, so that every
/// surface is visible early.
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

/// Returns the coarse replacements of tactile assets, indexed by the hash of the replaced asset.
std::map<std::string_view, const wire::AssetInfo*> coarse_ones(const AssetInfos& offered) {
  std::map<std::string_view, const wire::AssetInfo*> coarse;
  for (const wire::AssetInfo& info : offered) {
    if (info.kind() == "coarse-contact") coarse.emplace(info.coarse_of(), &info);
  }
  return coarse;
}

/// Returns the coarse replacement of `fine`; null if there is none. A replacement is valid only for a contact asset,
/// and only if it is smaller than `fine`.
const wire::AssetInfo* stand_in(const wire::AssetInfo& fine,
                                const std::map<std::string_view, const wire::AssetInfo*>& coarse) {
  const auto found = coarse.find(fine.sha256());
  const bool is_one = found != coarse.end() && fine.kind() == "contact" &&
                      found->second->size_bytes() < fine.size_bytes() && found->second->sha256() != fine.sha256();
  return is_one ? found->second : nullptr;
}

}  // namespace

AssetPlan::AssetPlan(AssetPlanSettings settings, std::function<void(const std::string&)> log)
    : settings_(std::move(settings)), log_(std::move(log)), fetcher_(kMaxAssetBytes, settings_.store) {}

void AssetPlan::reconnect() {
  rate_.reset();
  fetcher_.reconnect();
}

bool AssetPlan::begin(const AssetInfos& offered) {
  level_ = AssetLevel::kNone;
  offered_ = offered;
  if (offered_.size() > kMaxAssets) {
    log_("the scene has more than " + std::to_string(kMaxAssets) + " assets; those beyond may be left out");
  }
  fetcher_.look_up(of_kinds(settings_.kinds, offered_));
  step_ = Step::kSelect;
  return take_steps();
}

bool AssetPlan::advance(LocalTime now) {
  fetcher_.check_store(now);
  return take_steps();
}

bool AssetPlan::take_steps() {
  bool has_risen = false;
  while (step_ != Step::kNone && fetcher_.accept_found()) {
    switch (std::exchange(step_, Step::kNone)) {
      case Step::kNone:
        break;
      case Step::kSelect:
        select();
        break;
      case Step::kFetch: {
        AssetInfos all = first_drawings(of_kinds(settings_.drawn_kinds, offered_));
        all.MergeFrom(felt_coarse_);
        all.MergeFrom(felt_fine_);
        fetch(all);
        has_risen = raise_level() || has_risen;
        break;
      }
      case Step::kDrawings:
        fetch(drawings_by_size());
        break;
    }
  }
  return has_risen;
}

void AssetPlan::fetch(const AssetInfos& wanted) {
  for (const std::string& line : fetcher_.begin(wanted)) log_(line);
}

void AssetPlan::select() {
  const auto coarse_of = coarse_ones(offered_);
  AssetInfos first, fine;
  AssetInfos look_up = first_drawings(of_kinds(settings_.drawn_kinds, offered_));
  for (const wire::AssetInfo& info : of_kinds(settings_.kinds, offered_)) {
    const wire::AssetInfo* const coarse = fetcher_.has(info) ? nullptr : stand_in(info, coarse_of);
    *first.Add() = coarse != nullptr ? *coarse : info;
    if (coarse != nullptr) *look_up.Add() = *coarse;
    if (coarse != nullptr) *fine.Add() = info;
  }
  felt_coarse_ = std::move(first);
  felt_fine_ = std::move(fine);
  fetcher_.look_up(look_up);
  step_ = Step::kFetch;
}

AssetInfos AssetPlan::drawings_by_size() const {
  AssetInfos drawn = of_kinds(settings_.drawn_kinds, offered_);
  std::ranges::stable_sort(drawn, {}, &wire::AssetInfo::size_bytes);
  return drawn;
}

std::optional<wire::GetAsset> AssetPlan::next_request(std::uint32_t request, LocalTime now) {
  // While the assets are being selected, no request is made, because the fetcher's list may still contain assets of the
  // previous scene.
  if (is_planning()) return std::nullopt;
  const std::size_t bytes = !settings_.fetches_one_at_a_time ? rate_.bytes_to_request(now)
                            : fetcher_.is_awaiting()         ? 0
                                                             : proto::kAssetChunkBytes;
  if (bytes == 0) return std::nullopt;
  auto wanted = fetcher_.next_request(request, bytes);
  if (wanted) rate_.note_request(now, wanted->max_bytes());
  return wanted;
}

/// Raises the availability level if the received assets permit it. Once the full level is reached, starts to fetch the
/// remaining drawings. Returns true if the level has risen.
bool AssetPlan::raise_level() {
  if (level_ == AssetLevel::kFull || is_planning()) return false;
  const AssetLevel before = level_;
  if (fetcher_.left_of(felt_coarse_) == 0) level_ = AssetLevel::kCoarse;
  if (level_ == AssetLevel::kCoarse && fetcher_.left_of(felt_fine_) == 0) level_ = AssetLevel::kFull;
  if (level_ == AssetLevel::kFull) {
    fetcher_.look_up(drawings_by_size());
    step_ = Step::kDrawings;
  }
  return level_ != before;
}

bool AssetPlan::receive(std::uint32_t request, const wire::AssetChunk& chunk, LocalTime now) {
  if (fetcher_.is_next(request)) rate_.answered(now);
  const std::string problem = fetcher_.on_chunk(request, chunk);
  if (!problem.empty()) log_(problem);
  return raise_level();
}

bool AssetPlan::refuse(std::uint32_t request, LocalTime now) {
  if (!fetcher_.is_next(request)) return false;
  rate_.answered(now);
  fetcher_.on_refused(request);
  return raise_level();
}

}  // namespace tandem::client
