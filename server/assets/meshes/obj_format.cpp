#include <array>
#include <optional>

#include "server/assets/meshes/formats.hpp"
#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

class ObjReader {
 public:
  explicit ObjReader(std::string_view text) : rest_(text) {}

  Polygons read() {
    while (!rest_.empty()) statement(whole_line());
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Refusal("which has, in line " + std::to_string(line_) + ", " + what);
  }

  /// Returns the next line without its comment. A backslash at the end of a line continues it on the next line.
  std::string_view whole_line() {
    ++line_;
    std::string_view line = next_line(rest_);
    if (!line.ends_with('\\')) return line.substr(0, line.find('#'));
    joined_.clear();
    while (line.ends_with('\\')) {
      joined_ += line.substr(0, line.size() - 1);
      joined_ += ' ';
      ++line_;
      line = next_line(rest_);
    }
    joined_ += line;
    return std::string_view(joined_).substr(0, joined_.find('#'));
  }

  void statement(std::string_view line) {
    const std::string_view keyword = next_word(line);
    if (keyword == "v") vertex(line);
    if (keyword == "f" || keyword == "fo") face(line);
    if (keyword == "surf" || keyword == "bzp" || keyword == "bsp" || keyword == "call") {
      refuse("a statement " + std::string(keyword) +
             ", which is not read; convert free-form surfaces and parts of other files to faces and export again");
    }
  }

  void vertex(std::string_view line) {
    std::array<double, 4> numbers{};
    std::size_t count = 0;
    for (auto word = next_word(line); !word.empty(); word = next_word(line), ++count) {
      const std::optional<double> number = number_in(word);
      if (!number && count < 4) refuse("a vertex with " + why_no_number(word) + "; export the mesh again");
      if (count < 4) numbers[count] = *number;
    }
    if (count < 3) refuse("a vertex of " + std::to_string(count) + " numbers; export the mesh again");
    // Four numbers are x y z w. If there are more than four, a colour follows x y z.
    const double weight = count == 4 ? numbers[3] : 1;
    if (weight == 0) refuse("a vertex of weight 0; export the mesh again");
    mesh_.vertices.emplace_back(Vec3(numbers[0], numbers[1], numbers[2]) / weight);
  }

  void face(std::string_view line) {
    face_.clear();
    for (auto word = next_word(line); !word.empty(); word = next_word(line)) face_.push_back(corner(word));
    mesh_.add_face(face_);
  }

  /// Returns the index of the vertex that a corner of a face refers to. In the file, 1 is the first vertex, and -1 is
  /// the last vertex read so far.
  std::uint32_t corner(std::string_view word) const {
    const std::optional<long long> index = whole_number_in(word.substr(0, word.find('/')));
    const auto count = static_cast<long long>(mesh_.vertices.size());
    if (!index || *index == 0 || *index < -count || *index > std::numeric_limits<std::int32_t>::max()) {
      refuse("a face with " + in_quotes(word) + ", which is no index of a vertex; export the mesh again");
    }
    return static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index);
  }

  std::string_view rest_;
  std::string joined_;
  std::size_t line_ = 0;
  std::vector<std::uint32_t> face_;
  Polygons mesh_;
};

}  // namespace

Polygons polygons_of_obj(std::string_view text) {
  return ObjReader(text).read();
}

}  // namespace tandem::server::mesh_reader
