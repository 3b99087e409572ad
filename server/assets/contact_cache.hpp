// Contact assets of meshes, kept in a folder. Others can write to it: what is read is checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

#include "common/contact/contact_shape.hpp"
#include "proto/content_hash.hpp"

namespace tandem::server {

/// What an asset is kept by: a hash of all that its bytes depend on.
proto::Sha256 contact_key(const geometry::ContactMesh& mesh, const contact::ContactShapeOptions& options);

std::filesystem::path kept_contact_file(const std::filesystem::path& folder, const proto::Sha256& key);

/// The bytes of an asset; empty for anything that is not a file with that key in front. Whether they are an asset,
/// contact_shape_from() says.
std::vector<std::uint8_t> read_kept_contact(const std::filesystem::path& file, const proto::Sha256& key);

/// Out     what stood in the way
std::error_code keep_contact(const std::filesystem::path& file, const proto::Sha256& key,
                             std::span<const std::uint8_t> bytes);

}  // namespace tandem::server
