// Writes mesh files of every format that the project reads. The polygons from which a file is written are the reference
// for tests of the readers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::test {

/// A surface with z up. The corners of each face are counter-clockwise as seen from outside.
struct Surface {
  std::vector<Vec3> vertices;
  std::vector<std::vector<int>> faces;
};

struct VolumeAndArea {
  double volume = 0, area = 0;
};

/// Returns volume and area of triangles. They are computed relative to the first corner, so that an offset does not
/// reduce the precision.
inline VolumeAndArea volume_and_area(const std::vector<Vec3>& vertices,
                                     const std::vector<std::array<int, 3>>& triangles) {
  VolumeAndArea sum;
  if (triangles.empty()) return sum;
  const auto corner = [&](const std::array<int, 3>& t, std::size_t i) -> Vec3 {
    return vertices.at(static_cast<std::size_t>(t.at(i))) - vertices.at(static_cast<std::size_t>(triangles[0][0]));
  };
  for (const auto& t : triangles) {
    const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    sum.volume += a.dot(b.cross(c)) / 6;
    sum.area += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

inline VolumeAndArea operator*(const VolumeAndArea& of, double scale) {
  return {of.volume * scale * scale * scale, of.area * scale * scale};
}

/// Returns a prism whose bottom and top are polygons with many corners. `outline` is counter-clockwise.
inline Surface prism(const std::vector<Eigen::Vector2d>& outline, double height) {
  const auto n = static_cast<int>(outline.size());
  Surface surface;
  for (const double z : {0.0, height})
    for (const auto& p : outline) surface.vertices.emplace_back(p.x(), p.y(), z);
  std::vector<int> bottom, top;
  for (int i = 0; i < n; ++i) {
    bottom.push_back(n - 1 - i);
    top.push_back(n + i);
    surface.faces.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
  }
  surface.faces.push_back(bottom);
  surface.faces.push_back(top);
  return surface;
}

/// Returns the surface with the orientation of its faces reversed.
inline Surface reversed(Surface surface) {
  for (auto& face : surface.faces) std::reverse(face.begin(), face.end());
  return surface;
}

/// Returns a fan of triangles from the first corner of each face. The fans give the correct volume for any polygons,
/// and the correct area for convex ones.
inline std::vector<std::array<int, 3>> fans_of(const Surface& surface) {
  std::vector<std::array<int, 3>> triangles;
  for (const auto& face : surface.faces)
    for (std::size_t i = 2; i < face.size(); ++i) triangles.push_back({face[0], face[i - 1], face[i]});
  return triangles;
}

template <class Number>
void append(std::string& bytes, Number value, bool is_big_endian = false) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  if (is_big_endian) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

inline std::string text_of(const Vec3& p) {
  std::ostringstream text;
  text.precision(17);
  text << p.x() << ' ' << p.y() << ' ' << p.z();
  return text.str();
}

template <class Indices>
std::string joined(const Indices& indices, int add = 0) {
  std::string text;
  for (const int i : indices) text += (text.empty() ? "" : " ") + std::to_string(i + add);
  return text;
}

inline std::string obj_file(const Surface& s, bool counts_back = false) {
  std::string text = "# a part\r\n";
  for (const Vec3& p : s.vertices) text += "v " + text_of(p) + " # a corner\r\n";
  const int add = counts_back ? -static_cast<int>(s.vertices.size()) : 1;
  for (const auto& face : s.faces) text += "f " + joined(face, add) + "\r\n";
  return text;
}

inline std::string off_file(const Surface& s) {
  std::string text = "OFF # a part\n# counts\n" + std::to_string(s.vertices.size()) + " " +
                     std::to_string(s.faces.size()) + " 0\n# places\n";
  for (const Vec3& p : s.vertices) text += text_of(p) + " # a corner\n\n";
  for (const auto& face : s.faces) text += std::to_string(face.size()) + " " + joined(face) + " 200 100 50\n";
  return text;
}

inline std::string stl_text(const Surface& s) {
  std::string text = "solid part of a solid facet\n";
  for (const auto& t : fans_of(s)) {
    text += "facet normal 0 0 0\n outer loop\n";
    for (const int i : t) text += "  vertex " + text_of(s.vertices[static_cast<std::size_t>(i)]) + "\n";
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid part of a solid facet\n";
}

inline void append_single(std::string& bytes, const Vec3& p) {
  for (const double x : p) append(bytes, static_cast<float>(x));
}

inline std::string stl_binary(const Surface& s) {
  const auto triangles = fans_of(s);
  std::string bytes = "solid in name";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(triangles.size()));
  for (const auto& t : triangles) {
    append_single(bytes, Vec3::Zero());
    for (const int i : t) append_single(bytes, s.vertices[static_cast<std::size_t>(i)]);
    append<std::uint16_t>(bytes, 0);
  }
  return bytes;
}

inline std::string ply_header(const Surface& s, const std::string& format, const std::string& type,
                              const std::string& faces) {
  return "ply\nformat " + format + " 1.0\nelement camera 1\nproperty float focus\nelement vertex " +
         std::to_string(s.vertices.size()) + "\nproperty " + type + " x\nproperty " + type + " y\nproperty " + type +
         " z\n" + faces + "end_header\n";
}

inline std::string ply_faces(const Surface& s) {
  return "element face " + std::to_string(s.faces.size()) + "\nproperty list uchar int vertex_indices\n";
}

inline std::string ply_text(const Surface& s) {
  std::string text = ply_header(s, "ascii", "float", ply_faces(s)) + "50\n";
  for (const Vec3& p : s.vertices) text += text_of(p) + "\n";
  for (const auto& face : s.faces) text += std::to_string(face.size()) + " " + joined(face) + "\n";
  return text;
}

/// Returns a PLY file: little-endian in single precision or big-endian in double precision.
inline std::string ply_binary(const Surface& s, bool is_double) {
  std::string bytes = ply_header(s, is_double ? "binary_big_endian" : "binary_little_endian",
                                 is_double ? "double" : "float", ply_faces(s));
  append(bytes, 50.0F, is_double);
  for (const Vec3& p : s.vertices) {
    for (const double x : p) is_double ? append(bytes, x, true) : append(bytes, static_cast<float>(x));
  }
  for (const auto& face : s.faces) {
    append(bytes, static_cast<std::uint8_t>(face.size()));
    for (const int i : face) append(bytes, i, is_double);
  }
  return bytes;
}

/// Returns each convex face as a triangle strip, whose corners alternate between the two sides of the face. The strips
/// are separated by -1.
inline std::vector<int> strips_of(const Surface& s) {
  std::vector<int> strips;
  for (const auto& face : s.faces) {
    if (!strips.empty()) strips.push_back(-1);
    strips.push_back(face[0]);
    for (std::size_t low = 1, high = face.size() - 1; low <= high; ++low, --high) {
      strips.push_back(face[low]);
      if (low != high) strips.push_back(face[high]);
    }
  }
  return strips;
}

inline std::string ply_strips(const Surface& s, bool is_binary) {
  const std::vector<int> strips = strips_of(s);
  std::string bytes = ply_header(s, is_binary ? "binary_little_endian" : "ascii", "double",
                                 "element tristrips 1\nproperty list int int vertex_indices\n");
  if (!is_binary) {
    bytes += "50\n";
    for (const Vec3& p : s.vertices) bytes += text_of(p) + "\n";
    return bytes + std::to_string(strips.size()) + " " + joined(strips) + "\n";
  }
  append(bytes, 50.0F);
  for (const Vec3& p : s.vertices)
    for (const double x : p) append(bytes, x);
  append(bytes, static_cast<int>(strips.size()));
  for (const int i : strips) append(bytes, i);
  return bytes;
}

struct ColladaOptions {
  std::string up_axis{};  ///< empty if the file does not state it, which means Y_UP
  std::string unit{};     ///< length unit in metres, for example "0.001"; empty if the file does not state it
  std::string node{};     ///< XML elements of the node's transformation
};

/// Returns a COLLADA file in which the surface's z axis is the up axis of the file.
inline std::string dae_file(const Surface& s, const ColladaOptions& options = {}) {
  const auto in_file = [&options](const Vec3& p) {
    if (options.up_axis == "Z_UP") return p;
    return options.up_axis == "X_UP" ? Vec3(p.z(), -p.x(), -p.y()) : Vec3(p.x(), p.z(), -p.y());
  };
  std::string positions, corners;
  for (const Vec3& p : s.vertices) positions += text_of(in_file(p)) + " ";
  const auto triangles = fans_of(s);
  for (const auto& t : triangles) corners += joined(t) + " ";
  const std::string count = std::to_string(s.vertices.size());
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)" +
         (options.unit.empty() ? "" : "<unit meter=\"" + options.unit + "\"/>") +
         (options.up_axis.empty() ? "" : "<up_axis>" + options.up_axis + "</up_axis>") +
         R"(</asset><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count=")" +
         std::to_string(3 * s.vertices.size()) + "\">" + positions +
         R"(</float_array><technique_common><accessor source="#a" count=")" + count +
         R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>)" +
         R"(</accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>)" +
         "<triangles count=\"" + std::to_string(triangles.size()) +
         R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)" + corners +
         R"(</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>)" +
         options.node + R"(<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>)" +
         R"(<instance_visual_scene url="#s"/></scene></COLLADA>)";
}

