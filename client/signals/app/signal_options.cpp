#include "client/signals/app/signal_options.hpp"

#include <CLI/CLI.hpp>

#include "client/app/options.hpp"

namespace tandem::client {

void add_signal_options(CLI::App& app, SignalOptions& options) {
  app.add_option("--server", options.server, "server of the room, an IPv6 address in brackets")
      ->capture_default_str()
      ->type_name("ADDRESS:PORT");
  app.add_option("--room", options.room, "room to send to; default: the server's only room")->type_name("NAME");
  app.add_option("--source-name", options.name, "name of this source in the server's log [signal]")->type_name("NAME");
  add_security_options(app, options.security);
}

SignalConnectionSettings connection_of(const SignalOptions& options) {
  ClientIoSettings io;
  io.client.session.role = wire::ROLE_SIGNAL;
  apply_server(options.server, io);
  apply_security(options.security, true, io);
  SignalConnectionSettings settings;
  settings.host = io.host;
  settings.port = io.port;
  settings.trust = io.trust;
  settings.session.room = options.room;
  if (!options.name.empty()) settings.session.name = options.name;
  settings.session.token = io.client.session.token;
  return settings;
}

}  // namespace tandem::client
