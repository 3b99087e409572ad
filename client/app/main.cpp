// tandem-client: joins a room with one device. The only place that catches what goes wrong in the set-up.
#include <exception>
#include <iostream>
#include <optional>

#include "client/app/client_run.hpp"
#include "client/app/options.hpp"
#include "client/app/stop_signals.hpp"

int main(int argc, char** argv) {
  try {
    tandem::client::block_stop_signals();
    const std::optional<tandem::client::ClientOptions> options = tandem::client::parse_client_options(argc, argv);
    if (!options) return 0;
    return tandem::client::run_client(*options);
  } catch (const std::exception& error) {
    std::cerr << "tandem-client: " << error.what() << '\n';
    return 2;
  }
}
