// A stage with the model that it steps, handed over to the haptic thread as one object.
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

  std::unique_ptr<Stage> stage;             ///< never null after the hand-over
  std::uint32_t generation = 0;             ///< scene that the two models below belong to; not used in another scene
  std::unique_ptr<LocalModel> local_model;  ///< null: none
  std::unique_ptr<ProxyWorld> proxy_world;  ///< null: none
};

}  // namespace tandem::client
