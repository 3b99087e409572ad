// See stage.hpp: one table names every stage, for the command line, the lab and error messages.
#include "client/stage.hpp"

#include <array>

namespace tandem {
namespace {

template <class T>
std::unique_ptr<Stage> make() {
  return std::make_unique<T>();
}

struct StageEntry {
  std::string_view name;
  std::unique_ptr<Stage> (*make)();
};
constexpr std::array<StageEntry, 2> kStages{{{"late-pose", &make<LatePose>}, {"hold", &make<Hold>}}};

}  // namespace

// The coupling gives the wrench on the tool about the tool's origin. Its negative acts on the hand about the handle's
// origin: so the power into the coupling is what it stores and dissipates, whatever the distance between the two.
Wrench LatePose::wrench_on_hand_W(const StageInput& input) noexcept {
  if (input.newest == nullptr) return {};
  const RigidState& tool = input.newest->tool;
  return -input.coupling->wrench_on_tool_W(coupling_state(input.handle.X, input.handle.V, tool.X, tool.V));
}

Wrench Hold::wrench_on_hand_W(const StageInput& input) noexcept {
  if (input.newest == nullptr) return {};
  return input.newest->wrench_on_hand_W;
}

std::unique_ptr<Stage> make_stage(std::string_view name) {
  for (const StageEntry& entry : kStages) {
    if (entry.name == name) return entry.make();
  }
  return nullptr;
}

std::vector<std::string_view> stage_names() {
  std::vector<std::string_view> names;
  for (const StageEntry& entry : kStages) names.push_back(entry.name);
  return names;
}

}  // namespace tandem
