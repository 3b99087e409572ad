#include "client/session/credentials.hpp"

#include "proto/join_token.hpp"

namespace tandem::client {
namespace {

constexpr std::size_t kCredentialBytes = 16;

}  // namespace

Credentials::Credentials(proto::Bytes token) : token_(std::move(token)) {
  const auto claims = proto::peek_token(token_);
  are_for_one_room_ = claims && !claims->room().empty();
}

std::shared_ptr<const Credentials> Credentials::beside() const {
  if (!resume_key_ || credential_.empty()) return nullptr;
  auto second = std::make_shared<Credentials>(proto::Bytes{});
  second->first_key_ = resume_key_;
  second->first_credential_ = credential_;
  second->are_for_one_room_ = are_for_one_room_;
  return second;
}

void Credentials::fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection) {
  const auto exported = transport.exported(secure::kResumeExport, proto::seal_context(connection));
  if (!exported) return;
  const auto prove = [&exported](const secure::KeyPair& key, const std::string& credential, wire::Resume& to) {
    const secure::Signature signature = key.sign(exported->secret.bytes());
    to.set_credential(credential);
    to.set_signature(signature.data(), signature.size());
  };
  if (!resume_key_) resume_key_ = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  if (!credential_.empty()) return prove(*resume_key_, credential_, *join.mutable_resume());
  const secure::PublicKey key = resume_key_->public_key();
  join.set_resume_key(key.data(), key.size());
  if (first_key_) return prove(*first_key_, first_credential_, *join.mutable_beside());
  join.set_token(token_.data(), token_.size());
}

void Credentials::accept(const wire::Joined& joined) {
  secure::wipe(token_);
  token_.clear();
  // A credential of unexpected length is ignored. tandem-server never issues one, and it might not fit into a join
  // message.
  const bool is_one = joined.resume_credential().size() == kCredentialBytes;
  credential_ = is_one ? joined.resume_credential() : std::string();
}

}  // namespace tandem::client
