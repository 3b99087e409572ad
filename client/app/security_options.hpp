// Command-line options for the authentication of the server and the token of the user. All programs that join a room
// share them.
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
/// In      keeps_role  true if the user has selected a role; otherwise the token's role is used
/// Fails   std::invalid_argument: one line that names the option and the remedy
void apply_security(const SecurityOptions& options, bool keeps_role, ClientIoSettings& io);

}  // namespace tandem::client
