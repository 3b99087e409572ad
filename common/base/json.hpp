// Boost.JSON, compiled once: include this instead of <boost/json.hpp> and link tandem_base. For files that
// people write and programs read; scene files are Protobuf's JSON mapping instead.
#pragma once

#include <boost/json.hpp>
