// "hold": the newest wrench of the server, unchanged until the next.
#pragma once

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

class Hold final : public Stage {
 public:
  std::string_view name() const noexcept override { return "hold"; }
  StageOutput tick(const StageInput& input) noexcept override;
};

}  // namespace tandem::client
