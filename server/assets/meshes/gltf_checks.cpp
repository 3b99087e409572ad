#include "server/assets/meshes/gltf_checks.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "common/base/byte_io.hpp"
#include "common/base/json.hpp"
#include "server/assets/meshes/polygons.hpp"
#include "server/assets/meshes/text.hpp"

namespace tandem::server::mesh_reader {
namespace {

namespace json = boost::json;

constexpr std::int64_t kSingle = 5126;  // glTF's code of the component type FLOAT
/// Limit of the nesting depth of lists and objects. User data of known exporters have a depth of some tens.
constexpr std::size_t kMaxDepth = 200;
/// Prefixes of extensions that do not change the shape.
constexpr std::array kHarmless{"KHR_materials_",        "KHR_technique", "KHR_texture_", "KHR_lights_",   "KHR_xmp",
                               "KHR_mesh_quantization", "EXT_texture_",  "EXT_lights_",  "MSFT_texture_", "MSFT_lod",
                               "MSFT_packing_"};
constexpr std::array kPacked{"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"};
constexpr const char* kCopies = "EXT_mesh_gpu_instancing";

/// Returns the value of a field; null if there is none.
const json::value* field(const json::value& of, std::string_view name) {
  return of.is_object() ? of.as_object().if_contains(name) : nullptr;
}

/// Returns the elements of a list; none if it is missing or not a list.
std::span<const json::value> list(const json::value& of, std::string_view name) {
  const json::value* const found = field(of, name);
  if (found == nullptr || !found->is_array()) return {};
  return {found->as_array().data(), found->as_array().size()};
}

std::int64_t whole(const json::value& of, std::string_view name, std::int64_t otherwise) {
  const json::value* const found = field(of, name);
  boost::system::error_code error;
  const auto value = found != nullptr && found->is_number() ? found->to_number<std::int64_t>(error) : otherwise;
  return error ? otherwise : value;
}

bool has_extension(const json::value& of, std::string_view name) {
  const json::value* const extensions = field(of, "extensions");
  return extensions != nullptr && field(*extensions, name) != nullptr;
}

std::string place(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

/// Returns the text of a .gltf, or of the first chunk of a .glb.
std::string_view json_text(std::span<const std::byte> bytes) {
  constexpr std::size_t kHeader = 20;
  const std::string_view text = text_of(bytes);
  if (!text.starts_with("glTF") || text.size() < kHeader) return text;
  auto at = octets_of(bytes).subspan(12);
  const std::size_t length = ByteReader(at).u32();
  return text.substr(kHeader, length);
}

class GltfChecker {
 public:
  explicit GltfChecker(const json::value& document) : document_(document) {}

  std::size_t checked_triangles() {
    check_required();
    check_nodes();
    check_packing();
    const auto meshes = list(document_, "meshes");
    for (std::size_t m = 0; m < meshes.size(); ++m) check_mesh(meshes[m], place("meshes", m));
    return triangles_;
  }

 private:
  [[noreturn]] static void refuse_extension(const std::string& where, std::string_view name) {
    const bool is_packed = std::ranges::find(kPacked, name) != kPacked.end();
    throw Refusal("whose " + where + " uses " + std::string(name) + ", which is not read; export it without " +
                  (is_packed ? "compression" : "this extension"));
  }

  void check_required() const {
    for (const json::value& one : list(document_, "extensionsRequired")) {
      if (!one.is_string()) continue;
      const std::string_view name = one.as_string();
      const auto begins = [name](const char* start) { return name.starts_with(start); };
      if (std::ranges::none_of(kHarmless, begins)) refuse_extension("extensionsRequired", name.substr(0, 60));
    }
  }

  void check_nodes() const {
    const auto nodes = list(document_, "nodes");
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (has_extension(nodes[n], kCopies)) refuse_extension(place("nodes", n), kCopies);
      check_weights(nodes[n], place("nodes", n));
    }
  }

  void check_packing() const {
    const auto views = list(document_, "bufferViews");
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (const char* const name : kPacked)
        if (has_extension(views[v], name)) refuse_extension(place("bufferViews", v), name);
    }
  }

  static void check_weights(const json::value& of, const std::string& where) {
    const auto is_some = [](const json::value& weight) {
      return weight.is_number() && weight.to_number<double>() != 0;
    };
    if (std::ranges::none_of(list(of, "weights"), is_some)) return;
    throw Refusal("whose " + where +
                  ".weights blend morph targets, which are not read; apply the shape and export again");
  }

  void check_mesh(const json::value& mesh, const std::string& where) {
    check_weights(mesh, where);
    const auto primitives = list(mesh, "primitives");
    for (std::size_t p = 0; p < primitives.size(); ++p)
      check_primitive(primitives[p], where + "." + place("primitives", p));
  }

  void check_primitive(const json::value& primitive, const std::string& where) {
    for (const char* const name : kPacked)
      if (has_extension(primitive, name)) refuse_extension(where, name);
    const json::value* const attributes = field(primitive, "attributes");
    const std::int64_t positions = attributes == nullptr ? -1 : whole(*attributes, "POSITION", -1);
    const json::value* const accessor = accessor_at(positions);
    if (accessor == nullptr) return;
    if (const std::int64_t type = whole(*accessor, "componentType", kSingle); type != kSingle) {
      throw Refusal("whose " + place("accessors", static_cast<std::size_t>(positions)) + ".componentType is " +
                    std::to_string(type) + ": quantised positions (KHR_mesh_quantization) are not read; " +
                    "export it without quantisation (gltfpack -noq)");
    }
    const json::value* const indices = accessor_at(whole(primitive, "indices", -1));
    const auto corners = static_cast<std::size_t>(
        std::clamp<std::int64_t>(whole(indices != nullptr ? *indices : *accessor, "count", 0), 0, UINT32_MAX));
    const std::int64_t mode = whole(primitive, "mode", 4);
    if (mode == 4) triangles_ += corners / 3;
    if (mode == 5 || mode == 6) triangles_ += std::max<std::size_t>(corners, 2) - 2;
  }

  const json::value* accessor_at(std::int64_t index) const {
    const auto accessors = list(document_, "accessors");
    const bool is_in_range = index >= 0 && static_cast<std::size_t>(index) < accessors.size();
    return is_in_range ? &accessors[static_cast<std::size_t>(index)] : nullptr;
  }

  const json::value& document_;
  std::size_t triangles_ = 0;
};

}  // namespace

std::optional<std::size_t> checked_gltf_triangles(std::span<const std::byte> bytes) {
  boost::system::error_code error;
  json::parse_options options;
  options.max_depth = kMaxDepth;
  const json::value document = json::parse(json_text(bytes), error, {}, options);
  if (error) {
    throw Refusal("which is not a mesh in glTF: its JSON cannot be read (" + error.message() +
                  "); export the mesh again, in the format that its name says");
  }
  const std::size_t triangles = GltfChecker(document).checked_triangles();
  if (document.is_object() && field(document, "meshes") != nullptr && field(document, "meshes")->is_array())
    return triangles;
  return std::nullopt;
}

}  // namespace tandem::server::mesh_reader
