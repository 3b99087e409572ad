#include "lab/recording/recorded_complex.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/docking/atom_contacts.hpp"
#include "common/docking/exact_field.hpp"
#include "lab/recording/session_replay.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "server/assets/structures/structure_writer.hpp"

namespace tandem::lab {
namespace {

/// Searches a recording for the requested states, and loads the scene of its room.
class Search {
 public:
  Search(std::optional<Duration> at, const std::filesystem::path& scene_file) : at_(at), scene_file_(scene_file) {}

  bool receive(const std::string& topic, const recording::Message& message) {
    if (begun_ns_ == 0) begun_ns_ = message.log_ns;
    if (topic == "/room") return begin(message);
    if (topic != "/states" || scene == nullptr) return true;
    wire::RecordedStates states;
    proto::require_recorded(message, states);
    for (const wire::RecordedBody& body : states.bodies()) {
      newest_[body.id()] = proto::read_exact(body.state()).X;
    }
    const Duration since(static_cast<Duration::rep>(message.log_ns - begun_ns_));
    if (at_ && since > *at_) return false;
    if (!at_ && states.field_energy_kj_per_mol() >= least_kj_per_mol_) return true;
    least_kj_per_mol_ = states.field_energy_kj_per_mol();
    poses = newest_;
    found = since;
    return true;
  }

  std::shared_ptr<const server::LoadedScene> scene;
  std::map<std::uint32_t, Pose> poses;  ///< pose X_WB of each body, by its index
  std::optional<Duration> found;

 private:
  bool begin(const recording::Message& message) {
    if (scene != nullptr) return true;  // the start record of a continuation file repeats the first one
    wire::RecordedRoom recorded;
    proto::require_recorded(message, recorded);
    scene = recorded_scene(recorded, scene_file_);
    for (std::size_t i = 0; i < scene->world.bodies.size(); ++i) {
      newest_[body_id_at(i).value] = scene->world.bodies[i].X_WB;
    }
    return true;
  }

  std::optional<Duration> at_;
  const std::filesystem::path& scene_file_;
  std::uint64_t begun_ns_ = 0;
  std::map<std::uint32_t, Pose> newest_;
  double least_kj_per_mol_ = std::numeric_limits<double>::infinity();
};

/// Returns the indices of the first two bodies that have a molecule.
std::vector<std::size_t> molecules_of(const server::LoadedScene& scene) {
  std::vector<std::size_t> bodies;
  for (std::size_t i = 0; i < scene.world.bodies.size(); ++i) {
    if (scene.world.bodies[i].molecule != nullptr) bodies.push_back(i);
  }
  if (bodies.size() < 2) {
    throw std::invalid_argument("scene " + scene.description.name() + " has fewer than two molecules to be saved");
  }
  return {bodies[0], bodies[1]};
}

}  // namespace

boost::json::object save_recorded_complex(const std::filesystem::path& recording, std::optional<Duration> at,
                                          const std::filesystem::path& scene_file, const std::filesystem::path& file) {
  server::check_complex_name(file);
  if (std::filesystem::exists(file))
    throw std::invalid_argument(file.string() + " is there already; give another name");
  Search search(at, scene_file);
  proto::read_recording(
      recording, [&search](const std::string& topic, const auto& message) { return search.receive(topic, message); });
  if (search.scene == nullptr) {
    throw std::invalid_argument(recording.string() + " is no recording of a room; name one of tandem-server --record");
  }
  if (!search.found) throw std::invalid_argument(recording.string() + " has no states by then; give a later time");
  const server::LoadedScene& scene = *search.scene;
  const std::vector<std::size_t> bodies = molecules_of(scene);
  const docking::Molecule receptor = server::molecule_in_its_file(scene, bodies[0]),
                          ligand = server::molecule_in_its_file(scene, bodies[1]);
  const auto pose = [&](std::size_t i) {
    Pose X = search.poses.at(body_id_at(bodies[i]).value);
    X.p /= scene.world.metres_per_angstrom;
    return X * Pose{-scene.molecule_centres_angstrom[bodies[i]], Quat::Identity()};
  };
  const Pose X_AB = pose(0).inverse() * pose(1);
  const docking::FieldResult result = docking::exact_field(receptor, ligand, X_AB, scene.world.field_model);
  const double rmsd = docking::rmsd_angstrom(ligand, X_AB, Pose{}), t_s = to_seconds(*search.found);
  std::vector<std::string> remarks = server::energy_remarks(result, scene.world.field_model);
  remarks.insert(remarks.begin(), recording.filename().string() + " at " + std::to_string(t_s) + " s");
  server::save_complex(file, receptor, ligand, X_AB, remarks);
  return {{"t_s", t_s},
          {"lj_kj_mol", result.lennard_jones_kj_per_mol},
          {"coulomb_kj_mol", result.coulomb_kj_per_mol},
          {"total_kj_mol", result.energy_kj_per_mol()},
          {"rmsd_angstrom", rmsd},
          {"saved", file.string()}};
}

}  // namespace tandem::lab
