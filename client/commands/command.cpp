// See command.hpp. A single table of the commands and their fields determines the parser, the help and USING.md.
#include "client/commands/command.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <stdexcept>

#include "common/net/text.hpp"

namespace tandem::client {
namespace {

constexpr std::size_t kMaxWordShown = 40;
constexpr std::size_t kMaxPosesListed = 20;

/// A field of a command: a number if it has a unit, otherwise text.
struct Field {
  const char* name;
  const char* unit = nullptr;
  double min = 0;
  double max = 0;
  bool may_be_absent = false;
};

struct Usage {
  const char* verb;
  const char* purpose;
  std::array<Field, 4> fields{};  ///< unused entries have no name

  std::span<const Field> used() const {
    const auto end = std::ranges::find_if(fields, [](const Field& field) { return field.name == nullptr; });
    return {fields.begin(), end};
  }
};

constexpr double kMaxPlace_m = 1000;  // largest absolute value of a position coordinate in a message
constexpr double kMaxWait_s = 3600;

constexpr Field metres(const char* name) {
  return {name, "m", -kMaxPlace_m, kMaxPlace_m};
}
constexpr Field direction(const char* name) {
  return {name, "part of a direction", -1, 1};
}

constexpr Field kName{"NAME"};
constexpr Field kNameOrNone{.name = "NAME", .may_be_absent = true};
constexpr Field kPose{"POSE"};

constexpr std::array kUsages{
    Usage{"help", "lists the commands"},
    Usage{"keep", "keeps the present pose of the two molecules, under a name", {kNameOrNone}},
    Usage{"poses", "lists the poses that are kept: number, name, energy [kJ/mol], RMSD [angstrom], user, time"},
    Usage{"visit", "brings the molecules to a kept pose", {kPose}},
    Usage{"rename", "renames a kept pose", {kPose, kName}},
    Usage{"delete", "deletes a kept pose and its files", {kPose}},
    Usage{"undo", "brings the molecules back to where they last rested"},
    Usage{"redo", "brings them forward again"},
    Usage{"minimise",
          "brings them downhill to the nearest minimum of energy; cancels that after SECONDS [s]",
          {Field{"SECONDS", "s", 0.1, kMaxWait_s, true}}},
    Usage{"energy", "energy of the molecules now [kJ/mol]"},
    Usage{"state", "poses of hand, tool and bodies [m], force on the hand [N], torque [N*m], energy [kJ/mol]"},
    Usage{"move",
          "moves the hand to a place in the world [m], at 0.1 m/s at the device, until it rests",
          {metres("X"), metres("Y"), metres("Z")}},
    Usage{"move-by", "moves the hand along the world's axes [m], likewise", {metres("DX"), metres("DY"), metres("DZ")}},
    Usage{"turn",
          "turns the hand about a direction of the world, by DEGREES, until it rests",
          {direction("AX"), direction("AY"), direction("AZ"), Field{"DEGREES", "degrees", -180, 180}}},
    Usage{"grab", "grabs the body within reach of the tool"},
    Usage{"release", "releases it"},
    Usage{"wait", "waits for this time [s]", {Field{"SECONDS", "s", 0, kMaxWait_s}}},
    Usage{"quit", "ends the program, as the end of the input does"},
};

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string listed_verbs() {
  std::string text;
  for (const Usage& usage : kUsages) text.append(text.empty() ? "" : ", ").append(usage.verb);
  return text;
}

std::string text_of_usage(const Usage& usage) {
  std::string text = usage.verb;
  for (const Field& field : usage.used()) {
    const std::string name = field.name;
    text += field.may_be_absent ? " [" + name + "]" : " " + name;
  }
  return text;
}

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

/// Removes blanks at both ends, and the carriage return of a line that ends with CR LF.
std::string_view without_rim(std::string_view line) {
  while (!line.empty() && (is_blank(line.back()) || line.back() == '\r')) line.remove_suffix(1);
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  return line;
}

/// Removes a quoted field from the start of `line` and returns it. `line` begins with the quotation mark.
std::string pop_quoted(std::string_view& line) {
  std::string word;
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (line[i] == '"') {
      line.remove_prefix(i + 1);
      if (!line.empty() && !is_blank(line.front())) {
        throw std::invalid_argument("a field continues after its closing quote; separate fields by a blank");
      }
      return word;
    }
    const bool is_escaped = line[i] == '\\' && i + 1 < line.size() && (line[i + 1] == '"' || line[i + 1] == '\\');
    word += line[is_escaped ? ++i : i];
  }
  throw std::invalid_argument("a quote is not closed; end the field with \"");
}

std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  for (line = without_rim(line); !line.empty(); line = without_rim(line)) {
    if (line.front() == '"') {
      words.push_back(pop_quoted(line));
      continue;
    }
    const auto end = static_cast<std::size_t>(std::ranges::find_if(line, is_blank) - line.begin());
    words.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return words;
}

double number_of(const Field& field, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
  if (is_number && value >= field.min && value <= field.max) return value;
  throw std::invalid_argument(std::string(field.name) + ": '" + net::printable(text, kMaxWordShown) +
                              "' must be a number from " + number_text(field.min) + " to " + number_text(field.max) +
                              " [" + field.unit + "]");
}

std::string described(const wire::KeptPose& pose) {
  return "#" + std::to_string(pose.number()) + " \"" + pose.name() + "\"";
}

std::optional<std::uint32_t> pose_number_of(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

CommandLine parse_command(std::string_view line) {
  if (line.size() > kMaxCommandBytes) {
    throw std::invalid_argument("the line is longer than " + std::to_string(kMaxCommandBytes) + " bytes; shorten it");
  }
  line = without_rim(line);
  if (line.empty()) throw std::invalid_argument("the line is empty; use one of: " + listed_verbs());
  std::string plain(line);
  std::ranges::replace(plain, '\t', ' ');
  if (net::printable(plain, kMaxCommandBytes) != plain) {
    throw std::invalid_argument("the line is not printable UTF-8; use printable characters");
  }
  const std::vector<std::string> words = words_of(line);
  const auto usage = std::ranges::find(kUsages, words.front(), &Usage::verb);
  if (usage == kUsages.end()) {
    throw std::invalid_argument("'" + net::printable(words.front(), kMaxWordShown) +
                                "' is no command; use one of: " + listed_verbs());
  }
  CommandLine command{.verb = usage->verb, .texts = {}, .numbers = {}};
  std::size_t next = 1;
  for (const Field& field : usage->used()) {
    if (next == words.size() && field.may_be_absent) break;
    if (next == words.size()) {
      throw std::invalid_argument(std::string(field.name) + " is missing; usage: " + text_of_usage(*usage));
    }
    const std::string& word = words[next++];
    if (field.unit != nullptr) {
      command.numbers.push_back(number_of(field, word));
    } else {
      command.texts.push_back(word);
    }
  }
  if (next < words.size()) {
    throw std::invalid_argument("'" + net::printable(words[next], kMaxWordShown) + "' is one field too many; usage: " +
                                text_of_usage(*usage) + "; write a name with blanks in double quotes");
  }
  return command;
}

std::string command_word(std::string_view line) {
  line = without_rim(line.substr(0, kMaxCommandBytes));
  const auto end = static_cast<std::size_t>(std::ranges::find_if(line, is_blank) - line.begin());
  return net::printable(line.substr(0, end), kMaxWordShown);
}

std::vector<std::pair<std::string, std::string>> command_usages() {
  std::vector<std::pair<std::string, std::string>> usages;
  for (const Usage& usage : kUsages) usages.emplace_back(text_of_usage(usage), usage.purpose);
  return usages;
}

const wire::KeptPose& find_pose(const std::vector<wire::KeptPose>& poses, const std::string& pose) {
  const bool is_number_only = pose.starts_with('#');
  const auto number = pose_number_of(std::string_view(pose).substr(is_number_only ? 1 : 0));
  std::vector<const wire::KeptPose*> meant;
  for (const wire::KeptPose& each : poses) {
    if (number == each.number() || (!is_number_only && each.name() == pose)) meant.push_back(&each);
  }
  if (meant.size() == 1) return *meant.front();
  const bool is_missing = meant.empty();
  for (const wire::KeptPose& each : poses) {
    if (is_missing) meant.push_back(&each);
  }
  std::string list;
  for (std::size_t i = 0; i < std::min(meant.size(), kMaxPosesListed); ++i) {
    list += (i == 0 ? "" : ", ") + described(*meant[i]);
  }
  if (meant.size() > kMaxPosesListed) list += " and " + std::to_string(meant.size() - kMaxPosesListed) + " more";
  const std::string shown = "POSE: '" + net::printable(pose, kMaxWordShown) + "' ";
  if (is_missing) throw std::invalid_argument(shown + "is not kept; there are " + (list.empty() ? "none" : list));
  throw std::invalid_argument(shown + "means more than one: " + list + "; use a number, for instance #" +
                              std::to_string(meant.front()->number()));
}

}  // namespace tandem::client
