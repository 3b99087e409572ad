#include "server/assets/contact_cache.hpp"

#include <fstream>

#include "common/base/folders.hpp"

namespace tandem::server {
namespace {

/// Upper bound of the size of a cache entry, above that of any asset. Larger files are ignored.
constexpr std::uintmax_t kMaxEntryBytes = 1U << 30U;

}  // namespace

proto::Sha256 contact_key(const geometry::ContactMesh& mesh, const contact::ContactShapeOptions& options) {
  const std::vector<std::uint8_t> origin = contact::contact_asset_origin(mesh, options);
  return proto::sha256_of(std::as_bytes(std::span(origin)));
}

std::filesystem::path kept_contact_file(const std::filesystem::path& folder, const proto::Sha256& key) {
  return folder / (proto::hex(key) + ".contact");
}

// Reads the cached asset after its key. Each file begins with its key, so that a renamed file is detected.
std::vector<std::uint8_t> read_kept_contact(const std::filesystem::path& file, const proto::Sha256& key) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return {};
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size < key.size() || size > kMaxEntryBytes) return {};
  std::ifstream stream(file, std::ios::binary);
  proto::Sha256 found{};
  stream.read(reinterpret_cast<char*>(found.data()), static_cast<std::streamsize>(found.size()));
  if (!stream || found != key) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size) - key.size());
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) return {};
  return bytes;
}

std::error_code keep_contact(const std::filesystem::path& file, const proto::Sha256& key,
                             std::span<const std::uint8_t> bytes) {
  return replace_cache_file(file, {key, std::as_bytes(bytes)});
}

}  // namespace tandem::server
