// Passes arbitrary bytes as TLS data to a server from an unknown peer, or to a client from a server. The connection
// must end or wait for more data. It must deliver no data before both ends are authenticated.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "common/secure/certificate.hpp"
#include "common/secure/tls.hpp"

namespace {

using namespace tandem::secure;

void receive(const TlsContext& context, std::span<const std::byte> bytes) {
  TlsStream stream(&context);
  Bytes plain, out;
  stream.start(out);
  const bool is_good = stream.receive(bytes, plain, out);
  if (!plain.empty() || stream.is_established() || (!is_good && stream.problem().empty())) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const KeyPair kKey = KeyPair::make(KeyPair::Kind::kP256);
  static const TlsContext kServer = TlsContext::server(kKey, self_signed_certificate(kKey));
  static const TlsContext kClient = TlsContext::client({.pin = kKey.id()});
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  receive(kServer, bytes);
  receive(kClient, bytes);
  return 0;
}
