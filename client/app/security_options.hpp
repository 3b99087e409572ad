// Command-line options for the server's authentication and the user's token, shared by all programs that join a room.
#pragma once

#include <string>

#include "client/net/client_io.hpp"

namespace CLI {
class App;
}

namespace tandem::client {

struct SecurityOptions {
  std::string invitation;
  std::string pin;
  std::string authorities;
  std::string token;
  bool is_insecure = false;
};

void add_security_options(CLI::App& app, SecurityOptions& options);

/// Sets server, trust and token in `io` from the options.
///
/// In      keeps_role  true: the user has selected a role; false: the role of the token is used
/// Fails   std::invalid_argument if an option is invalid or contradicts another one; the message is one line that names
///         the option and the remedy
void apply_security(const SecurityOptions& options, bool keeps_role, ClientIoSettings& io);

}  // namespace tandem::client