struct GltfOptions {
  bool is_binary = true;      ///< .glb if true, otherwise .gltf with a separate file buffer.bin
  std::string required{};     ///< name of a required extension
  bool is_quantised = false;  ///< whether positions are 16-bit numbers
  std::string node = R"("mesh": 0)";
  std::string mesh{};       ///< additional fields of the mesh, each followed by a comma
  std::string primitive{};  ///< additional fields of its primitive, each followed by a comma
};

struct GltfFile {
  std::string file, buffer;
};

inline std::string gltf_json(const Surface& s, const GltfOptions& options, std::size_t positions, std::size_t indices) {
  const std::string extensions = options.required.empty()
                                     ? ""
                                     : R"("extensionsUsed": [")" + options.required +
                                           R"("], "extensionsRequired": [")" + options.required + R"("], )";
  return R"({"asset": {"version": "2.0"}, )" + extensions + R"("scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{)" +
         options.node + R"(}], "meshes": [{)" + options.mesh + R"("primitives": [{)" + options.primitive +
         R"("attributes": {"POSITION": 0}, "indices": 1}]}], "accessors": [)" +
         R"({"bufferView": 0, "type": "VEC3", "componentType": )" + (options.is_quantised ? "5122" : "5126") +
         R"(, "count": )" + std::to_string(s.vertices.size()) +
         R"(}, {"bufferView": 1, "type": "SCALAR", "componentType": 5125, "count": )" + std::to_string(indices / 4) +
         R"(}], "bufferViews": [{"buffer": 0, "byteStride": )" + (options.is_quantised ? "8" : "12") +
         R"(, "byteLength": )" + std::to_string(positions) + R"(}, {"buffer": 0, "byteOffset": )" +
         std::to_string(positions) + R"(, "byteLength": )" + std::to_string(indices) + R"(}], "buffers": [{)" +
         (options.is_binary ? "" : R"("uri": "buffer.bin", )") + R"("byteLength": )" +
         std::to_string(positions + indices) + "}]}";
}

