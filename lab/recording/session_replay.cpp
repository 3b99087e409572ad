#include "lab/recording/session_replay.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <vector>

#include "common/docking/molecular_field.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "server/assets/scene_library.hpp"
#include "server/recording/room_checkpoint.hpp"
#include "server/recording/step_codec.hpp"

namespace tandem::lab {
namespace {

using server::RoomCommand;
using server::TakenInput;

/// Passes the recorded commands and inputs of each step to a room.
class StepFeeder final : public server::RoomWatcher {
 public:
  explicit StepFeeder(server::Room& room) : room_(room) { room.watch(*this); }

  /// Passes the content of one recorded step to the room.
  /// Fails   std::invalid_argument: a value is out of range
  void feed(const wire::RecordedStep& step) {
    inputs_.clear();
    for (const wire::RecordedCommand& recorded : step.commands()) {
      const auto command = server::command_of(recorded);
      if (!command || !room_.post(*command)) refuse(step, "a command");
    }
    for (const wire::RecordedInput& recorded : step.inputs()) {
      const auto input = server::input_of(recorded);
      if (!input) refuse(step, "an input");
      inputs_.push_back(*input);
    }
  }

  void on_command(const RoomCommand& /*command*/) noexcept override {}
  /// Publishes the recorded inputs of the step. The room calls this function after it has processed the commands: a
  /// join command empties the mailbox of the user who joins, so an input published earlier would be lost.
  void on_commands_done() noexcept override {
    for (const TakenInput& input : inputs_) room_.input(input.seat).publish(input.update);
  }
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const server::Room& /*room*/, ServerTime /*now*/, TickFaults /*faults*/) noexcept override {}

 private:
  [[noreturn]] static void refuse(const wire::RecordedStep& step, const std::string& what) {
    throw std::invalid_argument("step " + std::to_string(step.step()) + " of the recording: " + what +
                                " is out of its range; the file is damaged");
  }

  server::Room& room_;
  std::vector<TakenInput> inputs_;
};

std::string thing_of(const wire::Scene& scene, const server::StateHashes& now, const wire::RecordedStep& then) {
  for (int i = 0; i < std::min(then.body_hashes_size(), static_cast<int>(now.bodies.size())); ++i) {
    if (now.bodies[static_cast<std::size_t>(i)] == then.body_hashes(i)) continue;
    const int soft = i - scene.bodies_size();
    if (soft < 0) return "body " + scene.bodies(i).name();
    return soft < scene.soft_bodies_size() ? "soft body " + scene.soft_bodies(soft).name() : "the game";
  }
  for (int i = 0; i < std::min(then.tool_hashes_size(), static_cast<int>(now.tools.size())); ++i) {
    if (now.tools[static_cast<std::size_t>(i)] != then.tool_hashes(i)) return "tool " + scene.tools(i).name();
  }
  return "the number of things";
}

bool is_equal(const server::StateHashes& now, const wire::RecordedStep& then) {
  return std::ranges::equal(now.bodies, then.body_hashes()) && std::ranges::equal(now.tools, then.tool_hashes());
}

class Replay {
 public:
  Replay(const std::filesystem::path& scene, const std::function<void(const server::Room&)>& on_step)
      : scene_(scene), on_step_(on_step) {}

  bool receive(const std::string& topic, const recording::Message& message) {
    if (topic == "/room") return begin(message);
    return topic == "/step" ? step(message) : true;
  }
  ReplayResult result() const { return result_; }

 private:
  bool begin(const recording::Message& message) {
    if (room_ != nullptr) return true;  // the start record of a continuation file repeats the first one
    wire::RecordedRoom recorded;
    if (!proto::parse_recorded(message, recorded) || recorded.part() != 1) {
      throw std::invalid_argument("this file is not the first of its recording; name that one");
    }
    result_.program = recorded.program();
    use_kernel(recorded.field_kernel());
    room_ = std::make_unique<server::Room>(
        RoomId{1}, recorded.room(), recorded_scene(recorded, scene_),
        server::RoomOptions{.controls_tool_passivity = recorded.controls_tool_passivity()});
    if (recorded.has_restored()) {
      const auto state = server::state_of(recorded.restored(), room_->scene());
      if (!state) throw std::invalid_argument("the initial state of the room is of another scene; the file is damaged");
      room_->resume(*state);
    }
    feeder_ = std::make_unique<StepFeeder>(*room_);
    return true;
  }

