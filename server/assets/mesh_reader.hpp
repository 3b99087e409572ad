// What mesh_file and the program tandem-mesh-reader agree on. Parsers of mesh files believe what a file declares: 250 bytes
// that speak of two billion vertices made Assimp take 19 GB. So every file is parsed by a process of its own, which has
// bounded memory and time, opens nothing, and may crash:
//
//   tandem-mesh-reader FORMAT      FORMAT  the file's extension without the dot
//   standard input                 the file and those that it needs (the buffers of a .gltf), of a descriptor whose size
//                                  fstat() knows: of each u32 length of its name, u32 bytes, the name, the bytes
//   standard output, exit code 0   kMesh, u32 vertices, u32 triangles, f64 x y z each, i32 a b c each; or kRefusal and text
//   exit code kOutOfMemory         it needed more than address_space_limit()
//   SIGXCPU                        it needed longer than cpu_limit_s()
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::server::mesh_reader {

/// A client must be able to fetch an asset, and the server to build contact of it, in reasonable time.
inline constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20U;
inline constexpr std::size_t kMaxTriangles = 1'000'000;
inline constexpr std::size_t kMaxVertices = 3 * kMaxTriangles;
inline constexpr std::size_t kMaxRefusalBytes = 300;

inline constexpr std::uint8_t kMesh = 'M';
inline constexpr std::uint8_t kRefusal = 'R';
inline constexpr int kOutOfMemory = 3;

/// Of a mesh in bytes, the largest reply.
inline constexpr std::size_t kMaxReplyBytes = 9 + kMaxVertices * 24 + kMaxTriangles * 12;

/// Measured with a million triangles, of each byte of the file: obj and binary stl 27, binary ply 22, ply, off and stl in
/// text 9 to 10; libraries take 60 MiB.
constexpr std::size_t address_space_limit(std::size_t file_bytes) {
  return (std::size_t{384} << 20U) + 40 * file_bytes;
}
/// Of processor time. Measured with the same files: at most 0.065 s a MiB.
constexpr std::size_t cpu_limit_s(std::size_t file_bytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 40 + (file_bytes >> 20U);
#else
  return 2 + (file_bytes >> 24U);
#endif
}

}  // namespace tandem::server::mesh_reader
