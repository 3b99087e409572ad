// Includes Boost.JSON, whose definitions json.cpp compiles once. Include this header instead of <boost/json.hpp> and
// link tandem_base. It is used for files that people write and programs read. Scene files use the JSON mapping of
// Protobuf instead.
#pragma once

#include <boost/json.hpp>
