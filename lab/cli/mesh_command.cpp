// `tandem-lab mesh`: reports how mesh files are interpreted and which files of a folder can be loaded.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/view/png_file.hpp"
#include "common/base/json_pretty.hpp"
#include "common/contact/round/too_thin.hpp"
#include "lab/cli/commands.hpp"
#include "lab/studies/contact/mesh_facts.hpp"
#include "server/assets/mesh_file.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;
namespace fs = std::filesystem;

constexpr int kPicturePixels = 640;
const std::set<std::string> kFormats{"3ds", "dae", "glb", "gltf", "obj", "off", "ply", "stl"};

struct MeshOptions {
  std::vector<std::string> files;
  std::vector<std::string> folders;
  std::string picture;
  std::string up = "z";
  double largest_size_m = 0;
  double scale = 1;
  bool prints_json = false;
};

std::string format_of(const fs::path& file) {
  std::string text = file.extension().string();
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text.empty() ? text : text.substr(1);
}

/// Returns a warning if a wall is too thin for the pressing force of a hand; otherwise an empty text.
std::string why_too_thin(const MeshFacts& facts) {
  return facts.thinnest_wall_m > 0 ? contact::why_too_thin(facts.thinnest_wall_m / 2) : std::string();
}

json::object json_of(const std::string& file, const MeshFacts& facts) {
  json::array parts;
  for (const geometry::PartReport& part : facts.mesh.parts) {
    parts.emplace_back(json::object{{"kind", part.kind == geometry::SurfaceKind::kSolid ? "solid" : "sheet"},
                                    {"triangles", part.triangles},
                                    {"parts", part.parts},
                                    {"volume_m3", part.volume_m3},
                                    {"holes", part.holes},
                                    {"why", part.why}});
  }
  json::array notes;
  for (const std::string& note : facts.mesh.notes) notes.emplace_back(note);
  return {{"file", file},
          {"size_units", {facts.size_units.x(), facts.size_units.y(), facts.size_units.z()}},
          {"scale_m", facts.scale_m},
          {"doubt", facts.doubt},
          {"size_m", {facts.size_m.x(), facts.size_m.y(), facts.size_m.z()}},
          {"parts", std::move(parts)},
          {"volume_m3", facts.volume_m3},
          {"overlap_share", facts.overlap_share},
          {"is_watertight", facts.is_watertight},
          {"thinnest_wall_m", facts.thinnest_wall_m > 0 ? json::value(facts.thinnest_wall_m) : json::value()},
          {"resolution_m", facts.resolution_m},
          {"too_thin", why_too_thin(facts)},
          {"notes", std::move(notes)}};
}

/// Returns a text with the size stated in the file and the resulting size in metres.
std::string size_text(const std::string& file, const MeshFacts& facts) {
  const bool is_stated = server::states_unit(file);
  const Vec3 size_mm = facts.size_m * 1e3;
  std::ostringstream text;
  text << std::setprecision(4) << facts.size_units.x() << " x " << facts.size_units.y() << " x " << facts.size_units.z()
       << (is_stated ? " m by the unit that the file states" : " units in the file") << ", here " << size_mm.x()
       << " x " << size_mm.y() << " x " << size_mm.z() << " mm";
  if (!is_stated || facts.scale_m != 1) {
    text << " (" << (is_stated ? "a metre of it" : "a unit") << " is " << facts.scale_m
         << " m: --scale or --largest-size)";
  }
  return text.str();
}

void print(const std::string& file, const MeshFacts& facts) {
  std::printf("%s: %s\n", file.c_str(), size_text(file, facts).c_str());
  for (const std::string& line : geometry::part_lines(facts.mesh)) std::printf("  %s\n", line.c_str());
  for (const std::string& note : facts.mesh.notes) std::printf("  note: %s\n", note.c_str());
  std::printf("  volume %.4g cm³%s, %s\n", facts.volume_m3 * 1e6,
              facts.overlap_share > 0 ? " (overlaps count twice)" : "",
              facts.is_watertight ? "watertight" : "not watertight");
  if (facts.mesh.kind != geometry::SurfaceKind::kSolid) return;
  if (const std::string why = why_too_thin(facts); !why.empty())
    std::printf("  warning: its thinnest part %s\n", why.c_str());
  if (facts.thinnest_wall_m <= 0) {
    std::printf("  no wall: no two of its faces are opposite\n");
    return;
  }
  std::printf("  thinnest wall %.3g mm, but for 2 %% of the surface; resolution %.3g mm%s\n",
              facts.thinnest_wall_m * 1e3, facts.resolution_m * 1e3,
              facts.thinnest_wall_m < 2 * facts.resolution_m ? ": walls thinner than two cells are felt softer" : "");
}

MeshScale scale_of(const MeshOptions& options) {
  return {.scale = options.scale, .largest_size_m = options.largest_size_m, .y_is_up = options.up == "y"};
}

