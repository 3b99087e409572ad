#include "client/app/security_options.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <iostream>
#include <stdexcept>

#include "client/app/options.hpp"
#include "proto/join_token.hpp"

namespace tandem::client {
namespace {

secure::KeyId key_of(const std::string& text) {
  const auto bytes = secure::bytes_of_text(text);
  secure::KeyId key{};
  if (!bytes || bytes->size() != key.size()) {
    throw std::invalid_argument("--pin: '" + text + "' is no key; copy the one that the server prints when it starts");
  }
  std::ranges::copy(*bytes, key.begin());
  return key;
}

void apply_token(const proto::Bytes& token, bool keeps_role, ClientIoSettings& io) {
  const auto claims = proto::peek_token(token);
  if (!claims) throw std::invalid_argument("--token: no join token; copy the whole output of tandem-token");
  io.client.session.token = token;
  if (!keeps_role) io.client.session.role = claims->role();
}

/// Reads a line from stdin, byte by byte, so that later lines remain for the program.
std::string line_from_stdin() {
  constexpr std::size_t kMaxBytes = 1U << 16U;
  std::string line;
  char c = 0;
  while (line.size() < kMaxBytes) {
    const ssize_t count = ::read(STDIN_FILENO, &c, 1);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0 || c == '\n') break;
    line += c;
  }
  return line;
}

/// Returns the text of an option. If the text is "-", reads one line from stdin instead; if stdin is a terminal, a
/// prompt is shown. This option exists because other users of the machine can see secrets on the command line, but not
/// on stdin.
std::string or_from_stdin(const std::string& text, const char* name) {
  if (text != "-") return text;
  if (isatty(STDIN_FILENO) != 0) std::cerr << "Paste the " << name << ", then press Enter: " << std::flush;
  return line_from_stdin();
}

void apply_invitation(const std::string& text, bool keeps_role, ClientIoSettings& io) {
  const auto invitation = proto::invitation_of(or_from_stdin(text, "invitation"));
  // The message does not quote the text: it may be an invitation with a single wrong character, and an invitation is a
  // secret.
  if (!invitation)
    throw std::invalid_argument("--join: no invitation; copy the whole output of tandem-server --invite");
  apply_server(invitation->server, io);
  io.trust = secure::Trust{.pin = invitation->key};
  apply_token(invitation->token, keeps_role, io);
}

}  // namespace

void add_security_options(CLI::App& app, SecurityOptions& options) {
  app.add_option(
         "--join", options.invitation,
         "invitation that tandem-server --invite prints: it has the server's address, its key and a join token; "
         "-: read it from standard input, which hides it from other users of this machine")
      ->type_name("INVITATION");
  app.add_option("--pin", options.pin, "key of the server, as it prints it; instead of --ca")->type_name("KEY");
  app.add_option("--ca", options.authorities, "certificates of authorities that vouch for the server")
      ->type_name("FILE.pem");
  app.add_option("--token", options.token,
                 "join token, as tandem-token prints it; for --pin and --ca; -: read it from standard input")
      ->type_name("TOKEN");
  app.add_flag("--insecure", options.is_insecure,
               "no TLS and no authentication; for a server on this machine that was started with --insecure");
}

void apply_security(const SecurityOptions& options, bool keeps_role, ClientIoSettings& io) {
  const bool knows_server = !options.pin.empty() || !options.authorities.empty();
  const int ways = (options.invitation.empty() ? 0 : 1) + (knows_server ? 1 : 0) + (options.is_insecure ? 1 : 0);
  if (ways != 1) {
    throw std::invalid_argument(std::string(ways == 0 ? "the server is not identified: give " : "give only one of ") +
                                "--join with an invitation, --pin or --ca with --token, or, for a server on this "
                                "machine, --insecure; see --help");
  }
  if (!options.invitation.empty()) return apply_invitation(options.invitation, keeps_role, io);
  if (options.is_insecure) return;
  // The zone of an IPv6 address ("%eth0") is removed, because certificates do not contain zones.
  io.trust = secure::Trust{.ca_file = options.authorities, .host = io.host.substr(0, io.host.find('%'))};
  if (!options.pin.empty()) io.trust->pin = key_of(options.pin);
  const auto token = secure::bytes_of_text(or_from_stdin(options.token, "join token"));
  apply_token(token.value_or(proto::Bytes{}), keeps_role, io);
}

}  // namespace tandem::client
