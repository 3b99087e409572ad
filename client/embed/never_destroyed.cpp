// Static objects of libtandem.so are never destroyed. At the exit of the program, those that were made last would be
// destroyed first, while the library's threads still use them to ramp the force down.

/// Registers a destructor of a static object. Only the code of this library calls this function, which is not exported.
extern "C" int __cxa_atexit(void (* /*destructor*/)(void*), void* /*object*/, void* /*library*/) {
  return 0;
}
