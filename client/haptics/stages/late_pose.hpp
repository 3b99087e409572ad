// "late-pose": local coupling to the newest tool pose of the server.
#pragma once

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

/// A law whose tool is at the handle has no coupling that could be rendered here: then the server's wrench is shown, as
/// "hold" does.
class LatePose final : public Stage {
 public:
  std::string_view name() const noexcept override { return "late-pose"; }
  StageOutput tick(const StageInput& input) noexcept override;
};

}  // namespace tandem::client
