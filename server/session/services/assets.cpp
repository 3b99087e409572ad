#include <algorithm>

#include "proto/control_framing.hpp"
#include "server/session/services/services.hpp"
#include "server/session/session_answers.hpp"

namespace tandem::server {
namespace {

/// Returns the requested chunk of an asset of the scene, or an error with the reason.
wire::ServerControl asset_answer(std::uint32_t request, const wire::GetAsset& wanted, const LoadedScene& scene) {
  const auto asset = std::find_if(scene.assets.begin(), scene.assets.end(), [&wanted](const Asset& candidate) {
    const auto* hash = reinterpret_cast<const char*>(candidate.sha256.data());
    return wanted.sha256() == std::string_view(hash, candidate.sha256.size());
  });
  if (asset == scene.assets.end()) {
    return error_answer(request, wire::ERROR_UNKNOWN_ASSET, "this room has no asset of that hash");
  }
  const proto::Bytes& bytes = *asset->bytes;
  if (wanted.offset() > bytes.size()) {
    return error_answer(request, wire::ERROR_BAD_VALUE, "the offset is past the asset's end");
  }
  wire::ServerControl answer;
  answer.set_request(request);
  wire::AssetChunk& chunk = *answer.mutable_asset_chunk();
  chunk.set_sha256(wanted.sha256());
  chunk.set_offset(wanted.offset());
  chunk.set_total_bytes(bytes.size());
  const auto offset = static_cast<std::size_t>(wanted.offset());
  const std::size_t bound = wanted.max_bytes() > 0 ? wanted.max_bytes() : proto::kAssetChunkBytes;
  chunk.set_data(bytes.data() + offset, std::min({bound, proto::kAssetChunkBytes, bytes.size() - offset}));
  return answer;
}

class Assets final : public SessionService {
 public:
  explicit Assets(ServiceHost& host) : host_(host) {}
  std::vector<Case> cases() const override { return {Case::kGetAsset}; }
  void handle(SessionUser& user, const wire::ClientControl& message) override {
    host_.send(user, asset_answer(message.request(), message.get_asset(), user.room().scene()));
  }

 private:
  ServiceHost& host_;
};

}  // namespace

std::unique_ptr<SessionService> make_assets(ServiceHost& host) {
  return std::make_unique<Assets>(host);
}

}  // namespace tandem::server
