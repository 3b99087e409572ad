#include <map>

#include "proto/soft_shape.hpp"
#include "server/session/services/services.hpp"

namespace tandem::server {
namespace {

class SoftShapes final : public SessionService {
 public:
  explicit SoftShapes(ServiceHost& host) : host_(host) {}
  void on_joined(SessionUser& user, const wire::JoinRoom& granted) override {
    if (granted.wants_soft_shapes()) sent_[&user];
  }
  void on_left(SessionUser& user) override { sent_.erase(&user); }
  void on_poll() override;

 private:
  void send(SessionUser& user, const wire::ServerControl& message);

  ServiceHost& host_;
  /// Last sent offsets by user and soft body. Contains only users who requested shapes.
  std::map<const SessionUser*, std::map<std::uint32_t, std::string>> sent_;
};

void SoftShapes::on_poll() {
  for (const auto& seats : host_.rooms()) {
    realtime::Mailbox<SoftOffsets>& mailbox = seats->room().soft_offsets();
    if (!mailbox.poll()) continue;
    const SoftOffsets& offsets = mailbox.front();
    for (std::size_t body = 0; body < offsets.size(); ++body) {
      wire::ServerControl message;
      proto::write_soft_shape(body, offsets[body], *message.mutable_soft_shape());
      for (SessionUser* user : host_.users_of(seats->room())) send(*user, message);
    }
  }
}

/// Sends a shape. Skips it if it is unchanged, or if control bytes are still queued for the user, so that outdated
/// shapes do not accumulate.
void SoftShapes::send(SessionUser& user, const wire::ServerControl& message) {
  const auto found = sent_.find(&user);
  if (found == sent_.end()) return;
  std::string& sent = found->second[message.soft_shape().soft_body()];
  if (sent == message.soft_shape().offsets() || host_.queued_bytes(user) > 0) return;
  sent = message.soft_shape().offsets();
  host_.send(user, message);
}

}  // namespace

std::unique_ptr<SessionService> make_soft_shapes(ServiceHost& host) {
  return std::make_unique<SoftShapes>(host);
}

}  // namespace tandem::server
