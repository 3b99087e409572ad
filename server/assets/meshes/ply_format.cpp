#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "server/assets/meshes/formats.hpp"
#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

constexpr const char* kAgain = "; export the mesh again";

struct NumberType {
  std::string_view name, other_name;
  std::size_t bytes;
  bool is_signed, is_real;
};
constexpr std::array kTypes{
    NumberType{"char", "int8", 1, true, false},    NumberType{"uchar", "uint8", 1, false, false},
    NumberType{"short", "int16", 2, true, false},  NumberType{"ushort", "uint16", 2, false, false},
    NumberType{"int", "int32", 4, true, false},    NumberType{"uint", "uint32", 4, false, false},
    NumberType{"float", "float32", 4, true, true}, NumberType{"double", "float64", 8, true, true},
};

struct Property {
  const NumberType* type = nullptr;
  const NumberType* count_type = nullptr;  ///< type of the count before a list; null if the property is no list
  std::string name;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

const NumberType* type_named(std::string_view name) {
  const auto found = std::ranges::find_if(
      kTypes, [name](const NumberType& type) { return type.name == name || type.other_name == name; });
  if (found == kTypes.end())
    throw Refusal("which has a property of type " + in_quotes(name) + ", unknown to .ply" + kAgain);
  return &*found;
}

/// Reads header and body of a .ply.
class PlyReader {
 public:
  explicit PlyReader(std::string_view text) : rest_(text) {}

  Polygons read() {
    header();
    for (const Element& element : elements_) body(element);
    if (mesh_.face_sizes.empty()) refuse_without_faces();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] static void refuse(const std::string& what) { throw Refusal("which " + what + kAgain); }

  [[noreturn]] void refuse_without_faces() const {
    std::string names;
    for (const Element& element : elements_) names += (names.empty() ? "" : ", ") + in_quotes(element.name);
    throw Refusal("which has no triangle: its elements are " + names +
                  ", and surfaces are read of face and tristrips; export its surface as triangles");
  }

  void header() {
    if (next_line(rest_) != "ply") {
      throw Refusal("which is not a mesh in .ply; export the mesh again, in the format that its name says");
    }
    while (true) {
      if (rest_.empty()) refuse("has no end_header");
      std::string_view line = next_line(rest_);
      const std::string_view keyword = next_word(line);
      if (keyword == "end_header") break;
      if (keyword == "format") format(next_word(line));
      if (keyword == "element") element(line);
      if (keyword == "property") property(line);
    }
    if (!has_format_) refuse("has no format in its header");
  }

  void format(std::string_view name) {
    has_format_ = true;
    is_text_ = name == "ascii";
    is_big_endian_ = name == "binary_big_endian";
    if (!is_text_ && !is_big_endian_ && name != "binary_little_endian")
      refuse("has the unknown format " + in_quotes(name));
  }

  void element(std::string_view line) {
    const std::string name(next_word(line));
    const std::optional<long long> count = whole_number_in(next_word(line));
    if (!count || *count < 0) refuse("has no count of its element " + in_quotes(name));
    const auto is_same = [&name](const Element& other) { return other.name == name; };
    if (std::ranges::any_of(elements_, is_same)) refuse("has the element " + in_quotes(name) + " twice");
    elements_.push_back({name, static_cast<std::size_t>(*count), {}});
  }

  void property(std::string_view line) {
    if (elements_.empty()) refuse("has a property before its first element");
    Property one;
    std::string_view type = next_word(line);
    if (type == "list") {
      one.count_type = type_named(next_word(line));
      type = next_word(line);
    }
    one.type = type_named(type);
    one.name = next_word(line);
    elements_.back().properties.push_back(std::move(one));
  }

  void body(const Element& element) {
    // Elements without properties occupy no bytes, so the length of the file does not bound their number. They are
    // skipped.
    if (element.properties.empty()) return;
    element_ = &element;
    if (element.name == "vertex") find_axes(element);
    if (element.name == "vertex") mesh_.vertices.reserve(std::min(element.count, rest_.size() / 6));
    const Property* const indices = indices_of(element);
    for (row_ = 0; row_ < element.count; ++row_) row(element, indices);
  }

