// Converts the soft bodies of a scene file into settings of the soft world.
#pragma once

#include "server/assets/scene_file.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

/// Returns the soft body at rest that a scene file describes.
/// In      mesh   mesh of a mesh body; null for a block
///         field  location of the body in the file, for refusals
/// Fails   SceneError: the mesh is not closed, or has too many vertices
SoftModel soft_model_of(const wire::SoftBody& body, const geometry::ContactMesh* mesh, const SceneField& field);

/// Returns a note for the operator: the number of nodes, and the rate of soft steps.
std::string soft_note(const SoftModel& model, const wire::Scene& scene);

/// Returns the settings of the soft world. Its `tools` are the tools of the scene followed by the bodies, in scene
/// order; advance() receives the poses of all. Static bodies are obstacles, so their entries in advance() have no
/// effect.
SoftWorldSettings soft_world_settings(const LoadedScene& scene);

}  // namespace tandem::server
