// Test fixture: a room with two helices as molecules, and a PoseKeeper that serves it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "server/assets/docking_scene.hpp"
#include "server/assets/scene_file.hpp"
#include "server/docking/pose_keeper.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"

namespace tandem::server {

/// Returns a scene with two helices apart from each other, which no tool holds.
/// In      static_bodies  indices of bodies to make static
inline std::shared_ptr<const LoadedScene> load_helices(const std::vector<int>& static_bodies) {
  wire::Scene scene = docking_scene(molecule_source(std::string(test::k3al1File) + ":A", ""),
                                    molecule_source(std::string(test::k3al1File) + ":B", ""), wire::MolecularField());
  for (wire::Tool& tool : *scene.mutable_tools()) tool.clear_holds();
  for (const int body : static_bodies) {
    scene.mutable_bodies(body)->clear_mass_kg();
    scene.mutable_bodies(body)->clear_graspable();
  }
  // With this scale, the molecular forces are too weak to move the helices during a test.
  scene.mutable_molecular_field()->set_newtons_per_kcal_per_mol_angstrom(1e-6);
  return load_scene_text(scene_text(scene), "helices", ".");
}

inline const std::shared_ptr<const LoadedScene>& helices() {
  static const std::shared_ptr<const LoadedScene> kScene = load_helices({});
  return kScene;
}

class PoseKeeperTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
    start(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Makes a new room with the scene and a new PoseKeeper, as a restart of the server does.
  void start(const std::filesystem::path& folder, const std::shared_ptr<const LoadedScene>& scene = helices()) {
    keeper_.reset();
    rooms_.clear();
    rooms_.push_back(std::make_unique<Room>(RoomId{1}, "a room", scene));
    keeper_ = std::make_unique<PoseKeeper>(folder, rooms_, [] { return 1'700'000'000'000ULL; });
    ASSERT_TRUE(room().post({.seat = {0, UserId{7}, UserRole::kManipulator, 0}}));
    step(1);
  }

  Room& room() { return *rooms_.front(); }

  void step(int count) {
    for (int i = 0; i < count; ++i) {
      room().step(ServerTime(room().period() * static_cast<Duration::rep>(room().steps_done().value + 1)));
    }
    keeper_->work();
  }

  /// Moves the second molecule by `by_angstrom`, then steps the room `rest_steps` times.
  void move(const Vec3& by_angstrom, int rest_steps) {
    RoomCommand command;
    command.kind = RoomCommand::Kind::kPlace;
    command.seat = {0, UserId{7}};
    command.body = BodyId{2};
    command.beside = BodyId{1};
    command.X_SB = pose();
    command.X_SB.p += helices()->world.metres_per_angstrom * by_angstrom;
    ASSERT_TRUE(room().post(command));
    for (int done = 0; done < rest_steps; done += 20) step(20);
  }

  Pose pose() { return room().world().body(BodyId{1}).X.inverse() * room().world().body(BodyId{2}).X; }

  /// Submits a request to the PoseKeeper and returns its answer. If the request moves a molecule, executes the room's
  /// kPlace command first.
  wire::ServerControl submit(wire::AskPose::Kind kind, std::uint32_t number = 0, const std::string& name = "") {
    wire::AskPose request;
    request.set_kind(kind);
    request.set_number(number);
    request.set_name(name);
    EXPECT_EQ(keeper_->submit(room(), UserId{7}, user_name_, 31, request), "");
    keeper_->work();
    return serve();
  }

  /// Returns the folder with the room's poses.json; empty if there is none.
  std::filesystem::path list_folder() const {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      if (entry.path().filename() == "poses.json") return entry.path().parent_path();
    }
    return {};
  }
  /// Returns the sorted names of the structure files.
  std::vector<std::string> structure_files() const {
    std::vector<std::string> names;
    if (!std::filesystem::exists(folder_)) return names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      const std::string ending = entry.path().extension().string();
      if (ending == ".cif" || ending == ".pdb") names.push_back(entry.path().filename().string());
    }
    std::ranges::sort(names);
    return names;
  }

  wire::ServerControl serve() {
    wire::ServerControl answered;
    keeper_->deliver([&](const Room& of, UserId user, const wire::ServerControl& answer, const RoomCommand* placing) {
      EXPECT_EQ(&of, &room());
      EXPECT_EQ(user, UserId{7});
      if (!answer.has_pose_progress()) answered = answer;
      if (placing == nullptr) return true;
      RoomCommand command = *placing;
      command.seat = {0, UserId{7}};
      return !is_busy_ && room().post(command);
    });
    step(1);
    return answered;
  }

  double apart_angstrom(const Pose& one, const Pose& other) {
    return (one.p - other.p).norm() / helices()->world.metres_per_angstrom;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("tandem_poses_" + std::to_string(::getpid()));
  std::vector<std::unique_ptr<Room>> rooms_;
  std::unique_ptr<PoseKeeper> keeper_;
  bool is_busy_ = false;
  std::string user_name_ = "ada";
};

}  // namespace tandem::server
