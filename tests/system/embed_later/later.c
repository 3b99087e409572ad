/* A program of the later version of tandem.h. With OLD_FUNCTIONS it calls no new function, and thus also starts with
 * today's library; a second argument sets the new setting. Prints one JSON object. */
#include <stdio.h>

#include "tandem.h"

static int fail(const char* call) {
  fprintf(stderr, "later: %s: %s\n", call, tandem_last_error());
  return 2;
}

int main(int argc, char** argv) {
  tandem_client_settings settings = {0};
  settings.struct_size = sizeof settings;
  settings.server = argv[1];
  settings.is_insecure = 1;
  settings.later_s = argc > 2 ? 1 : 0;
  tandem_client client = 0;
  if (tandem_client_open(&settings, &client) < 0) return fail("open");
  if (tandem_client_join(client) < 0) return fail("join");
  if (tandem_client_wait_joined(client, 20) < 0) return fail("wait_joined");
  if (tandem_client_start(client) < 0) return fail("start");
  double later_s = 0;
#ifndef OLD_FUNCTIONS
  if (tandem_client_later(client, &later_s) < 0) return fail("later");
#endif
  tandem_tick tick = {.struct_size = sizeof tick, .later_n = 7};
  for (int i = 0; i < 100 && tandem_client_snapshot(client, NULL, &tick) != TANDEM_OK; ++i) {
    tandem_event event = {.struct_size = sizeof event};
    while (tandem_client_next_event(client, &event, NULL, 0) == TANDEM_OK) continue;
    tandem_client_wait_event(client, 0.05);
  }
  printf("{\"tick\": %llu, \"later_n\": %g, \"later_s\": %g}\n", (unsigned long long)tick.number, tick.later_n,
         later_s);
  return tandem_client_close(client) == TANDEM_OK ? 0 : fail("close");
}
