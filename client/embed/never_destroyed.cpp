// Prevents the destruction of static objects of libtandem.so. At the exit of the program, the static objects created
// last would be destroyed first, while threads of the library still use them to ramp the force to zero.

/// Replaces the function of the C++ runtime that registers the destructor of a static object. This version registers
/// nothing. It is not exported, so it has no effect on code outside of this library.
extern "C" int __cxa_atexit(void (* /*destructor*/)(void*), void* /*object*/, void* /*library*/) {
  return 0;
}
