// Records which bodies a world leaves to its FreeBodies component.
#pragma once

#include <memory>
#include <set>

#include "common/physics/free_bodies.hpp"

namespace tandem::physics {

/// Indices of the bodies that the world's FreeBodies move. The touch stage moves all others.
using ExternalBodies = std::set<std::size_t>;

/// Wraps `engine`: forwards all calls to it, and updates `external`. `external` must outlive the result.
inline std::unique_ptr<FreeBodies> watched(std::unique_ptr<FreeBodies> engine, ExternalBodies& external) {
  class Watch final : public FreeBodies {
   public:
    Watch(std::unique_ptr<FreeBodies> engine, ExternalBodies& external)
        : engine_(std::move(engine)), external_(external) {}
    void add(std::size_t index, RigidBody& rigid) override {
      external_.insert(index);
      engine_->add(index, rigid);
    }
    void remove(std::size_t index) override {
      external_.erase(index);
      engine_->remove(index);
    }
    TickFaults step(double step_s) noexcept override { return engine_->step(step_s); }

   private:
    std::unique_ptr<FreeBodies> engine_;
    ExternalBodies& external_;
  };
  return std::make_unique<Watch>(std::move(engine), external);
}

}  // namespace tandem::physics
