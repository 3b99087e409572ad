#include "client/model/local_model_maker.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/realtime/realtime.hpp"

namespace tandem::client {

void LocalModelMaker::begin(const wire::Joined& joined, const AssetMap& assets) {
  problem_.clear();
  const auto make = [settings = settings_, joined, assets, is_thread = execution_ == Execution::kThread] {
    // The thread comes with the priority of the one that started it: a second of work there would starve the sockets.
    if (is_thread) realtime::drop_realtime();
    Made made;
    LocalWorld world = make_local_world(joined, assets);
    made.problem = std::move(world.problem);
    if (world.description) made.model = std::make_unique<LocalModel>(world.description, world.tool, settings);
    return made;
  };
  const auto policy = execution_ == Execution::kThread ? std::launch::async : std::launch::deferred;
  // A future that is replaced waits for its thread: at most for one model.
  making_ = std::async(policy, make);
  if (execution_ == Execution::kInline) making_.wait();
}

LocalModel* LocalModelMaker::take() {
  if (!making_.valid() || making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
  Made made = making_.get();
  problem_ = std::move(made.problem);
  if (!made.model) return nullptr;
  std::move_backward(models_.begin(), models_.end() - 1, models_.end());
  models_[0] = std::move(made.model);
  return models_[0].get();
}

}  // namespace tandem::client
