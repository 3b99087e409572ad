// Writes the seeds for the fuzz targets of the transport with the project's own writers: sealed datagrams, tokens,
// invitations, and the first message of a client.
#include <filesystem>
#include <iostream>

#include "proto/datagram_channel.hpp"
#include "proto/join_token.hpp"
#include "proto/state_codec.hpp"
#include "tests/fuzz/secure_seeds.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using namespace tandem;

/// Writes a state datagram and a path message (a check of the client's address). Each is written sealed with the known
/// secret, and without a seal. The fuzz target seals the second kind itself.
template <class Update, class Append>
void write_datagrams(const std::filesystem::path& folder, proto::DatagramType type, const std::string& name,
                     const Append& append) {
  for (const bool is_sealed : {true, false}) {
    proto::ChannelCounters counters;
    proto::DatagramChannel channel({.sends = type,
                                    .connection = fuzz::kConnection,
                                    .max_rate_hz = 1000,
                                    .secret = is_sealed ? std::optional(fuzz::fixed_secret()) : std::nullopt},
                                   counters);
    const std::string stem = name + (is_sealed ? "" : "_plain");
    Update update;
    channel.send(update, LocalTime(std::chrono::seconds(1)), false, append, [&](std::span<const std::byte> datagram) {
      fuzz::write_seed(folder / stem, datagram);
      return true;
    });
    fuzz::write_seed(folder / (stem + "_path"), channel.path_message(7, LocalTime(std::chrono::seconds(1))));
  }
}

void write_tokens(const std::filesystem::path& folder) {
  const auto issuer = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  wire::TokenClaims claims;
  claims.set_audience(std::string(sizeof(secure::KeyId), 'a'));
  claims.set_role(wire::ROLE_MANIPULATOR);
  claims.set_room("attic");
  claims.set_user_name("ada");
  claims.set_max_force_n(3);
  claims.set_issued_ms(1);
  claims.set_expires_ms(60'001);
  const proto::Bytes token = proto::sign_token(claims, issuer);
  fuzz::write_seed(folder / "token", token);
  const std::string text = proto::text_of(proto::Invitation{"127.0.0.1:47800", issuer.id(), token});
  fuzz::write_seed(folder / "invitation", std::as_bytes(std::span(text)));
}

void write_hello(const std::filesystem::path& folder) {
  const auto key = secure::KeyPair::make(secure::KeyPair::Kind::kP256);
  const auto context = secure::TlsContext::client({.pin = key.id()});
  secure::TlsStream client(&context);
  secure::Bytes hello;
  client.start(hello);
  fuzz::write_seed(folder / "client_hello", hello);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  write_datagrams<proto::ClientUpdate>(folder / "datagrams", proto::DatagramType::kClientUpdate, "client",
                                       proto::append_client_update);
  write_datagrams<proto::ServerUpdate>(
      folder / "datagrams", proto::DatagramType::kServerUpdate, "server",
      [](const proto::ServerUpdate& update, proto::Bytes& out) { proto::ServerUpdateEncoder().append(update, out); });
  write_tokens(folder / "tokens");
  write_hello(folder / "tls");
  return 0;
}
