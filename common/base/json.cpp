// Compiles the definitions of Boost.JSON once, so that Boost remains header-only.
#include <boost/json/src.hpp>
