// Makes a local model when a scene's assets are here: it takes up to a second for a large mesh, which neither the
// haptic thread nor the one with the sockets may wait for.
#pragma once

#include <array>
#include <future>
#include <memory>
#include <string>

#include "client/model/local_model.hpp"
#include "client/model/local_world.hpp"

namespace tandem::client {

/// Owns the models. One that was handed out lives until two others have been, by when the haptic thread has long taken
/// the scene of the next.
///
/// Thread  io; live it makes them on a thread of its own
class LocalModelMaker {
 public:
  enum class Execution { kInline, kThread };
  LocalModelMaker(const LocalModelSettings& settings, Execution execution)
      : settings_(settings), execution_(execution) {}

  /// In      joined  of a manipulator; one that is being made for an earlier scene is dropped
  void begin(const wire::Joined& joined, const AssetMap& assets);
  /// A model that has been made since the last call, or null.
  LocalModel* take();
  /// Why the last scene has none; empty when it has, or is not made yet.
  const std::string& problem() const { return problem_; }

 private:
  struct Made {
    std::unique_ptr<LocalModel> model;
    std::string problem;
  };

  LocalModelSettings settings_;
  Execution execution_;
  std::future<Made> making_;
  std::array<std::unique_ptr<LocalModel>, 3> models_;  ///< the newest first
  std::string problem_;
};

}  // namespace tandem::client
