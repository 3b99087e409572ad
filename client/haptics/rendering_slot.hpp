// The rendering in use: handed over by the io thread, ticked by the haptic thread, blended from one to the next.
//
//   io thread      offer(rendering) ──▶ handover ──▶ enter(), tick()      haptic thread
//                  service() ◀── its stage           blend over 0.3 s
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "client/haptics/rendering.hpp"
#include "client/haptics/stages/force_blend.hpp"
#include "common/realtime/handover.hpp"

namespace tandem::client {

/// Holds the rendering in use and the next one. Renderings are numbered in the order of their offers, from 1.
///
/// Invariants  The first rendering is entered at construction, so one is always in use. The displayed force is
///             continuous when another one is entered.
/// Thread      haptic, except where stated: no allocation, no throw after construction
class RenderingSlot {
 public:
  /// In      first  its stage; without models
  explicit RenderingSlot(std::unique_ptr<Stage> first);

  /// Offers a rendering that is used from the next tick on. Returns false if it stays with the caller, and must be
  /// offered again later (Handover::offer()).
  /// Thread  io
  bool offer(std::unique_ptr<Rendering>& rendering);
  /// Number of the last accepted offer.
  /// Thread  io
  std::uint32_t offered() const noexcept { return offered_.load(std::memory_order_relaxed); }
  /// Runs the off-path work of the last offered stage.
  /// Thread  one at a time other than the haptic one
  void service() noexcept { newest_stage_->service(); }
  /// Number of the newest rendering whose local model was displayed; 0: none.
  /// Thread  any
  std::uint32_t shown_locally() const noexcept { return shown_locally_.load(std::memory_order_relaxed); }

  /// Number of the newest offer. Read it before the scene's mailbox: the scene of a rendering is published before the
  /// rendering is offered, so it is then available.
  std::uint32_t newest() const noexcept { return offered_.load(std::memory_order_acquire); }
  /// Enters the rendering of this number; does nothing if it is in use. If both are of the same scene, the new local
  /// model continues from the previous one. Returns true if another rendering is in use now.
  /// In      scene  null: the scene is not usable
  bool enter(std::uint32_t number, const HapticScene* scene) noexcept;

  /// The rendering in use if its models belong to this scene, else null.
  const Rendering* of_scene(std::uint32_t generation) const noexcept;
  /// Ticks the stage in use. The force of its output is blended.
  StageOutput tick(const StageInput& input) noexcept;
  /// Reports the displayed wrench to the stage.
  void set_displayed(const Wrench& on_hand_W) noexcept { current().stage->set_displayed(on_hand_W); }
  /// Starts another scene: discards the stage's history and the blend.
  void reset() noexcept;
  /// Discards the blend, once no force is displayed.
  void reset_blend() noexcept { blend_.reset(); }

 private:
  Rendering& current() const noexcept { return *renderings_.get(); }

  realtime::Handover<Rendering> renderings_;
  std::atomic<std::uint32_t> offered_{0};
  std::uint32_t entered_ = 0;  ///< number of the rendering in use
  std::atomic<std::uint32_t> shown_locally_{0};
  Stage* newest_stage_ = nullptr;  ///< io thread: stage of the last offer
  ForceBlend blend_;               ///< fades from one rendering to the next
};

}  // namespace tandem::client
