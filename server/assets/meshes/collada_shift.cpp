#include "server/assets/meshes/collada_shift.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <vector>

#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

/// The file is not changed if no coordinate exceeds this multiple of the mesh size. Single precision then loses less
/// than a millionth of the mesh size.
constexpr double kFarthest = 4;

/// A range of characters of the file.
struct Piece {
  std::size_t begin = 0, end = 0;
  std::string_view in(std::string_view text) const { return text.substr(begin, end - begin); }
};

/// Finds the next start tag of an element `name` between `at` and `end`, with its attributes.
std::optional<Piece> next_tag(std::string_view text, std::string_view name, std::size_t at, std::size_t end) {
  const std::string start = "<" + std::string(name);
  text = text.substr(0, end);
  while (true) {
    const std::size_t begin = text.find(start, at);
    if (begin == std::string_view::npos) return std::nullopt;
    at = begin + start.size();
    if (at >= text.size() || std::string_view(" \t\r\n>/").find(text[at]) == std::string_view::npos) continue;
    const std::size_t close = text.find('>', at);
    if (close == std::string_view::npos) return std::nullopt;
    return Piece{begin, close + 1};
  }
}

/// Returns the value of an attribute; empty if the tag lacks the attribute `name`.
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    const std::size_t open = at + name.size() + 1;
    const bool is_whole = at > 0 && std::string_view(" \t\r\n").find(tag[at - 1]) != std::string_view::npos;
    if (!is_whole || open >= tag.size() || tag[open - 1] != '=' || (tag[open] != '"' && tag[open] != '\'')) continue;
    const std::size_t close = tag.find(tag[open], open + 1);
    if (close != std::string_view::npos) return tag.substr(open + 1, close - open - 1);
  }
  return {};
}

/// Returns the ids of the sources that contain vertex positions.
std::set<std::string, std::less<>> position_sources(std::string_view text) {
  std::set<std::string, std::less<>> ids;
  for (auto tag = next_tag(text, "vertices", 0, text.size()); tag;
       tag = next_tag(text, "vertices", tag->end, text.size())) {
    const std::size_t end = std::min(text.find("</vertices", tag->end), text.size());
    for (auto input = next_tag(text, "input", tag->end, end); input; input = next_tag(text, "input", input->end, end)) {
      std::string_view source = attribute(input->in(text), "source");
      if (attribute(input->in(text), "semantic") != "POSITION" || !source.starts_with('#')) continue;
      ids.emplace(source.substr(1));
    }
  }
  return ids;
}

bool is_list_of_xyz(std::string_view text, std::size_t begin, std::size_t end) {
  const std::optional<Piece> accessor = next_tag(text, "accessor", begin, end);
  if (!accessor || attribute(accessor->in(text), "stride") != "3") return false;
  const std::string_view offset = attribute(accessor->in(text), "offset");
  std::string names;
  for (auto tag = next_tag(text, "param", accessor->end, end); tag; tag = next_tag(text, "param", tag->end, end)) {
    names += attribute(tag->in(text), "name");
  }
  return names == "XYZ" && (offset.empty() || offset == "0");
}

/// Returns the parts of the text that list the coordinates of positions, in file order. Returns nothing if any of them
/// is not a list of X, Y, Z.
std::optional<std::vector<Piece>> position_lists(std::string_view text) {
  const auto ids = position_sources(text);
  std::vector<Piece> lists;
  for (auto tag = next_tag(text, "source", 0, text.size()); tag;
       tag = next_tag(text, "source", tag->end, text.size())) {
    if (!ids.contains(attribute(tag->in(text), "id"))) continue;
    const std::size_t end = std::min(text.find("</source", tag->end), text.size());
    const std::optional<Piece> array = next_tag(text, "float_array", tag->end, end);
    if (!array || !is_list_of_xyz(text, array->end, end)) return std::nullopt;
    lists.push_back({array->end, std::min(text.find('<', array->end), end)});
  }
  return lists;
}

/// Parses a list of numbers; nothing if a word is not a number.
std::optional<std::vector<double>> numbers_in(std::string_view list) {
  std::vector<double> numbers;
  for (auto word = next_word(list); !word.empty(); word = next_word(list)) {
    const std::optional<double> number = number_in(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  text += ' ';
}

}  // namespace

std::optional<ShiftedCollada> shifted_collada(std::string_view text) {
  // Controllers (skins, morphs) compute with positions. A shift would change their result, so such files are not
  // shifted.
  if (next_tag(text, "controller", 0, text.size())) return std::nullopt;
  const auto lists = position_lists(text);
  if (!lists) return std::nullopt;
  Eigen::AlignedBox3d box;
  for (const Piece& list : *lists) {
    const auto numbers = numbers_in(list.in(text));
    if (!numbers) return std::nullopt;
    for (std::size_t i = 0; i + 3 <= numbers->size(); i += 3) box.extend(Vec3::Map(numbers->data() + i));
  }
  if (box.isEmpty()) return std::nullopt;
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  if (farthest <= kFarthest * box.sizes().maxCoeff()) return std::nullopt;
  ShiftedCollada shifted{.text = {}, .shift = box.center()};
  std::size_t copied = 0;
  for (const Piece& list : *lists) {
    shifted.text += text.substr(copied, list.begin - copied);
    const auto numbers = numbers_in(list.in(text));
    for (std::size_t i = 0; i < numbers->size(); ++i)
      append(shifted.text, (*numbers)[i] - shifted.shift[static_cast<Eigen::Index>(i % 3)]);
    copied = list.end;
  }
  shifted.text += text.substr(copied);
  return shifted;
}

}  // namespace tandem::server::mesh_reader
