// X.509 certificates for servers: self-signed for key pinning, or issued by a private certificate authority.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/secure/key_pair.hpp"

namespace tandem::secure {

/// Returns a self-signed certificate (PEM) for clients that pin the server's key. It contains only the key and a fixed
/// name.
std::string self_signed_certificate(const KeyPair& key);

/// Creates a certificate authority and a server certificate signed by it: ca.pem, ca-key.pem, server.pem,
/// server-key.pem.
///
/// In      names  numeric addresses and host names at which clients reach the server; at least one
/// Fails   std::invalid_argument: the folder cannot be written, or already contains one of these files
void write_dev_certificates(const std::filesystem::path& folder, const std::vector<std::string>& names);

}  // namespace tandem::secure
