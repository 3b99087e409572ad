// History of the local model's state at the client's last inputs, for comparison with the server's answers to these
// inputs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/model/reconciler.hpp"
#include "common/base/ids.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// State of a movable body in the model at one input.
struct BodyThen {
  RigidState state;
  Shift given;               ///< sum of all corrections that the body's reconciler had made up to this input
  bool is_implicit = false;  ///< true: the model moved the body; false: the body followed the server's states
};

/// State of the model after the tick of one input.
struct ModelThen {
  Tick input;
  RigidState tool;
  Shift tool_given;
  Wrench on_hand_W;
};

/// Ring buffer with the model's state at each of the last inputs. Its length limits the round trip at which the model
/// can be reconciled.
///
/// Thread  haptic: allocates only when constructed
class InputHistory {
 public:
  InputHistory(std::size_t inputs, std::size_t bodies)
      : bodies_(bodies), models_(inputs), body_states_(inputs * bodies) {}

  /// Adds an entry for the newest input and returns it. The caller must fill in this entry and bodies(input).
  ModelThen& add(Tick input) noexcept {
    ModelThen& model = models_[slot_of(input)];
    model.input = input;
    return model;
  }
  std::span<BodyThen> bodies(Tick input) noexcept {
    return std::span(body_states_).subspan(slot_of(input) * bodies_, bodies_);
  }
  /// Returns the entry of an input; null if the input is too old or not yet added.
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
