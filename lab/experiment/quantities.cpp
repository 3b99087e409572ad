#include "lab/experiment/quantities.hpp"

#include <algorithm>
#include <numeric>
#include <span>
#include <stdexcept>

#include "common/base/json_fields.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::string_view kUserPrefix = "users.";

std::vector<std::string> divided(std::string_view text) {
  std::vector<std::string> parts{""};
  int depth = 0;
  bool is_quoted = false;
  for (const char c : text) {
    if (c == '"') is_quoted = !is_quoted;
    if (!is_quoted && (c == '[' || c == '{')) ++depth;
    if (!is_quoted && (c == ']' || c == '}')) --depth;
    if (c == ',' && depth == 0 && !is_quoted) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

json::value value_of(const std::string& text) {
  boost::json::error_code error;
  json::value value = json::parse(text, error);
  return error ? json::value(text) : value;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.size() < 6 && text.find_first_not_of("0123456789") == std::string_view::npos;
}

void flatten(const json::object& object, const std::string& prefix, std::vector<std::string>& names) {
  for (const auto& field : object) {
    const std::string name = prefix + std::string(field.key());
    if (field.value().is_object()) {
      flatten(field.value().get_object(), name + ".", names);
    } else {
      names.push_back(name);
    }
  }
}

bool is_of_a_whole_trial(const std::string& name) {
  return name != "users" && name != "name" && name != "description" && name != "scene_changes";
}

/// Converts the name of one user's quantity ("users.ben.x", "users.1.x") to the form in the list of names, "users.0.x".
std::string listed_form(const std::string& name) {
  if (!name.starts_with(kUserPrefix)) return name;
  const std::size_t dot = name.find('.', kUserPrefix.size());
  return dot == std::string::npos ? name : std::string(kUserPrefix) + "0" + name.substr(dot);
}

bool is_of_the_scene(const std::string& name) {
  return (name.starts_with("scene.") && name.size() > 6) || (name.starts_with("coupling.") && name.size() > 9);
}

/// Lists names for an error message: those of a single user if `is_of_a_user`, otherwise those of all users.
std::string listed(const std::vector<std::string>& names, bool is_of_a_user) {
  std::string text;
  for (const std::string& name : names) {
    if (name.starts_with(kUserPrefix) == is_of_a_user) text.append(text.empty() ? "" : ", ").append(name);
  }
  return is_of_a_user ? text : text + ", users.0.…";
}

json::object& object_at(json::object& object, std::string_view name) {
  json::value& value = object[name];
  if (!value.is_object()) value.emplace_object();
  return value.get_object();
}

void set_path(json::object& object, std::span<const std::string> parts, const json::value& value) {
  if (parts.size() == 1) {
    object[parts.front()] = value;
  } else {
    set_path(object_at(object, parts.front()), parts.subspan(1), value);
  }
}

void erase_path(json::object& object, std::span<const std::string> parts) {
  json::value* value = object.if_contains(parts.front());
  if (value == nullptr) return;
  if (parts.size() == 1) {
    object.erase(parts.front());
  } else if (value->is_object()) {
    erase_path(value->get_object(), parts.subspan(1));
  }
}

json::array& users_of(json::object& document) {
  json::value* users = document.if_contains("users");
  if (users == nullptr || !users->is_array()) throw std::invalid_argument("the experiment has no list of users");
  return users->get_array();
}

json::object& user_called(json::object& document, const std::string& name) {
  json::array& users = users_of(document);
  std::string known;
  for (std::size_t i = 0; i < users.size(); ++i) {
    json::object& user = users[i].as_object();
    const json::value* own_name = user.if_contains("name");
    if (own_name != nullptr && *own_name == json::value(name)) return user;
    if (is_number(name) && std::stoul(name) == i) return user;
    known += (i == 0 ? "" : ", ") + std::to_string(i) +
             (own_name != nullptr && own_name->is_string() ? " " + std::string(own_name->get_string()) : "");
  }
  throw std::invalid_argument("users." + name + ": there is no such user; known: " + known);
}

/// Erases a quantity from every single user, so that the common value applies to all.
void forget_users_own(json::object& document, const std::vector<std::string>& parts) {
  for (json::value& user : users_of(document)) {
    if (!user.is_object()) continue;
    erase_path(user.get_object(), parts);
    if (parts.front() == "link") {
      erase_path(user.get_object(), std::vector<std::string>{"downlink", parts.size() > 1 ? parts[1] : std::string()});
    }
  }
}

void set_for_each_user(json::object& document, const std::vector<std::string>& parts, const json::value& value) {
  for (json::value& user : users_of(document)) set_path(user.as_object(), parts, value);
}

/// Renames a field. If both names are present, the value of the new name remains.
void rename_field(json::object& object, std::string_view from, std::string_view to) {
  json::value* value = object.if_contains(from);
  if (value == nullptr) return;
  const json::value kept = *value;
  object.erase(from);
  if (object.if_contains(to) == nullptr) object[to] = kept;
}

}  // namespace

std::string current_name(const std::string& quantity) {
  const bool is_of_one_user = quantity.starts_with(kUserPrefix) && quantity.ends_with(".guard");
  if (quantity != "guard" && !is_of_one_user) return quantity;
  return quantity.substr(0, quantity.size() - std::string_view("guard").size()) + "passivity";
}

json::object with_current_names(json::object document) {
  rename_field(document, "guard", "passivity");
  json::value* users = document.if_contains("users");
  if (users == nullptr || !users->is_array()) return document;
  for (json::value& user : users->get_array()) {
    if (user.is_object()) rename_field(user.get_object(), "guard", "passivity");
  }
  return document;
}

Axis parse_axis(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw std::invalid_argument("--set " + text + ": write NAME=VALUE or NAME=VALUE,VALUE, e.g. link.rtt_ms=0,50");
  }
  Axis axis{current_name(text.substr(0, equals)), {}};
  for (const std::string& part : divided(std::string_view(text).substr(equals + 1))) {
    if (part.empty()) throw std::invalid_argument("--set " + text + ": there is an empty value between its commas");
    axis.values.push_back(value_of(part));
  }
  return axis;
}

