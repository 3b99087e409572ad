// Prevents the destruction of static objects of libtandem.so. At the exit of the program, the static objects created
// last would be destroyed first, while threads of the library still use them to ramp the force to zero.

/// Replaces the C++ runtime function that registers the destructor of a static object, and registers nothing. The
/// function is not exported, so that only code of this library calls it.
extern "C" int __cxa_atexit(void (* /*destructor*/)(void*), void* /*object*/, void* /*library*/) {
  return 0;
}
