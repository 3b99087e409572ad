#include "client/haptics/rendering_slot.hpp"

#include <utility>

#include "client/model/local_model.hpp"
#include "client/model/proxy_world.hpp"

namespace tandem::client {
namespace {

/// Rate ω of the force blend (see ForceBlend). At this rate, a force difference of 18 N changes by less than 0.1 N in a
/// millisecond.
constexpr double kBlend_per_s = 15;

}  // namespace

Rendering::Rendering() = default;
Rendering::~Rendering() = default;

RenderingSlot::RenderingSlot(std::unique_ptr<Stage> first) : blend_(kBlend_per_s) {
  auto rendering = std::make_unique<Rendering>();
  rendering->stage = std::move(first);
  offer(rendering);
  entered_ = offered();
  renderings_.enter(entered_);
}

bool RenderingSlot::offer(std::unique_ptr<Rendering>& rendering) {
  const std::uint32_t number = offered() + 1;
  Stage* const stage = rendering->stage.get();
  if (!renderings_.offer(number, rendering)) return false;
  newest_stage_ = stage;
  offered_.store(number, std::memory_order_release);
  return true;
}

bool RenderingSlot::enter(std::uint32_t number, const HapticScene* scene) noexcept {
  if (number == entered_) return false;
  entered_ = number;
  // The new model receives the state of the previous model before renderings_.enter(), because after that call the io
  // thread may free the previous rendering.
  const Rendering& before = current();
  const Rendering& next = *renderings_.offered(number);
  const bool is_same_scene = next.generation == before.generation && next.local_model && before.local_model;
  if (is_same_scene && scene != nullptr) next.local_model->continue_from(*before.local_model, *scene);
  renderings_.enter(number);
  blend_.jump();
  return true;
}

const Rendering* RenderingSlot::of_scene(std::uint32_t generation) const noexcept {
  const Rendering& rendering = current();
  return rendering.generation == generation ? &rendering : nullptr;
}

StageOutput RenderingSlot::tick(const StageInput& input) noexcept {
  StageOutput output = current().stage->tick(input);
  if (output.is_local && input.local_model != nullptr) shown_locally_.store(entered_, std::memory_order_relaxed);
  blend_.advance(input.period_s);
  output.wrench_on_hand_W = blend_.apply(output.wrench_on_hand_W);
  return output;
}

void RenderingSlot::reset() noexcept {
  current().stage->reset();
  blend_.reset();
}

}  // namespace tandem::client