  void use_kernel(const std::string& kernel) {
    if (kernel.empty()) return;
    const auto kernels = docking::MolecularField::available_kernels();
    if (std::ranges::find(kernels, kernel) != kernels.end()) return docking::MolecularField::use_by_default(kernel);
    result_.note = "the molecular field was computed by the kernel " + kernel + ", which this CPU does not have";
  }

  bool step(const recording::Message& message) {
    wire::RecordedStep recorded;
    if (room_ == nullptr || !proto::parse_recorded(message, recorded)) {
      throw std::invalid_argument("a step cannot be read; the file is damaged");
    }
    const std::uint64_t next = room_->steps_done().value + 1;
    if (recorded.step() != next) {
      result_.missing_step = next;
      return false;
    }
    feeder_->feed(recorded);
    room_->step(ServerTime(Duration(static_cast<Duration::rep>(recorded.stepped_server_ns()))));
    ++result_.steps;
    result_.commands += static_cast<std::uint64_t>(recorded.commands_size());
    result_.inputs += static_cast<std::uint64_t>(recorded.inputs_size());
    if (on_step_) on_step_(*room_);
    if ((recorded.tick_faults() & kFaultSoftLate) != 0 && result_.note.empty()) {
      result_.note = "in step " + std::to_string(next) + " a soft body was late, which is not played back";
    }
    const server::StateHashes now = server::hashes_of(*room_);
    if (is_equal(now, recorded)) return true;
    result_.differs_at_step = next;
    result_.differing_thing = thing_of(room_->scene().description, now, recorded);
    return false;
  }

  const std::filesystem::path& scene_;
  const std::function<void(const server::Room&)>& on_step_;
  ReplayResult result_;
  std::unique_ptr<server::Room> room_;
  std::unique_ptr<StepFeeder> feeder_;
};

}  // namespace

std::shared_ptr<const server::LoadedScene> recorded_scene(const wire::RecordedRoom& recorded,
                                                          const std::filesystem::path& instead) {
  const std::string named = instead.empty() ? recorded.scene_file() : instead.string();
  if (named.empty()) throw std::invalid_argument("the recording names no scene file; give it by --scene");
  const auto scene = server::load_scene(server::find_scene(named, server::scene_folders()));
  if (scene->description.SerializeAsString() != recorded.scene().SerializeAsString()) {
    throw std::invalid_argument("scene " + named + " is not as it was recorded; give the recorded file by --scene");
  }
  const auto is_same = [](const server::Asset& asset, const wire::AssetInfo& then) {
    const auto* const hash = reinterpret_cast<const char*>(asset.sha256.data());
    return then.sha256() == std::string_view(hash, asset.sha256.size());
  };
  if (!std::ranges::equal(scene->assets, recorded.assets(), is_same)) {
    throw std::invalid_argument("scene " + named + ": a mesh or structure is not as it was recorded");
  }
  return scene;
}

ReplayResult replay_session(const std::filesystem::path& recording, const std::filesystem::path& scene,
                            const std::function<void(const server::Room&)>& on_step) {
  Replay replay(scene, on_step);
  const proto::RecordingEnd end = proto::read_recording(
      recording, [&replay](const std::string& topic, const auto& message) { return replay.receive(topic, message); });
  ReplayResult result = replay.result();
  if (result.steps == 0 && !result.missing_step && !result.differs_at_step && result.program.empty()) {
    throw std::invalid_argument(recording.string() + " is no recording of a room; name one of tandem-server --record");
  }
  result.is_whole = end.is_whole;
  return result;
}

}  // namespace tandem::lab
