// Converts the soft bodies of a scene file into settings of the soft world.
#pragma once

#include "server/assets/scene_file.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

/// Makes the model of a soft body in a scene file.
/// In      mesh   surface of a soft body of the kind `mesh`; null for a block (a cuboid soft body)
///         field  location of the body in the file, for refusals
/// Fails   SceneError: the mesh is not closed, or has too many vertices
SoftModel soft_model_of(const wire::SoftBody& body, const geometry::ContactMesh* mesh, const SceneField& field);

/// Returns a note for the operator: the number of nodes, and the rate of soft steps.
std::string soft_note(const SoftModel& model, const wire::Scene& scene);

/// Returns the settings of the soft world. Its `tools` contain the tools of the scene, followed by all bodies in scene
/// order. SoftWorld::advance() gets one pose for each of them. Static bodies are listed in `obstacles`, so the poses of
/// their entries have no effect.
SoftWorldSettings soft_world_settings(const LoadedScene& scene);

}  // namespace tandem::server
