#include <array>
#include <optional>

#include "server/assets/meshes/formats.hpp"
#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

class OffReader {
 public:
  explicit OffReader(std::string_view text) : rest_(text) {}

  Polygons read() {
    header();
    const std::size_t vertices = count("vertices");
    const std::size_t faces = count("faces");
    line_.remove_prefix(line_.size());  // skips the number of edges
    for (std::size_t i = 0; i < vertices; ++i) vertex(i, vertices);
    for (std::size_t i = 0; i < faces; ++i) face(i, faces);
    return std::move(mesh_);
  }

 private:
  /// Returns the next line with a word, without its comment; empty at the end of the file.
  std::string_view next_row() {
    while (!rest_.empty()) {
      const std::string_view line = next_line(rest_);
      const std::string_view row = line.substr(0, line.find('#'));
      if (row.find_first_not_of(" \t\v\f") != std::string_view::npos) return row;
    }
    return {};
  }

  /// Returns the next word of the header, which may extend over several lines.
  std::string_view header_word() {
    std::string_view word = next_word(line_);
    if (!word.empty()) return word;
    line_ = next_row();
    return next_word(line_);
  }

  /// Reads the keyword [ST][C][N][4][n]OFF. A file without the keyword begins with the counts.
  void header() {
    line_ = next_row();
    std::string_view after = line_;
    const std::string_view keyword = next_word(after);
    if (!keyword.ends_with("OFF")) {
      if (whole_number_in(keyword)) return;
      throw Refusal("which is not a mesh in .off: it begins with " + in_quotes(keyword) +
                    "; export the mesh again, in the format that its name says");
    }
    line_ = after;
    const std::string_view kind = keyword.substr(0, keyword.size() - 3);
    has_weight_ = kind.find('4') != std::string_view::npos;
    if (std::string_view(after).find("BINARY") != std::string_view::npos) {
      throw Refusal("which is a binary .off, and only its text is read; export it as text, or as .ply");
    }
    if (kind.ends_with('n') && header_word() != "3") {
      throw Refusal("which has vertices of a dimension other than 3; export a surface in space");
    }
  }

  std::size_t count(const std::string& of) {
    const std::string_view word = header_word();
    const std::optional<long long> value = whole_number_in(word);
    if (!value || *value < 0) {
      throw Refusal("which has " + in_quotes(word) + " as its count of " + of + "; export the mesh again");
    }
    return static_cast<std::size_t>(*value);
  }

  std::string_view row_of(const char* what, std::size_t index, std::size_t of) {
    const std::string_view row = next_row();
    if (!row.empty()) return row;
    throw Refusal("which ends before its " + std::string(what) + " " + std::to_string(index + 1) + " of " +
                  std::to_string(of) + ", each in a line of its own; export the mesh again");
  }

  void vertex(std::size_t index, std::size_t of) {
    std::string_view row = row_of("vertex", index, of);
    std::array<double, 4> numbers{0, 0, 0, 1};
    for (std::size_t i = 0; i < (has_weight_ ? 4U : 3U); ++i) {
      const std::string_view word = next_word(row);
      const std::optional<double> number = number_in(word);
      if (!number || (i == 3 && *number == 0)) {
        throw Refusal("whose vertex " + std::to_string(index + 1) + " has " + why_no_number(word) +
                      "; export the mesh again");
      }
      numbers[i] = *number;
    }
    mesh_.vertices.emplace_back(Vec3(numbers[0], numbers[1], numbers[2]) / numbers[3]);
  }

  void face(std::size_t index, std::size_t of) {
    std::string_view row = row_of("face", index, of);
    const std::optional<long long> size = whole_number_in(next_word(row));
    const auto refuse = [&] {
      throw Refusal("whose face " + std::to_string(index + 1) +
                    " is no count with that many indices of vertices; export the mesh again");
    };
    if (!size || *size < 0) refuse();
    face_.clear();
    for (long long i = 0; i < *size; ++i) {
      const std::optional<long long> corner = whole_number_in(next_word(row));
      if (!corner || *corner < 0 || *corner > std::numeric_limits<std::int32_t>::max()) refuse();
      face_.push_back(static_cast<std::uint32_t>(*corner));
    }
    mesh_.add_face(face_);
  }

  std::string_view rest_;
  std::string_view line_;
  bool has_weight_ = false;
  std::vector<std::uint32_t> face_;
  Polygons mesh_;
};

}  // namespace

Polygons polygons_of_off(std::string_view text) {
  return OffReader(text).read();
}

}  // namespace tandem::server::mesh_reader
