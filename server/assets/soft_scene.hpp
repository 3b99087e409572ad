// Converts the soft bodies of a scene file for the soft world.
#pragma once

#include "server/assets/scene_file.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

/// In      mesh  mesh of a mesh body; null for a block
///         field  field of the body, for refusals
/// Fails   SceneError: the mesh is not closed, or has too many vertices
SoftModel soft_model_of(const wire::SoftBody& body, const geometry::ContactMesh* mesh, const SceneField& field);

/// Note for the operator: nodes, and the rate at which they are stepped.
std::string soft_note(const SoftModel& model, const wire::Scene& scene);

/// Settings of the soft world. Movable bodies are the tools of the scene, then its bodies, in scene order: advance()
/// takes all of them. Static bodies are obstacles; advance() ignores their entries.
SoftWorldSettings soft_world_settings(const LoadedScene& scene);

}  // namespace tandem::server