/// Statistics of the files of a folder, by file format: the number of files with triangles that were loaded, and the
/// reasons why other files were refused.
struct Tally {
  std::map<std::string, int> loaded;
  std::map<std::string, std::vector<std::string>> refused;
};

Tally tally_of(const std::vector<std::string>& folders, const MeshOptions& options) {
  Tally tally;
  std::vector<fs::path> files;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file() && kFormats.contains(format_of(entry.path()))) files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    std::fprintf(stderr, "\r%zu of %zu", static_cast<std::size_t>(&file - files.data()) + 1, files.size());
    try {
      mesh_facts(file, scale_of(options), [](const std::string&) {});
      ++tally.loaded[format_of(file)];
    } catch (const std::exception& error) {
      tally.refused[format_of(file)].push_back(error.what());
    }
  }
  std::fprintf(stderr, "\n");
  return tally;
}

void print(const Tally& tally) {
  std::printf("| format | loaded | refused |\n| --- | --- | --- |\n");
  for (const std::string& format : kFormats) {
    const auto loaded = tally.loaded.find(format);
    const auto refused = tally.refused.find(format);
    std::printf("| %s | %d | %zu |\n", format.c_str(), loaded == tally.loaded.end() ? 0 : loaded->second,
                refused == tally.refused.end() ? 0 : refused->second.size());
  }
  std::printf("\n");
  for (const auto& [format, lines] : tally.refused) {
    for (const std::string& line : lines) std::printf("* %s\n", line.c_str());
  }
}

json::object json_of(const Tally& tally) {
  json::array formats, refusals;
  for (const std::string& format : kFormats) {
    const auto loaded = tally.loaded.find(format);
    const auto refused = tally.refused.find(format);
    formats.emplace_back(json::object{{"format", format},
                                      {"loaded", loaded == tally.loaded.end() ? 0 : loaded->second},
                                      {"refused", refused == tally.refused.end() ? 0 : refused->second.size()}});
    if (refused == tally.refused.end()) continue;
    for (const std::string& why : refused->second) refusals.emplace_back(why);
  }
  return {{"formats", std::move(formats)}, {"refusals", std::move(refusals)}};
}

void check(const MeshOptions& options) {
  if (options.files.empty() && options.folders.empty()) {
    throw std::invalid_argument("mesh needs a mesh file, or --all with a folder of them; see tandem-lab mesh --help");
  }
  if (!options.picture.empty() && options.files.size() != 1) {
    throw std::invalid_argument("--picture is of one mesh file, but there are " + std::to_string(options.files.size()) +
                                "; give them one by one");
  }
  for (const std::string& folder : options.folders) {
    if (!fs::is_directory(folder)) throw std::invalid_argument("--all " + folder + " is not a folder");
  }
}

void run_mesh(const MeshOptions& options) {
  check(options);
  json::array all;
  for (const std::string& file : options.files) {
    const auto warn = [&file](const std::string& text) {
      std::fprintf(stderr, "%s: warning: %s\n", file.c_str(), text.c_str());
    };
    const MeshFacts facts = mesh_facts(file, scale_of(options), warn);
    if (options.prints_json) {
      all.emplace_back(json_of(file, facts));
    } else {
      print(file, facts);
    }
    if (options.picture.empty()) continue;
    client::write_png(options.picture, picture_of(facts.mesh, kPicturePixels), kPicturePixels, kPicturePixels);
  }
  if (options.folders.empty()) {
    if (options.prints_json) std::cout << pretty_json(all);
    return;
  }
  const Tally tally = tally_of(options.folders, options);
  if (!options.prints_json) {
    print(tally);
    return;
  }
  json::object found = json_of(tally);
  if (!all.empty()) found["files"] = std::move(all);
  std::cout << pretty_json(found);
}

}  // namespace

void add_mesh_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MeshOptions>();
  CLI::App* const command = app.add_subcommand("mesh", "reports how mesh files are read: as solids and sheets");
  command->add_option("FILE", options->files, "mesh files: .obj, .stl, .ply, .off, .gltf, .glb, .3ds, .dae");
  command->add_option("--all", options->folders, "load every mesh file in these folders, and print a table by format");
  command->add_option("--picture", options->picture, "write a picture of the one file to this PNG file");
  CLI::Option* const scale =
      command
          ->add_option(
              "--scale", options->scale,
              "metres of a unit of the file, 0.001 for millimetres; of .dae, .gltf and .glb, which state their "
              "unit, a factor")
          ->check(CLI::Range(1e-12, 1e12))
          ->capture_default_str();
  command
      ->add_option("--largest-size", options->largest_size_m,
                   "in place of --scale: scaled until the longest edge is this [m]; 0: as --scale says")
      ->check(CLI::Range(0.0, 1000.0))
      ->excludes(scale)
      ->capture_default_str();
  command->add_option("--up", options->up, "axis that points up in files that do not state it (.obj, .stl, .ply, .off)")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  command->add_flag("--json", options->prints_json, "print JSON: a list of files, or an object with --all");
  command->callback([options, &exit_code] {
    run_mesh(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab
