#include "client/start/recent.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <span>
#include <string>

#include "common/base/folders.hpp"

namespace tandem::client {
namespace {

namespace json = boost::json;

constexpr std::size_t kMaxBytes = 16 * 1024;
/// Maximum length of a stored path or address. Longer ones are not stored, so that the file stays below kMaxBytes.
constexpr std::size_t kMaxText = 1024;

/// Calls `use` for each stored text field, with its name in the file.
template <class Choice, class Use>
void for_each_text(Choice& choice, const Use& use) {
  use("scene", choice.scene);
  use("mesh", choice.mesh);
  use("receptor", choice.receptor);
  use("ligand", choice.ligand);
  use("address", choice.address);
}

template <class Choice, class Use>
void for_each_flag(Choice& choice, const Use& use) {
  use("is_y_up", choice.is_y_up);
  use("is_movable", choice.is_movable);
  use("is_hosted", choice.is_hosted);
}

/// Returns a copy of the choice with only those fields that its kind uses. The remaining fields may contain private
/// paths of earlier choices.
StartChoice essence(const StartChoice& choice) {
  StartChoice stored{.kind = choice.kind};
  switch (choice.kind) {
    case StartChoice::Kind::kScene:
      stored.scene = choice.scene;
      break;
    case StartChoice::Kind::kMesh:
      stored.mesh = choice.mesh;
      stored.mesh_size_m = choice.mesh_size_m;
      stored.is_y_up = choice.is_y_up;
      stored.is_movable = choice.is_movable;
      break;
    case StartChoice::Kind::kDock:
      stored.receptor = choice.receptor;
      stored.ligand = choice.ligand;
      break;
    case StartChoice::Kind::kJoin:
      stored.address = choice.address;
      return stored;
  }
  if (!choice.is_hosted) return stored;
  stored.is_hosted = true;
  stored.invited = choice.invited;
  stored.port = choice.port;
  return stored;
}

bool is_storable(const StartChoice& choice) {
  bool fits = true;
  for_each_text(choice, [&fits](const char*, const std::string& text) {
    fits = fits && text.size() <= kMaxText && is_utf8(text);
  });
  return fits && problem_of(choice).empty() &&
         (choice.kind != StartChoice::Kind::kJoin || !join_target(choice.address).invitation);
}

json::object json_of(const StartChoice& choice) {
  json::object object{{"kind", StartChoice::kKindNames.at(static_cast<std::size_t>(choice.kind))},
                      {"mesh_size_m", choice.mesh_size_m},
                      {"invited", choice.invited},
                      {"port", choice.port}};
  for_each_text(choice, [&object](const char* name, const std::string& text) { object[name] = text; });
  for_each_flag(choice, [&object](const char* name, bool is_on) { object[name] = is_on; });
  return object;
}

std::optional<StartChoice> choice_of(const json::value& value) {
  const json::object* const object = value.if_object();
  if (object == nullptr) return std::nullopt;
  StartChoice choice;
  const json::value* const kind = object->if_contains("kind");
  const auto found = std::ranges::find_if(StartChoice::kKindNames, [kind](const char* name) {
    return kind != nullptr && kind->is_string() && kind->get_string() == name;
  });
  if (found == StartChoice::kKindNames.end()) return std::nullopt;
  choice.kind = static_cast<StartChoice::Kind>(found - StartChoice::kKindNames.begin());
  for_each_text(choice, [object](const char* name, std::string& text) {
    const json::value* const stored = object->if_contains(name);
    if (stored != nullptr && stored->is_string()) text = stored->get_string();
  });
  for_each_flag(choice, [object](const char* name, bool& is_on) {
    const json::value* const stored = object->if_contains(name);
    if (stored != nullptr && stored->is_bool()) is_on = stored->get_bool();
  });
  const auto number = [object](const char* name, double low, double high, double otherwise) {
    const json::value* const stored = object->if_contains(name);
    if (stored == nullptr || !stored->is_number()) return otherwise;
    return std::clamp(stored->to_number<double>(), low, high);
  };
  choice.mesh_size_m = number("mesh_size_m", kMinMeshSize_m, kMaxMeshSize_m, choice.mesh_size_m);
  choice.invited = static_cast<int>(number("invited", 1, kMaxInvited, choice.invited));
  choice.port = static_cast<int>(number("port", 0, 65535, choice.port));
  return essence(choice);
}

}  // namespace

std::filesystem::path state_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state == '/') {
    return std::filesystem::path(state) / "tandem";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/') {
    return std::filesystem::path(home) / ".local/state/tandem";
  }
  return {};
}

json::value read_state(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text(kMaxBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  json::error_code error;
  json::value value = text.size() > kMaxBytes ? json::value() : json::parse(text, error);
  return error ? json::value() : value;
}

std::filesystem::path recent_file() {
  const std::filesystem::path folder = state_folder();
  return folder.empty() ? folder : folder / "recent.json";
}

std::vector<StartChoice> recent_choices(const std::filesystem::path& file) {
  std::vector<StartChoice> choices;
  const json::value value = read_state(file);
  const json::array* const array = value.if_array();
  if (array == nullptr) return choices;
  for (const json::value& each : *array) {
    const std::optional<StartChoice> choice = choice_of(each);
    if (choice && choices.size() < kMaxRecent && problem_of(*choice).empty()) choices.push_back(*choice);
  }
  return choices;
}

void remember_choice(const std::filesystem::path& file, const StartChoice& choice) {
  const StartChoice stored = essence(choice);
  if (file.empty() || !is_storable(stored)) return;
  std::vector<StartChoice> choices = recent_choices(file);
  std::erase(choices, stored);
  choices.insert(choices.begin(), stored);
  choices.resize(std::min(choices.size(), kMaxRecent));
  json::array array;
  for (const StartChoice& each : choices) array.push_back(json_of(each));
  // Entries with long paths may exceed together the size limit kMaxBytes for reading the file. In this case, the oldest
  // entries are dropped.
  while (array.size() > 1 && json::serialize(array).size() >= kMaxBytes) array.pop_back();
  const std::string text = json::serialize(array) + "\n";
  replace_file(file, {std::as_bytes(std::span(text))}, 0600);
}

}  // namespace tandem::client
