// What the hand is shown with, handed over to the haptic thread as one: a stage, and of the scene what that stage steps.
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

  std::unique_ptr<Stage> stage;             ///< never null once it is handed over
  std::uint32_t generation = 0;             ///< of the scene that the next two are of; in another they are not used
  std::unique_ptr<LocalModel> local_model;  ///< null: none
  std::unique_ptr<ProxyWorld> proxy_world;  ///< likewise
};

}  // namespace tandem::client
