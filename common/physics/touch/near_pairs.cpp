#include "common/physics/touch/near_pairs.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/contact/shape_distance.hpp"

namespace tandem::physics {
namespace {

/// Minimum search distance between shapes, used even if all objects are at rest.
constexpr double kMinBand_m = 5e-5;

/// Maximum number of close pairs that are compared. If there are more close pairs than can be searched, the comparison
/// chooses those with the deepest contacts.
constexpr std::size_t kMaxNear = 4096;

}  // namespace

struct NearPairs::Near {
  std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
  double band_m = 0;
  Pair* pair = nullptr;  ///< null if the pair was not close in the last step

  double deepest_m() const { return pair == nullptr ? 0 : pair->deepest_m; }
  void turn() {
    std::swap(thing_a, thing_b);
    std::swap(part_a, part_b);
  }
};

/// State of an object at the time of look_ahead(), with its predicted reach.
struct NearPairs::FoundThing {
  const TouchModel* model = nullptr;
  TouchThing::Role role = TouchThing::Role::kAbsent;
  std::optional<std::size_t> passes_through;
  Pose X_WB;
  double reach_m = 0;
};

contact::ContactWork NearPairs::Pair::find(const Pose& X_WA, const Pose& X_WB) noexcept {
  const bool is_found = band_m <= found_m && is_same(X_WA, X_WSa) && is_same(X_WB, X_WSb);
  found_m = -1;
  if (!is_found) work = contacts.find(X_WA, X_WB, band_m);
  return work;
}

void NearPairs::Pair::find_ahead(const Pose& X_WA, const Pose& X_WB) noexcept {
  X_WSa = X_WA;
  X_WSb = X_WB;
  found_m = band_m;
  work = contacts.find(X_WA, X_WB, band_m);
}

NearPairs::NearPairs(std::size_t things, std::size_t pairs, std::uint32_t budget) {
  pairs_.reserve(pairs);
  for (std::size_t i = 0; i < pairs; ++i) pairs_.emplace_back(budget);
  near_.reserve(std::max(pairs, kMaxNear));
  neighbours_.reserve(near_.capacity());
  chosen_.reserve(pairs);
  found_things_.reserve(things);
  for (auto& shapes : beside_) shapes.reserve(kMaxBeside);
}

NearPairs::~NearPairs() = default;

TickFaults NearPairs::find(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept {
  const bool is_found = is_found_ahead(things, reach_m);
  found_things_.clear();
  return is_found ? TickFaults{0} : search(things, reach_m);
}

/// If more pairs are close than can be searched, the result is discarded. Choosing among them needs the depths of the
/// contacts, which are known only in the step.
void NearPairs::look_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept {
  found_things_.clear();
  if (search(things, reach_m) != 0) return;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const TouchThing& thing = things[i];
    found_things_.push_back({thing.model, thing.role, thing.passes_through, thing.rigid->pose(), reach_m[i]});
  }
}

bool NearPairs::is_found_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) const noexcept {
  if (found_things_.size() != things.size()) return false;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const TouchThing& thing = things[i];
    const FoundThing& was = found_things_[i];
    if (thing.model != was.model || thing.role != was.role || thing.passes_through != was.passes_through) return false;
    if (reach_m[i] > was.reach_m || !is_same(thing.rigid->pose(), was.X_WB)) return false;
  }
  return !things.empty();
}