std::vector<std::string> parts_of_name(std::string_view name) {
  std::vector<std::string> parts{""};
  for (const char c : name) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::vector<std::string> known_quantities(const json::object& complete) {
  std::vector<std::string> names;
  json::object whole;
  for (const auto& field : complete) {
    if (is_of_a_whole_trial(std::string(field.key()))) whole[field.key()] = field.value();
  }
  flatten(whole, "", names);
  const json::object& user = complete.at("users").at(0).as_object();
  flatten(user.at("hand_parameters").as_object(), "hand.", names);
  names.emplace_back("device");
  names.emplace_back("pace");
  flatten(user, "users.0.", names);
  for (const char* name : {"law", "coupling.…", "scene.…"}) names.emplace_back(name);
  return names;
}

void check_quantity(const json::object& complete, const std::string& name) {
  const std::vector<std::string> known = known_quantities(complete);
  const std::string form = listed_form(name);
  if (is_of_the_scene(name) || std::find(known.begin(), known.end(), form) != known.end()) return;
  const auto nearest = std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(a, form) < edit_distance(b, form);
  });
  throw std::invalid_argument("quantity \"" + name + "\" is not known; did you mean " + *nearest +
                              "? known: " + listed(known, name.starts_with(kUserPrefix)));
}

void set_quantity(json::object& document, const std::string& name, const json::value& value) {
  const std::vector<std::string> parts = parts_of_name(name);
  if (name.starts_with(kUserPrefix) && parts.size() > 2) {
    set_path(user_called(document, parts[1]), std::span(parts).subspan(2), value);
  } else if (parts.front() == "hand" && parts.size() > 1) {
    std::vector<std::string> own = parts;
    own.front() = "hand_parameters";
    set_for_each_user(document, own, value);
  } else if (name == "device" || name == "pace") {
    set_for_each_user(document, parts, value);
  } else if (parts.front() == "scene" && parts.size() > 1) {
    object_at(document, "scene_changes")[std::string_view(name).substr(6)] = value;
  } else {
    forget_users_own(document, parts);
    set_path(document, parts, value);
  }
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace tandem::lab
