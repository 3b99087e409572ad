#include "server/docking/kept_pose_files.hpp"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "common/base/folders.hpp"
#include "common/docking/exact_field.hpp"
#include "server/assets/scene_hash.hpp"
#include "server/assets/structures/structure_writer.hpp"
#include "tandem/checkpoint.pb.h"

namespace tandem::server {
namespace {

constexpr std::uintmax_t kMaxListBytes = 1U << 20U;
constexpr int kPoseNumbers = 7;
/// Upper limit of pose numbers: more than a room can use, and far below the limit of the type.
constexpr std::uint32_t kMaxNumber = 1'000'000'000;
constexpr std::array kStructureEndings{".cif", ".pdb"};

/// Puts a CSV field in quotes. Control characters need no escape, because names do not contain any.
std::string csv_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

/// Returns the code of a character as two hexadecimal digits.
std::string hex_of(char c) {
  std::ostringstream text;
  text << std::hex << std::setw(2) << std::setfill('0') << static_cast<int>(static_cast<unsigned char>(c));
  return text.str();
}

std::string file_name(const std::string& room) {
  std::string name;
  for (const char c : room) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
    name += is_plain ? std::string(1, c) : "%" + hex_of(c);
  }
  return name;
}

std::string csv(const std::vector<wire::KeptPose>& poses) {
  std::ostringstream text;
  text << "number,kept_unix_ms,name,user,lj_kj_mol,coulomb_kj_mol,total_kj_mol,rmsd_angstrom,contacts,hydrogen_bonds,"
          "x_angstrom,y_angstrom,z_angstrom,qw,qx,qy,qz\n"
       << std::setprecision(12);
  for (const wire::KeptPose& pose : poses) {
    text << pose.number() << ',' << pose.kept_ms() << ',' << csv_text(pose.name()) << ',' << csv_text(pose.user_name())
         << ',' << pose.lj_kj_per_mol() << ',' << pose.coulomb_kj_per_mol() << ','
         << pose.lj_kj_per_mol() + pose.coulomb_kj_per_mol() << ',' << pose.rmsd_angstrom() << ',' << pose.contacts()
         << ',' << pose.hydrogen_bonds();
    for (const double number : pose.in_first()) text << ',' << number;
    text << '\n';
  }
  return text.str();
}

/// Number in a file name NUMBER.cif or NUMBER.pdb; 0 for other names.
std::uint32_t number_of(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  if (std::ranges::find(kStructureEndings, file.extension().string()) == kStructureEndings.end()) return 0;
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool is_whole = error == std::errc{} && end == stem.data() + stem.size() && std::to_string(number) == stem;
  return is_whole ? number : 0;
}

void replace_text(const std::filesystem::path& file, const std::string& text) {
  const std::error_code error = replace_file(file, {std::as_bytes(std::span(text))});
  if (error) throw std::runtime_error(error.message());
}

}  // namespace

std::string kept_pose_folder(const Room& room) {
  return file_name(room.name()) + "-" + proto::hex(hash_of(room.scene())).substr(0, 8);
}

std::optional<Pose> in_first(const wire::KeptPose& pose) {
  const auto& in = pose.in_first();
  if (in.size() != kPoseNumbers) return std::nullopt;
  const Pose X{{in[0], in[1], in[2]}, Quat(in[3], in[4], in[5], in[6])};
  if (!docking::is_evaluable(X)) return std::nullopt;
  return X;
}

std::optional<KeptPoseList> read_kept_poses(const std::filesystem::path& folder) {
  KeptPoseList list;
  const std::filesystem::path file = folder / "poses.json";
  std::error_code error;
  if (folder.empty() || !std::filesystem::exists(file, error)) return list;
  if (std::filesystem::file_size(file, error) > kMaxListBytes || error) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  wire::KeptPoses written;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  if (!google::protobuf::util::JsonStringToMessage(text, &written, options).ok()) return std::nullopt;
  for (const wire::KeptPose& pose : written.poses()) {
    const bool is_next = pose.number() >= list.next_number && pose.number() < kMaxNumber;
    if (list.poses.size() == kMaxKeptPoses || !is_next || !in_first(pose)) return std::nullopt;
    list.poses.push_back(pose);
    list.next_number = pose.number() + 1;
  }
  if (written.next_number() > kMaxNumber) return std::nullopt;
  list.next_number = std::max(list.next_number, written.next_number());
  return list;
}

void write_kept_poses(const std::filesystem::path& folder, const KeptPoseList& list) {
  wire::KeptPoses written;
  written.mutable_poses()->Assign(list.poses.begin(), list.poses.end());
  written.set_next_number(list.next_number);
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(written, &json, options).ok())
    throw std::runtime_error("a name in them is no UTF-8");
  replace_text(folder / "poses.csv", csv(list.poses));
  replace_text(folder / "poses.json", json);
}

void save_kept_pose(const std::filesystem::path& folder, const wire::KeptPose& pose, const std::string& room,
                    const LoadedScene& scene, BodyId first, BodyId second) {
  const std::size_t a = first.value - 1, b = second.value - 1;
  const Pose X_files = Pose{scene.molecule_centres_angstrom[a], Quat::Identity()} * in_first(pose).value() *
                       Pose{-scene.molecule_centres_angstrom[b], Quat::Identity()};
  docking::FieldResult result;
  result.lennard_jones_kj_per_mol = pose.lj_kj_per_mol();
  result.coulomb_kj_per_mol = pose.coulomb_kj_per_mol();
  std::vector<std::string> remarks = energy_remarks(result, scene.world.field_model);
  remarks.insert(remarks.begin(), "pose " + std::to_string(pose.number()) + " of room " + room);
  // A file of this number may be left over: the list that named it was lost, or a server was killed after writing the
  // file and before writing the list.
  const auto file = [&](const char* ending) { return folder / (std::to_string(pose.number()) + ending); };
  for (const char* ending : kStructureEndings) {
    std::error_code error;
    std::filesystem::remove(file(ending), error);
  }
  const docking::Molecule in_file_a = molecule_in_its_file(scene, a), in_file_b = molecule_in_its_file(scene, b);
  save_complex(file(".cif"), in_file_a, in_file_b, X_files, remarks);
  try {
    save_complex(file(".pdb"), in_file_a, in_file_b, X_files, remarks);
  } catch (const docking::MoleculeError&) {
    // The PDB format cannot represent these molecules. They are then only in the .cif file.
  }
}

void remove_deleted_poses(const std::filesystem::path& folder, const KeptPoseList& list) {
  std::error_code error;
  std::vector<std::filesystem::path> deleted;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::uint32_t number = number_of(entry->path());
    const bool was_used = number > 0 && number < list.next_number;
    const bool is_kept = std::ranges::find(list.poses, number, &wire::KeptPose::number) != list.poses.end();
    if (was_used && !is_kept) deleted.push_back(entry->path());
  }
  for (const std::filesystem::path& file : deleted) std::filesystem::remove(file, error);
}

}  // namespace tandem::server
