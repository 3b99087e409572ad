// tandem-client: joins a room with one or two haptic devices. Set-up errors are caught only in this file.
#include <exception>
#include <optional>

#include "client/app/client_run.hpp"
#include "client/app/options.hpp"
#include "client/app/start_run.hpp"
#include "client/app/stop_signals.hpp"
#include "common/realtime/output.hpp"

namespace {

int run(int argc, char** argv, tandem::realtime::Output& output) {
  try {
    const std::optional<tandem::client::ClientOptions> options = tandem::client::parse_client_options(argc, argv);
    if (!options) return 0;
    if (options->window.has_start_screen) return tandem::client::run_from_start(*options, output);
    return tandem::client::run_client(*options, output);
  } catch (const std::exception& error) {
    output.err(std::string("tandem-client: ") + error.what() + "\n");
    return 2;
  }
}

}  // namespace

int main(int argc, char** argv) {
  // Must be called before any thread starts, because threads inherit the signal mask.
  tandem::client::block_stop_signals();
  static tandem::realtime::Output output("tandem-client");
  const int code = run(argc, argv, output);
  output.finish();
  return code;
}
