// See window_memory.hpp.
#include "client/view/window_memory.hpp"

#include <algorithm>
#include <boost/json.hpp>
#include <span>
#include <string>

#include "client/start/recent.hpp"
#include "common/base/folders.hpp"

namespace tandem::client {
namespace {

namespace json = boost::json;

/// Calls `use` for each switch, with its name in the file.
template <class Switches, class Use>
void for_each_switch(Switches& switches, const Use& use) {
  use("shows_panels", switches.shows_panels);
  use("shows_ghosts", switches.shows_ghosts);
  use("shows_contacts", switches.shows_contacts);
  use("follows_tool", switches.follows_tool);
  use("cuts", switches.cuts);
  use("has_sound", switches.has_sound);
  for (std::size_t i = 0; i < switches.is_open.size(); ++i) {
    use(("part_" + std::to_string(i) + "_is_open").c_str(), switches.is_open[i]);
  }
}

std::string_view text_of(const json::object& object, const char* field) {
  const json::value* const stored = object.if_contains(field);
  return stored != nullptr && stored->is_string() ? std::string_view(stored->get_string()) : std::string_view();
}

bool flag_of(const json::object& object, const char* field) {
  const json::value* const stored = object.if_contains(field);
  return stored != nullptr && stored->is_bool() && stored->get_bool();
}

}  // namespace

std::filesystem::path window_memory_file() {
  const std::filesystem::path folder = state_folder();
  return folder.empty() ? folder : folder / "window.json";
}

WindowSwitches remembered_switches(const std::filesystem::path& file) {
  WindowSwitches switches;
  const json::value value = read_state(file);
  const json::object* const object = value.if_object();
  if (object == nullptr) return switches;
  for_each_switch(switches, [object](const char* name, bool& is_on) {
    const json::value* const stored = object->if_contains(name);
    if (stored != nullptr && stored->is_bool()) is_on = stored->get_bool();
  });
  if (const json::value* const stored = object->if_contains("cut_share"); stored != nullptr && stored->is_number()) {
    switches.cut_share = std::clamp(stored->to_number<double>(), 0.0, 1.0);
  }
  switches.guide.is_on = flag_of(*object, "guide_is_on");
  apply_named(text_of(*object, "guide_step"), kGuideStepNames, switches.guide.step);
  apply_named(text_of(*object, "molecules"), MoleculeStyle::kShapeNames, switches.molecules.shape);
  apply_named(text_of(*object, "molecule_colors"), MoleculeStyle::kColorNames, switches.molecules.colors);
  return switches;
}

void remember_switches(const std::filesystem::path& file, const WindowSwitches& switches) {
  json::object object;
  for_each_switch(switches, [&object](const char* name, const bool& is_on) { object[name] = is_on; });
  object["cut_share"] = switches.cut_share;
  object["guide_is_on"] = switches.guide.is_on;
  object["guide_step"] = kGuideStepNames.at(static_cast<std::size_t>(switches.guide.step));
  object["molecules"] = MoleculeStyle::kShapeNames.at(switches.molecules.shape);
  object["molecule_colors"] = MoleculeStyle::kColorNames.at(switches.molecules.colors);
  if (file.empty()) return;
  const std::string text = json::serialize(object) + "\n";
  replace_cache_file(file, {std::as_bytes(std::span(text))});
}

}  // namespace tandem::client
