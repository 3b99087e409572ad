#include "client/exchange/asset_map.hpp"

namespace tandem::client {

const proto::Bytes* find_asset(const AssetMap& assets, const std::string& hash) {
  const auto key = proto::hash_from(hash);
  const auto found = key ? assets.find(*key) : assets.end();
  return found == assets.end() ? nullptr : found->second.get();
}

}  // namespace tandem::client
