#include "client/haptics/stages/makers.hpp"

namespace tandem::client {
namespace {

class Hold final : public Stage {
 public:
  std::string_view name() const noexcept override { return "hold"; }
  StageOutput tick(const StageInput& input) noexcept override {
    StageOutput output;
    if (input.newest != nullptr) output.wrench_on_hand_W = input.newest->update.wrench_on_hand_W;
    return output;
  }
};

}  // namespace

std::unique_ptr<Stage> make_hold_stage(const StageSettings&) {
  return std::make_unique<Hold>();
}

}  // namespace tandem::client
