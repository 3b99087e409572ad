// Cache of contact assets: the data from which contact shapes of meshes are loaded. It is a folder to which other
// programs may write, so every entry is checked when it is read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

#include "common/contact/contact_shape.hpp"
#include "proto/content_hash.hpp"

namespace tandem::server {

/// Cache key of a contact asset: a hash of all data that determine the bytes of the asset.
proto::Sha256 contact_key(const geometry::ContactMesh& mesh, const contact::ContactShapeOptions& options);

std::filesystem::path kept_contact_file(const std::filesystem::path& folder, const proto::Sha256& key);

/// Returns the bytes of a cached asset. Returns an empty vector if the file does not begin with `key`. The caller
/// checks the bytes with contact_shape_from().
std::vector<std::uint8_t> read_kept_contact(const std::filesystem::path& file, const proto::Sha256& key);

/// Writes an asset to the cache.
/// Out     error code of the write; zero if it succeeded
std::error_code keep_contact(const std::filesystem::path& file, const proto::Sha256& key,
                             std::span<const std::uint8_t> bytes);

}  // namespace tandem::server
