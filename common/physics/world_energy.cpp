// Computes the energy stored in the world [J], for tests, reports and passivity control.
#include "common/physics/world_impl.hpp"

namespace tandem::physics {

double World::Impl::mechanical_energy_j() const {
  double energy = 0;
  for (const WorldBody& body : bodies) {
    if (body.rigid.is_static()) continue;
    energy += body.rigid.mechanical_energy_j(gravity);
    if (body.has_anchor()) energy += physics::stored_energy_j(body.anchor.joint(), body.start().X, body.rigid.pose());
  }
  for (const WorldTool& tool : tools) {
    if (tool.is_free() && tool.has_mass()) energy += tool.rigid.mechanical_energy_j(gravity);
  }
  return energy;
}

double World::Impl::coupling_energy_j(std::uint32_t without_hands) const {
  double energy = 0;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const WorldTool& tool = tools[i];
    if (!tool.is_active || tool.hand.dynamics() == haptics::ToolDynamics::kAtHandle) continue;
    if ((without_hands & bit_of(i)) == 0) energy += tool.hand.stored_energy_j(tool_state(tool).X);
  }
  return energy;
}

double World::stored_energy_j(std::uint32_t without_hands) const {
  return impl_->mechanical_energy_j() + impl_->coupling_energy_j(without_hands) + impl_->field.energy_j();
}

double World::coupling_energy_j(std::size_t index) const {
  const WorldTool& tool = impl_->tools[index];
  if (!tool.is_active || tool.hand.dynamics() == haptics::ToolDynamics::kAtHandle) return 0;
  return tool.hand.stored_energy_j(impl_->tool_state(tool).X);
}

double World::energy_of_tool_j(std::size_t index) const {
  const WorldTool& tool = impl_->tools[index];
  const bool moves = tool.is_free() && tool.has_mass();
  return (moves ? tool.rigid.mechanical_energy_j(Vec3::Zero()) : 0.0) + coupling_energy_j(index);
}

}  // namespace tandem::physics