TickFaults NearPairs::search(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept {
  near_.clear();
  neighbours_.clear();
  bool has_room = true;
  for (std::size_t a = 0; a < things.size(); ++a) {
    if (things[a].role != TouchThing::Role::kImplicit || !things[a].model->can_be_touched()) continue;
    for (std::size_t b = 0; b < things.size(); ++b) {
      const TouchThing& other = things[b];
      // A pair of two implicit objects is found twice; it is added only in the order a < b.
      const bool is_met_later = other.role == TouchThing::Role::kImplicit && b <= a;
      if (other.role == TouchThing::Role::kAbsent || is_met_later || !other.model->can_be_touched()) continue;
      if (things[a].passes_through == b || other.passes_through == a) continue;
      // Search distance. The factor 1.5 allows for objects that a contact in this step moves farther than their
      // predicted reach.
      const double band = std::max(kMinBand_m, 1.5 * (reach_m[a] + reach_m[b]));
      has_room = add(things, a, b, band) && has_room;
    }
  }
  match(things);
  TickFaults faults = choose_nearest();
  bind(things);
  if (!has_room) faults |= kFaultContactCoarse;
  return faults;
}

bool NearPairs::add(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept {
  const Pose& X_WA = things[a].rigid->pose();
  const Pose& X_WB = things[b].rigid->pose();
  const TouchModel& model_a = *things[a].model;
  const TouchModel& model_b = *things[b].model;
  const double wide_m = std::max(band_m, contact::kUnionReach_m);
  if ((X_WA.p - X_WB.p).norm() > model_a.radius_m + model_b.radius_m + wide_m) return true;
  for (std::size_t i = 0; i < model_a.parts.size(); ++i) {
    for (std::size_t j = 0; j < model_b.parts.size(); ++j) {
      const Pose X_WSa = X_WA * model_a.parts[i].X_BS;
      const Pose X_WSb = X_WB * model_b.parts[j].X_BS;
      const contact::ContactShape& shape_a = *model_a.parts[i].shape;
      const contact::ContactShape& shape_b = *model_b.parts[j].shape;
      if (!contact::boxes_are_near(shape_a, X_WSa, shape_b, X_WSb, wide_m)) continue;
      const PartName own(static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(i));
      const PartName others(static_cast<std::uint16_t>(b), static_cast<std::uint16_t>(j));
      if (neighbours_.size() < neighbours_.capacity()) neighbours_.push_back({own, others});
      if (wide_m > band_m && !contact::boxes_are_near(shape_a, X_WSa, shape_b, X_WSb, band_m)) continue;
      if (near_.size() == near_.capacity()) return false;
      near_.push_back({own.first, own.second, others.first, others.second, band_m});
    }
  }
  return true;
}

/// Assigns to each close pair the Pair object of the last step, so that the friction state is preserved. If an object
/// has changed its role since, the Pair may contain the two objects in reverse order. The order of the Pair is then
/// kept.
void NearPairs::match(std::span<const TouchThing> things) noexcept {
  const auto used = std::span(pairs_).first(end_);
  for (Near& near : near_) {
    const auto is_its = [&near](const Pair& pair) {
      return pair.is_used && pair.thing_a == near.thing_a && pair.part_a == near.part_a &&
             pair.thing_b == near.thing_b && pair.part_b == near.part_b;
    };
    auto found = std::find_if(used.begin(), used.end(), is_its);
    if (found == used.end() && things[near.thing_b].role != TouchThing::Role::kStatic) {
      near.turn();
      found = std::find_if(used.begin(), used.end(), is_its);
      if (found == used.end()) near.turn();
    }
    if (found != used.end()) near.pair = &*found;
  }
}

/// Chooses pairs if more are close than can be searched: those with the deepest contact first, then those that were
/// close in the last step.
TickFaults NearPairs::choose_nearest() noexcept {
  if (near_.size() <= pairs_.size()) return 0;
  const auto is_before = [](const Near& x, const Near& y) {
    if (x.deepest_m() != y.deepest_m()) return x.deepest_m() > y.deepest_m();
    if ((x.pair != nullptr) != (y.pair != nullptr)) return x.pair != nullptr;
    return std::tie(x.thing_a, x.thing_b, x.part_a, x.part_b) < std::tie(y.thing_a, y.thing_b, y.part_a, y.part_b);
  };
  std::sort(near_.begin(), near_.end(), is_before);
  near_.resize(pairs_.size());
  return kFaultContactCoarse;
}

void NearPairs::bind(std::span<const TouchThing> things) noexcept {
  const auto used = std::span(pairs_).first(end_);
  for (Pair& pair : used) pair.is_near = false;
  for (Near& near : near_) {
    if (near.pair != nullptr) near.pair->is_near = true;
  }
  for (Pair& pair : used) pair.is_used = pair.is_used && pair.is_near;
  while (end_ > 0 && !pairs_[end_ - 1].is_used) --end_;
  chosen_.clear();
  for (Near& near : near_) {
    if (near.pair == nullptr) {
      // An unused Pair exists, because near_ has at most as many entries as pairs_.
      const auto free = std::find_if(pairs_.begin(), pairs_.end(), [](const Pair& pair) { return !pair.is_used; });
      end_ = std::max(end_, static_cast<std::size_t>(free - pairs_.begin()) + 1);
      near.pair = &*free;
      free->is_used = true;
      free->thing_a = near.thing_a;
      free->part_a = near.part_a;
      free->thing_b = near.thing_b;
      free->part_b = near.part_b;
      free->deepest_m = 0;
      free->found_m = -1;
      free->contacts.bind(things[near.thing_a].model->parts[near.part_a].shape.get(),
                          things[near.thing_b].model->parts[near.part_b].shape.get());
    }
    near.pair->band_m = near.band_m;
    chosen_.push_back(near.pair);
  }
}

/// Corrects the contacts of a pair of shapes A and B. The correction uses two lists of other shapes: those beside B
/// that are close to A, and those beside A that are close to B.
void NearPairs::join(std::span<const TouchThing> things, Pair& pair) noexcept {
  if (neighbours_.size() < 2 || pair.contacts.contacts().empty()) return;
  for (auto& shapes : beside_) shapes.clear();
  const auto placed = [&](const PartName& name) {
    const TouchModel::Part& part = things[name.first].model->parts[name.second];
    return contact::PlacedShape{part.shape.get(), things[name.first].rigid->pose() * part.X_BS};
  };
  const std::array<PartName, 2> own = {PartName{pair.thing_a, pair.part_a}, {pair.thing_b, pair.part_b}};
  for (const std::array<PartName, 2>& both : neighbours_) {
    if (both == own || (both[0] == own[1] && both[1] == own[0])) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t k = 0; k < 2; ++k) {
        if (both[k] != own[1 - side] || beside_[side].size() == kMaxBeside) continue;
        beside_[side].push_back(placed(both[1 - k]));
      }
    }
  }
  if (beside_[0].empty() && beside_[1].empty()) return;
  pair.contacts.join(placed(own[0]).X_WS, placed(own[1]).X_WS, beside_[0], beside_[1]);
}

}  // namespace tandem::physics
