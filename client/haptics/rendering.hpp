// A rendering: a stage together with its model, handed over to the haptic thread as one object.
#pragma once

#include <cstdint>
#include <memory>

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

struct Rendering {
  Rendering();
  ~Rendering();
  Rendering(const Rendering&) = delete;
  Rendering& operator=(const Rendering&) = delete;

  std::unique_ptr<Stage> stage;             ///< never null once the rendering has been offered
  std::uint32_t generation = 0;             ///< generation of the scene to which the models belong
  std::unique_ptr<LocalModel> local_model;  ///< null if the stage has no local model
  std::unique_ptr<ProxyWorld> proxy_world;  ///< ball and obstacles of stage "god-object"; null for other stages
};

}  // namespace tandem::client
