// What the local model was at each of the client's last inputs: what the server's answers are compared with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/model/reconciler.hpp"
#include "common/base/ids.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// A moving body at one input.
struct BodyThen {
  RigidState state;
  Shift given;               ///< by its reconciler so far
  bool is_implicit = false;  ///< the model moved it by itself, and not after the server
};

/// The model after the tick of one input.
struct ModelThen {
  Tick input;
  RigidState tool;
  Shift tool_given;
  Wrench on_hand_W;
};

/// A ring of as many inputs as the longest round trip has.
///
/// Thread  haptic: allocates only when constructed
class InputHistory {
 public:
  InputHistory(std::size_t inputs, std::size_t bodies)
      : bodies_(bodies), models_(inputs), body_states_(inputs * bodies) {}

  /// Room for the newest input: fill both in.
  ModelThen& add(Tick input) noexcept {
    ModelThen& model = models_[slot_of(input)];
    model.input = input;
    return model;
  }
  std::span<BodyThen> bodies(Tick input) noexcept {
    return std::span(body_states_).subspan(slot_of(input) * bodies_, bodies_);
  }
  /// Null when the input is not known any more, or not yet.
  const ModelThen* find(Tick input) const noexcept {
    const ModelThen& model = models_[slot_of(input)];
    return input.value != 0 && model.input == input ? &model : nullptr;
  }
  void forget() noexcept {
    for (ModelThen& model : models_) model.input = Tick{};
  }

 private:
  std::size_t slot_of(Tick input) const noexcept { return static_cast<std::size_t>(input.value % models_.size()); }

  std::size_t bodies_;
  std::vector<ModelThen> models_;
  std::vector<BodyThen> body_states_;
};

}  // namespace tandem::client
