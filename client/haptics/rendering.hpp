// A stage together with its model, handed over to the haptic thread as one object.
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

  std::unique_ptr<Stage> stage;             ///< stage of the rendering; never null once it has been offered
  std::uint32_t generation = 0;             ///< generation of the scene to which the models belong
  std::unique_ptr<LocalModel> local_model;  ///< local model; null if the stage has none
  std::unique_ptr<ProxyWorld> proxy_world;  ///< ball and obstacles; null if the stage has none
};

}  // namespace tandem::client
