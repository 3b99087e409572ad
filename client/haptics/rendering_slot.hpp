// Holds the rendering in use. The io thread offers renderings, and the haptic thread changes to them and ticks them.
// The displayed force is blended from one rendering to the next.
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

/// Holds the rendering in use and the next one. Renderings are numbered from 1 in the order of their offers.
///
/// Invariants  The first rendering is used from construction on, so there is always a rendering in use. The displayed
///             force is continuous when the rendering changes
/// Thread      haptic, except where stated: no allocation, no throw after construction
class RenderingSlot {
 public:
  /// In      first  stage of the first rendering. This rendering has neither a local model nor a proxy world
  explicit RenderingSlot(std::unique_ptr<Stage> first);

  /// Offers a rendering that is used from the next tick on. Returns false if it is not accepted; the caller then keeps
  /// it and must offer it again later (Handover::offer()).
  /// Thread  io
  bool offer(std::unique_ptr<Rendering>& rendering);
  /// Returns the number of the last accepted offer.
  /// Thread  io
  std::uint32_t offered() const noexcept { return offered_.load(std::memory_order_relaxed); }
  /// Runs the slow work of the last offered stage, outside the haptic tick (Stage::service()).
  /// Thread  any but the haptic thread, one at a time
  void service() noexcept { newest_stage_->service(); }
  /// Returns the number of the newest rendering whose local model was displayed; 0 if there was none.
  /// Thread  any
  std::uint32_t shown_locally() const noexcept { return shown_locally_.load(std::memory_order_relaxed); }

  /// Returns the number of the newest offered rendering. The haptic thread must read this number first and the mailbox
  /// of the scene second. Each scene is published before its rendering is offered, so the mailbox then contains the
  /// scene of this rendering or a newer one.
  std::uint32_t newest() const noexcept { return offered_.load(std::memory_order_acquire); }
  /// Changes to the rendering with this number. Returns true if the rendering changed, false if it was in use already.
  /// If both renderings are of the same scene, the new local model continues from the state of the previous one.
  /// In      scene  null if the scene is not usable
  bool enter(std::uint32_t number, const HapticScene* scene) noexcept;

  /// Returns the rendering in use, or null if its models belong to a different scene.
  const Rendering* of_scene(std::uint32_t generation) const noexcept;
  /// Ticks the stage in use and blends the force of its output.
  StageOutput tick(const StageInput& input) noexcept;
  /// Passes the displayed wrench to the stage.
  void set_displayed(const Wrench& on_hand_W) noexcept { current().stage->set_displayed(on_hand_W); }
  /// Starts a new scene: discards the stage's history and the blend.
  void reset() noexcept;
  /// Discards the blend. Must be called only while no force is displayed.
  void reset_blend() noexcept { blend_.reset(); }

 private:
  Rendering& current() const noexcept { return *renderings_.get(); }

  realtime::Handover<Rendering> renderings_;
  std::atomic<std::uint32_t> offered_{0};
  std::uint32_t entered_ = 0;  ///< number of the rendering in use
  std::atomic<std::uint32_t> shown_locally_{0};
  Stage* newest_stage_ = nullptr;  ///< stage of the last offer; used by the io thread only
  ForceBlend blend_;               ///< blends the force from one rendering to the next
};

}  // namespace tandem::client
