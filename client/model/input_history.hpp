// History of the local model at the client's last inputs, with which the server's answers are compared.
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
  Shift given;               ///< total correction by its reconciler until then
  bool is_implicit = false;  ///< moved by the model, not by the server's states
};

/// State of the model after the tick of one input.
struct ModelThen {
  Tick input;
  RigidState tool;
  Shift tool_given;
  Wrench on_hand_W;
};

/// Ring buffer that covers the longest round trip.
///
/// Thread  haptic: allocates only when constructed
class InputHistory {
 public:
  InputHistory(std::size_t inputs, std::size_t bodies)
      : bodies_(bodies), models_(inputs), body_states_(inputs * bodies) {}

  /// Allocates the entry of the newest input; the caller must fill in it and its bodies.
  ModelThen& add(Tick input) noexcept {
    ModelThen& model = models_[slot_of(input)];
    model.input = input;
    return model;
  }
  std::span<BodyThen> bodies(Tick input) noexcept {
    return std::span(body_states_).subspan(slot_of(input) * bodies_, bodies_);
  }
  /// Entry of an input; null if it is too old or not yet added.
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
