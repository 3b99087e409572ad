// Boost.JSON, compiled once: include this instead of <boost/json.hpp> and link tandem_base. It is for files that
// people write and programs read. Scene files use the JSON mapping of Protobuf instead.
#pragma once

#include <boost/json.hpp>
