#include "client/session/credentials.hpp"

namespace tandem::client {
namespace {

constexpr std::size_t kCredentialBytes = 16;

}  // namespace

void Credentials::fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection) {
  const auto exported = transport.exported(secure::kResumeExport, proto::seal_context(connection));
  if (!exported) return;
  if (!resume_key_) resume_key_ = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  if (credential_.empty()) {
    const secure::PublicKey key = resume_key_->public_key();
    join.set_resume_key(key.data(), key.size());
    join.set_token(token_.data(), token_.size());
    return;
  }
  const secure::Signature signature = resume_key_->sign(exported->secret.bytes());
  join.mutable_resume()->set_credential(credential_);
  join.mutable_resume()->set_signature(signature.data(), signature.size());
}

void Credentials::take(const wire::Joined& joined) {
  secure::wipe(token_);
  token_.clear();
  // Of another length it is none of ours, and what is sent back must fit into a message.
  const bool is_one = joined.resume_credential().size() == kCredentialBytes;
  credential_ = is_one ? joined.resume_credential() : std::string();
}

}  // namespace tandem::client
