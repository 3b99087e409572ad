// Implements the function that the later version of the library adds (abi_test.py).
#include "client/embed/c/tandem.h"

extern "C" tandem_status tandem_client_later(tandem_client client, double* later_s) noexcept {
  auto session = tandem_session{};
  session.struct_size = sizeof session;
  *later_s = 42;
  return tandem_client_session(client, &session);
}