/// Returns a glTF file in which the surface's z axis becomes y, the up axis of the format.
inline GltfFile gltf_file(const Surface& s, const GltfOptions& options = {}) {
  std::string positions, indices;
  for (const Vec3& p : s.vertices) {
    const Vec3 y_up(p.x(), p.z(), -p.y());
    if (!options.is_quantised) append_single(positions, y_up);
    if (!options.is_quantised) continue;
    for (const double x : y_up) append(positions, static_cast<std::int16_t>(x));
    append<std::int16_t>(positions, 0);
  }
  for (const auto& t : fans_of(s))
    for (const int i : t) append(indices, i);
  std::string json = gltf_json(s, options, positions.size(), indices.size());
  if (!options.is_binary) return {json, positions + indices};
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string chunks;
  append(chunks, static_cast<std::uint32_t>(json.size()));
  chunks += "JSON" + json;
  append(chunks, static_cast<std::uint32_t>(positions.size() + indices.size()));
  chunks += std::string("BIN\0", 4) + positions + indices;
  std::string file = "glTF";
  append<std::uint32_t>(file, 2);
  append(file, static_cast<std::uint32_t>(12 + chunks.size()));
  return {file + chunks, ""};
}

inline std::string chunk_3ds(std::uint16_t id, const std::string& content) {
  std::string bytes;
  append(bytes, id);
  append(bytes, static_cast<std::uint32_t>(content.size() + 6));
  return bytes + content;
}

/// Returns a 3DS file.
/// In      master_scale  master scale of the editor (an entry of the file); 0 omits the entry
inline std::string file_3ds(const Surface& s, float master_scale = 0) {
  std::string vertices, faces, scale;
  append(vertices, static_cast<std::uint16_t>(s.vertices.size()));
  for (const Vec3& p : s.vertices) append_single(vertices, p);
  const auto triangles = fans_of(s);
  append(faces, static_cast<std::uint16_t>(triangles.size()));
  for (const auto& t : triangles) {
    for (const int i : t) append(faces, static_cast<std::uint16_t>(i));
    append<std::uint16_t>(faces, 0);
  }
  if (master_scale != 0) append(scale, master_scale);
  const std::string mesh = chunk_3ds(0x4100, chunk_3ds(0x4110, vertices) + chunk_3ds(0x4120, faces));
  const std::string object = chunk_3ds(0x4000, std::string("part\0", 5) + mesh);
  return chunk_3ds(0x4d4d, chunk_3ds(0x3d3d, (scale.empty() ? "" : chunk_3ds(0x0100, scale)) + object));
}

}  // namespace tandem::test
