// Includes Boost.JSON. Include this header instead of <boost/json.hpp>, and link tandem_base, whose json.cpp compiles
// the definitions. Boost.JSON is used for all files that people write except scene files, which use the JSON mapping of
// Protobuf.
#pragma once

#include <boost/json.hpp>
