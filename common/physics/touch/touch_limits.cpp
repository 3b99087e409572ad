#include "common/physics/touch/touch_limits.hpp"

#include <algorithm>

namespace tandem::physics {

TouchStage::Limits touch_limits(const WorldDescription& world, std::span<const ToolDescription> tools) {
  std::size_t pairs = 0, moving = 0, all = 0;
  const auto add = [&](std::size_t parts, bool is_static) {
    pairs += parts * (is_static ? moving : all);
    if (!is_static) moving += parts;
    all += parts;
  };
  for (const BodyDescription& body : world.bodies) add(body.touch.parts.size(), body.mass.mass_kg <= 0);
  for (const ToolDescription& tool : tools) add(tool.touch.parts.size(), false);
  return {std::max<std::size_t>(world.bodies.size() + tools.size(), 1),
          tools.size(),
          world.bodies.size(),
          std::clamp<std::size_t>(pairs, 1, world.limits.contact_pairs),
          world.limits.contact_points,
          world.limits.body_speed_m_per_s};
}

}  // namespace tandem::physics
