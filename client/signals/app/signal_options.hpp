// Command-line options of programs that send signals: the server, the room, and the token of the source.
#pragma once

#include <string>

#include "client/app/security_options.hpp"
#include "client/signals/signal_connection.hpp"

namespace tandem::client {

struct SignalOptions {
  std::string server = "127.0.0.1:47800";
  std::string room;
  std::string name;
  SecurityOptions security;

  /// Returns whether an option identifies a server.
  bool has_server() const {
    return !security.invitation.empty() || !security.pin.empty() || !security.authorities.empty() ||
           security.is_insecure;
  }
};

void add_signal_options(CLI::App& app, SignalOptions& options);
/// Fails   std::invalid_argument if an option is invalid; the message is one line that names the option and the remedy
SignalConnectionSettings connection_of(const SignalOptions& options);

}  // namespace tandem::client
