/* Ends while its client holds a body, without closing the client. The library must close it at the exit. */
#include <stdio.h>
#include <tandem/tandem.h>

int main(int argc, char** argv) {
  tandem_client_settings settings = {0};
  settings.struct_size = sizeof settings;
  settings.server = argc > 1 ? argv[1] : NULL;
  settings.is_insecure = 1;
  tandem_client client = 0;
  if (tandem_client_open(&settings, &client) < 0 || tandem_client_join(client) < 0 ||
      tandem_client_wait_joined(client, 20) < 0 || tandem_client_start(client) < 0 ||
      tandem_client_grab(client, 0) < 0) {
    fprintf(stderr, "forgets_close: %s\n", tandem_last_error());
    return 2;
  }
  tandem_client_wait_event(client, 1);
  return 0;
}
