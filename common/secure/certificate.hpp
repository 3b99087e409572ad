// X.509 certificates of servers: self-signed for key pinning, or issued by a private authority.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/secure/key_pair.hpp"

namespace tandem::secure {

/// A self-signed certificate that carries only the key, for clients that pin it. PEM.
std::string self_signed_certificate(const KeyPair& key);

/// Makes a certificate authority and a server certificate signed by it: ca.pem, ca-key.pem, server.pem, server-key.pem.
///
/// In      names  numeric addresses and host names at which clients reach the server; at least one
/// Fails   std::invalid_argument: the folder cannot be written, or contains one of these files already
void write_dev_certificates(const std::filesystem::path& folder, const std::vector<std::string>& names);

}  // namespace tandem::secure
