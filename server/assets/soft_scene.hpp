// From the soft bodies of a scene file to the soft world.
#pragma once

#include "server/assets/scene_file.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

/// In      mesh  of a body made of a mesh; null for a block
///         field  of the body, for refusals
/// Fails   SceneError: the mesh is not closed, or has too many vertices
SoftModel soft_model_of(const wire::SoftBody& body, const geometry::ContactMesh* mesh, const SceneField& field);

/// For people: nodes, and at which rate they are stepped.
std::string soft_note(const SoftModel& model, const wire::Scene& scene);

/// Movable are the scene's tools, then its bodies, in its order: advance() takes all of them. Static bodies are
/// obstacles; what advance() is told about them is not heard.
SoftWorldSettings soft_world_settings(const LoadedScene& scene);

}  // namespace tandem::server
