#include <cstring>
#include <optional>

#include "common/base/byte_io.hpp"
#include "server/assets/meshes/formats.hpp"
#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

constexpr std::size_t kHeader = 84, kRecord = 50;
constexpr const char* kNotStl = "; export the mesh again, in the format that its name says";

/// Reads the text form "solid … facet normal … outer loop vertex x y z … endloop endfacet … endsolid …", in any case.
class TextStl {
 public:
  explicit TextStl(std::string_view text) : rest_(text) {}

  Polygons read() {
    while (begins_facet()) facet();
    return std::move(mesh_);
  }

 private:
  std::string next() { return lower_case(next_word(rest_)); }

  /// Skips text up to the next facet, such as names of solids. Returns false at the end.
  bool begins_facet() {
    std::string before;
    for (std::string word = next(); !word.empty(); word = next()) {
      if (before == "facet" && word == "normal") return true;
      before = std::move(word);
    }
    return false;
  }

  void expect(const std::string& word) {
    if (const std::string found = next(); found != word) refuse(found, word);
  }

  [[noreturn]] void refuse(const std::string& found, const std::string& wanted) const {
    throw Refusal("whose facet " + std::to_string(mesh_.face_sizes.size() + 1) + " " +
                  (found.empty() ? "is cut off: no more words" : "has " + in_quotes(found)) + " where " + wanted +
                  " should be; export the mesh again");
  }

  double number() {
    const std::string word = next();
    const std::optional<double> value = number_in(word);
    if (!value && !word.empty())
      throw Refusal("whose facet " + std::to_string(mesh_.face_sizes.size() + 1) + " has " + why_no_number(word) +
                    "; export the mesh again");
    if (!value) refuse(word, "a number");
    return *value;
  }

  void facet() {
    for (int i = 0; i < 3; ++i) next();  // skips the normal
    expect("outer");
    expect("loop");
    std::vector<std::uint32_t> face;
    std::string word = next();
    for (; word == "vertex"; word = next()) {
      const double x = number(), y = number(), z = number();
      face.push_back(static_cast<std::uint32_t>(mesh_.vertices.size()));
      mesh_.vertices.emplace_back(x, y, z);
    }
    if (word != "endloop" || face.size() < 3) refuse(word, "a vertex or, after three, endloop");
    expect("endfacet");
    mesh_.add_face(face);
  }

  std::string_view rest_;
  Polygons mesh_;
};

Polygons binary_stl(std::span<const std::byte> bytes) {
  auto rest = octets_of(bytes).subspan(kHeader - 4);
  ByteReader reader(rest);
  const std::size_t count = reader.u32();
  const std::size_t held = (bytes.size() - kHeader) / kRecord;
  if (count != held) {
    throw Refusal("which is not a mesh in .stl, or is damaged: it declares " + std::to_string(count) +
                  " triangles and holds " + std::to_string(held) + kNotStl);
  }
  Polygons mesh;
  mesh.number_step = std::numeric_limits<float>::epsilon();
  mesh.vertices.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) reader.f32();  // skips the normal
    for (int k = 0; k < 3; ++k) {
      const double x = reader.f32(), y = reader.f32(), z = reader.f32();
      mesh.vertices.emplace_back(x, y, z);
    }
    reader.number<std::uint16_t>();
    const auto first = static_cast<std::uint32_t>(3 * i);
    mesh.corners.insert(mesh.corners.end(), {first, first + 1, first + 2});
    mesh.face_sizes.push_back(3);
  }
  return mesh;
}

/// Returns whether an STL file is in text form. A binary file may begin with "solid" as well, but it has a zero byte
/// near its start: the upper byte of its number of triangles, which is below 2^24 in any accepted file.
bool is_text(std::span<const std::byte> bytes) {
  std::string_view text = text_of(bytes);
  const bool has_zero = text.substr(0, kHeader).find('\0') != std::string_view::npos;
  return !has_zero && lower_case(next_word(text)).starts_with("solid");
}

}  // namespace

Polygons polygons_of_stl(std::span<const std::byte> bytes) {
  const bool is_exact = bytes.size() >= kHeader && (bytes.size() - kHeader) % kRecord == 0;
  if (is_text(bytes)) {
    Polygons mesh = TextStl(text_of(bytes)).read();
    if (!mesh.face_sizes.empty() || !is_exact) return mesh;
  }
  if (bytes.size() < kHeader) throw Refusal(std::string("which is not a mesh in .stl") + kNotStl);
  return binary_stl(bytes);
}

}  // namespace tandem::server::mesh_reader
