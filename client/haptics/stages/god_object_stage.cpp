#include "client/haptics/stages/force_blend.hpp"
#include "client/haptics/stages/makers.hpp"
#include "client/model/proxy_world.hpp"

namespace tandem::client {
namespace {

class GodObjectStage final : public Stage {
 public:
  std::string_view name() const noexcept override { return "god-object"; }
  StageOutput tick(const StageInput& input) noexcept override {
    StageOutput output;
    if (input.newest == nullptr || input.proxy_world == nullptr) return output;
    const haptics::ProxyState& ball =
        input.proxy_world->step(input.handle.X.p, *input.newest, input.now, input.scene->absent_bodies);
    Wrench wrench;
    wrench.f = haptics::proxy_force_on_hand_W(ball, *input.coupling, input.handle.V.v);
    // The first force of the ball is blended in, because it may be large: if assets arrive late, the hand may already
    // be deep inside a wall.
    blend_.advance(input.period_s);
    if (!has_ball_) blend_.jump();
    has_ball_ = true;
    output.wrench_on_hand_W = blend_.apply(wrench);
    output.local_wrench_on_hand_W = output.wrench_on_hand_W;
    output.is_local = true;
    output.tool.X = {ball.p_W, input.handle.X.q};
    return output;
  }
  void reset() noexcept override {
    blend_.reset();
    has_ball_ = false;
  }

 private:
  ForceBlend blend_;
  bool has_ball_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_god_object_stage(const StageSettings&) {
  return std::make_unique<GodObjectStage>();
}

}  // namespace tandem::client
