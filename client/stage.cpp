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

Wrench LatePose::wrench_on_hand_W(const StageInput& input) noexcept {
  if (input.newest == nullptr) return {};
  if (input.coupling->tool_dynamics() == ToolDynamics::kAtHandle) return input.newest->wrench_on_hand_W;
  const RigidState& tool = input.newest->tool;
  return coupling_wrenches(*input.coupling, input.handle.X, input.handle.V, tool.X, tool.V).on_hand_W;
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

std::string listed_stage_names() {
  std::string text;
  for (const StageEntry& entry : kStages) text.append(text.empty() ? "" : ", ").append(entry.name);
  return text;
}

}  // namespace tandem
