// Assets of a scene in memory, indexed by the SHA-256 of their bytes.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"

namespace tandem::client {

/// The available assets, indexed by the hash of their content.
using AssetMap = std::map<proto::Sha256, std::shared_ptr<const proto::Bytes>>;

/// Looks up an asset by its hash.
///
/// In      hash  32 bytes, as received in a message
/// Out     null if the hash is malformed or the asset is not available
const proto::Bytes* find_asset(const AssetMap& assets, const std::string& hash);

}  // namespace tandem::client
