// A library that replaces the SDKs by Force Dimension and 3D Systems in tests. It has the functions that the drivers
// use. It returns values that the test sets, and records the values that it receives. Compiled with WITHOUT_FORCE, it
// lacks the functions that set or release a force.
#include <cstring>

#define EXPORTED extern "C" __attribute__((visibility("default")))

namespace {

struct HdError {
  unsigned code;
  int internal_code;
  unsigned device;
};

}  // namespace

// Inputs that the test sets, and outputs that the test checks.
extern "C" {
__attribute__((visibility("default"))) int fake_is_there = 1;
__attribute__((visibility("default"))) double fake_place[3] = {};    // position [m] for DHD, [mm] for HD
__attribute__((visibility("default"))) double fake_rows[3][3] = {};  // rotation matrix of the handle
__attribute__((visibility("default"))) double fake_velocity_mm_per_s[3] = {};
__attribute__((visibility("default"))) int fake_buttons = 0;
__attribute__((visibility("default"))) double fake_force[6] = {};
__attribute__((visibility("default"))) int fake_is_open = 0;
__attribute__((visibility("default"))) int fake_has_force_on = 0;
__attribute__((visibility("default"))) int fake_watchdog_units = 0;
__attribute__((visibility("default"))) int fake_refuses_watchdog = 0;
__attribute__((visibility("default"))) int fake_refuses_force = 0;
__attribute__((visibility("default"))) int fake_is_in_frame = 0;
__attribute__((visibility("default"))) int fake_calls_out_of_frame = 0;
}

// NOLINTBEGIN(readability-identifier-naming): the vendors chose these names
EXPORTED int dhdOpen() {
  fake_is_open = fake_is_there;
  return fake_is_there != 0 ? 0 : -1;
}
EXPORTED int dhdClose(char) {
  fake_is_open = 0;
  return 0;
}
#ifndef WITHOUT_FORCE
EXPORTED int dhdSetWatchdog(unsigned char units, char) {
  if (fake_refuses_watchdog != 0) return -1;
  fake_watchdog_units = units;
  return 0;
}
#endif
EXPORTED int dhdEnableForce(unsigned char is_on, char) {
  fake_has_force_on = is_on;
  return 0;
}
EXPORTED int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double (*rows)[3], char) {
  if (fake_is_there == 0) return -1;
  *x = fake_place[0];
  *y = fake_place[1];
  *z = fake_place[2];
  std::memcpy(rows, fake_rows, sizeof fake_rows);
  return 0;
}
EXPORTED int dhdGetButton(int index, char) {
  return (fake_buttons >> index) & 1;
}
#ifndef WITHOUT_FORCE
EXPORTED int dhdSetForceAndTorque(double fx, double fy, double fz, double tx, double ty, double tz, char) {
  if (fake_is_there == 0 || fake_refuses_force != 0) return -1;
  const double written[6] = {fx, fy, fz, tx, ty, tz};
  std::memcpy(fake_force, written, sizeof written);
  return 0;
}
#endif

EXPORTED unsigned hdInitDevice(const char*) {
  fake_is_open = fake_is_there;
  return fake_is_there != 0 ? 0 : 0xFFFFFFFF;
}
EXPORTED void hdDisableDevice(unsigned) {
  fake_is_open = 0;
}
EXPORTED void hdMakeCurrentDevice(unsigned) {}
EXPORTED void hdEnable(unsigned what) {
  if (what == 0x4000) fake_has_force_on = 1;
}
EXPORTED void hdStartScheduler() {}
EXPORTED void hdStopScheduler() {
  fake_has_force_on = 0;
}
EXPORTED void hdScheduleSynchronous(unsigned (*callback)(void*), void* data, unsigned short) {
  callback(data);
}
EXPORTED void hdBeginFrame(unsigned) {
  fake_is_in_frame = 1;
}
EXPORTED void hdEndFrame(unsigned) {
  fake_is_in_frame = 0;
}
EXPORTED void hdGetDoublev(unsigned what, double* values) {
  if (fake_is_in_frame == 0) ++fake_calls_out_of_frame;
  if (what == 0x2051) std::memcpy(values, fake_velocity_mm_per_s, sizeof fake_velocity_mm_per_s);
  if (what != 0x2052) return;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) values[4 * column + row] = fake_rows[row][column];
    values[4 * column + 3] = 0;
    values[12 + column] = fake_place[column];
  }
  values[15] = 1;
}
EXPORTED void hdGetIntegerv(unsigned what, int* value) {
  if (what == 0x2000) *value = fake_buttons;
}
#ifndef WITHOUT_FORCE
EXPORTED void hdSetDoublev(unsigned what, const double* values) {
  if (fake_is_in_frame == 0) ++fake_calls_out_of_frame;
  if (what == 0x2700) std::memcpy(fake_force, values, 3 * sizeof(double));
}
#endif
EXPORTED HdError hdGetError() {
  return {fake_is_there != 0 ? 0U : 0x0301U, 0, 0};
}
// NOLINTEND(readability-identifier-naming)
