// Interface between mesh_file and the program tandem-mesh-reader, which parses each mesh file in a separate process.
// Parsers of mesh files trust the sizes that a file declares. For example, Assimp allocated 19 GB for a file of 250
// bytes that declared two billion vertices. The process has bounded memory and time, opens no files, and may crash:
//
//   tandem-mesh-reader FORMAT      FORMAT  the file's extension without the dot
//   standard input                 the file and its additional files (buffers of a .gltf), from a descriptor of known
//                                  size (fstat()). For each: u32 length of its name, u32 bytes, the name, the bytes
//   standard output, exit code 0   kMesh, u32 vertices, u32 triangles, f64 x y z each, i32 a b c each; or kRefusal and
//                                  text
//   exit code kOutOfMemory         the file needs more memory than address_space_limit()
//   SIGXCPU                        the file needs more processor time than cpu_limit_s()
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::server::mesh_reader {

/// Limits of a file and of its number of triangles. Within them, clients can fetch the asset and the server can build
///        its contact shape in reasonable time.
inline constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20U;
inline constexpr std::size_t kMaxTriangles = 1'000'000;
inline constexpr std::size_t kMaxVertices = 3 * kMaxTriangles;
inline constexpr std::size_t kMaxRefusalBytes = 300;

inline constexpr std::uint8_t kMesh = 'M';
inline constexpr std::uint8_t kRefusal = 'R';
inline constexpr int kOutOfMemory = 3;

/// Number of bytes of the largest mesh reply.
inline constexpr std::size_t kMaxReplyBytes = 9 + kMaxVertices * 24 + kMaxTriangles * 12;

/// Memory limit of the reader: 384 MiB, and 40 bytes per byte of the file. Measured with a million triangles, the
/// reader uses 60 MiB for libraries, and per byte of the file: 27 bytes for obj and binary stl, 22 for binary ply, 9 to
/// 10 for text ply, off and stl.
constexpr std::size_t address_space_limit(std::size_t file_bytes) {
  return (std::size_t{384} << 20U) + 40 * file_bytes;
}
/// Limit of processor time. The reader was measured to need at most 0.065 s per MiB for files with a million triangles.
constexpr std::size_t cpu_limit_s(std::size_t file_bytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 40 + (file_bytes >> 20U);
#else
  return 2 + (file_bytes >> 24U);
#endif
}

}  // namespace tandem::server::mesh_reader