  void find_axes(const Element& element) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string name(1, "xyz"[axis]);
      const auto is_axis = [&name](const Property& one) { return one.name == name && one.count_type == nullptr; };
      const auto found = std::ranges::find_if(element.properties, is_axis);
      if (found == element.properties.end()) refuse("has vertices without a property " + name);
      axes_[axis] = static_cast<std::size_t>(found - element.properties.begin());
      if (found->type->name == "float" && !is_text_) mesh_.number_step = std::numeric_limits<float>::epsilon();
    }
  }

  /// Returns the property with vertex indices; null if the element has no faces.
  const Property* indices_of(const Element& element) const {
    if (element.name != "face" && element.name != "tristrips") return nullptr;
    const auto is_indices = [](const Property& one) {
      return one.count_type != nullptr && (one.name == "vertex_indices" || one.name == "vertex_index");
    };
    const auto found = std::ranges::find_if(element.properties, is_indices);
    if (found != element.properties.end()) return &*found;
    if (element.count > 0) refuse("has an element " + element.name + " without a list vertex_indices");
    return nullptr;
  }

  void row(const Element& element, const Property* indices) {
    Vec3 vertex = Vec3::Zero();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& one = element.properties[i];
      if (one.count_type != nullptr) {
        list(one, &one == indices);
        continue;
      }
      const double value = number(*one.type);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axes_[axis] == i) vertex[static_cast<Eigen::Index>(axis)] = value;
      }
    }
    if (element.name == "vertex") mesh_.vertices.push_back(vertex);
    if (indices == nullptr) return;
    if (element.name == "face") add_polygon();
    if (element.name == "tristrips") add_strips(*indices);
  }

  void list(const Property& one, bool is_kept) {
    const double count = number(*one.count_type);
    if (!(count >= 0) || count != std::floor(count)) refuse_row("has a list of no length");
    if (is_kept) list_.clear();
    for (double i = 0; i < count; ++i) {
      const double value = number(*one.type);
      if (is_kept) list_.push_back(value);
    }
  }

  std::uint32_t corner(double index) const {
    if (!(index >= 0 && index < std::numeric_limits<std::int32_t>::max() && index == std::floor(index))) {
      refuse_row("has an index that is no vertex");
    }
    return static_cast<std::uint32_t>(index);
  }

  void add_polygon() {
    face_.clear();
    for (const double index : list_) face_.push_back(corner(index));
    mesh_.add_face(face_);
  }

  /// Adds the triangles of strips. The orientation alternates from triangle to triangle. The index -1, or its unsigned
  /// form, begins a new strip.
  void add_strips(const Property& indices) {
    const double restart = indices.type->is_signed ? -1 : std::ldexp(1, static_cast<int>(8 * indices.type->bytes)) - 1;
    face_.clear();
    for (const double index : list_) {
      if (index == restart) {
        face_.clear();
        continue;
      }
      face_.push_back(corner(index));
      if (face_.size() < 3) continue;
      const std::size_t last = face_.size() - 1;
      const std::uint32_t a = face_[last - 2], b = face_[last - 1], c = face_[last];
      // A triangle with equal corners has no area. It only connects two parts of a strip.
      if (a == b || b == c || c == a) continue;
      mesh_.add_face(last % 2 == 0 ? std::vector{a, b, c} : std::vector{b, a, c});
    }
  }

  [[noreturn]] void refuse_row(const std::string& what) const {
    refuse(what + ", in row " + std::to_string(row_ + 1) + " of " + std::to_string(element_->count) +
           " of its element " + in_quotes(element_->name));
  }

  double number(const NumberType& type) { return is_text_ ? number_of_text() : number_of_bytes(type); }

  double number_of_text() {
    const std::string_view word = next_word(rest_);
    if (word.empty()) refuse_row("ends too soon");
    const std::optional<double> value = number_in(word);
    if (!value) refuse_row("has " + why_no_number(word));
    return *value;
  }

  double number_of_bytes(const NumberType& type) {
    if (rest_.size() < type.bytes) refuse_row("ends too soon");
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.bytes; ++i) {
      const std::size_t at = is_big_endian_ ? i : type.bytes - 1 - i;
      bits = bits << 8U | static_cast<unsigned char>(rest_[at]);
    }
    rest_.remove_prefix(type.bytes);
    if (type.is_real) {
      return type.bytes == 8 ? std::bit_cast<double>(bits) : std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    }
    const auto unused = static_cast<unsigned>(64 - 8 * type.bytes);
    return type.is_signed ? static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused)
                          : static_cast<double>(bits);
  }

  std::string_view rest_;
  bool has_format_ = false, is_text_ = false, is_big_endian_ = false;
  std::vector<Element> elements_;
  const Element* element_ = nullptr;
  std::size_t row_ = 0;
  std::array<std::size_t, 3> axes_{};
  std::vector<double> list_;
  std::vector<std::uint32_t> face_;
  Polygons mesh_;
};

}  // namespace

Polygons polygons_of_ply(std::span<const std::byte> bytes) {
  return PlyReader(text_of(bytes)).read();
}

}  // namespace tandem::server::mesh_reader
