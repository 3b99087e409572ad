// The program tandem-token, which issues join tokens and invitations for a running tandem-server.
#include <CLI/CLI.hpp>
#include <iostream>

#include "common/net/host_port.hpp"
#include "server/app/security.hpp"

namespace {

using namespace tandem;

constexpr int kSetupError = 2;

struct Options {
  server::SecurityOptions keys;
  server::Invited invited;
  std::string server;
  std::string server_key;
  std::filesystem::path issuer;
  std::filesystem::path new_key;
  std::string life = "15min";
};

void declare(CLI::App& app, Options& options) {
  app.add_option("--server", options.server,
                 "where the server is, an IPv6 address in brackets; prints an invitation for tandem-client --join")
      ->type_name("ADDRESS:PORT");
  app.add_option("--state", options.keys.state, "folder of the server's keys, as tandem-server has it")
      ->capture_default_str()
      ->type_name("DIR");
  app.add_option("--key", options.keys.key, "as tandem-server has it")->type_name("FILE.pem");
  app.add_option("--cert", options.keys.certificate, "as tandem-server has it")->type_name("FILE.pem");
  app.add_option("--role", options.invited.role,
                 "role of the user, or a lesser one; signal: a program such as tandem-signal")
      ->check(CLI::IsMember({"manipulator", "operator", "observer", "signal"}).description(""))
      ->capture_default_str()
      ->type_name("manipulator|operator|observer|signal");
  app.add_option("--room", options.invited.room, "the only room that it is for [any of the server]");
  app.add_option("--name", options.invited.name, "the user's name [as the user gives it]");
  app.add_option("--max-force", options.invited.max_force_n,
                 "force limit of the user's coupling [N]; 0: as in the scene")
      ->capture_default_str();
  app.add_option("--valid", options.life, "until it must be used, with unit (s, min, h or d), at most 30d")
      ->capture_default_str()
      ->type_name("TIME");
  app.add_option("--issuer-key", options.issuer,
                 "private key of a service that issues tokens, whose public key the server has by --issuer; with "
                 "--server-key instead of --state")
      ->type_name("FILE.pem");
  app.add_option("--server-key", options.server_key, "key of the server, as it prints it")->type_name("KEY");
  app.add_option("--new-key", options.new_key,
                 "make a private key for --issuer-key, and print its public one for --issuer")
      ->type_name("FILE.pem");
  app.set_version_flag("--version", "tandem-token " TANDEM_VERSION);
  app.footer("Exit code: 0 done, 2 bad input or set-up.");
}

secure::KeyId key_id_of(const std::string& text) {
  const auto bytes = secure::bytes_of_text(text);
  secure::KeyId id{};
  if (!bytes || bytes->size() != id.size()) throw std::invalid_argument("--server-key: '" + text + "' is no key");
  std::ranges::copy(*bytes, id.begin());
  return id;
}

std::string issued(const Options& options) {
  if (!options.issuer.empty()) {
    const auto issuer = secure::KeyPair::load(options.issuer);
    return secure::text_of(server::token_for(options.invited, key_id_of(options.server_key), issuer));
  }
  if (!options.server.empty()) net::host_port_of(options.server);
  const server::ServerKeys keys = server::open_keys(options.keys);
  if (!options.server.empty()) return server::invitation_line(options.invited, options.server, keys);
  return secure::text_of(server::token_for(options.invited, keys.identity.id(), keys.issuer));
}

std::string run(Options& options) {
  if (!options.new_key.empty()) {
    if (std::filesystem::exists(options.new_key))
      throw std::invalid_argument(options.new_key.string() + " is there already");
    const auto key = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
    key.save(options.new_key);
    return secure::text_of(key.public_key());
  }
  options.invited.life = server::valid_for(options.life);
  return issued(options);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Issues join tokens: each admits one person to a room, once.", "tandem-token");
  declare(app, options);
  try {
    app.parse(argc, argv);
    std::cout << run(options) << std::endl;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const std::exception& error) {
    std::cerr << "tandem-token: " << error.what() << "; see --help" << std::endl;
    return kSetupError;
  }
  return 0;
}
