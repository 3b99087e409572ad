// Boost.JSON's definitions, compiled here alone, so that Boost stays headers only.
#include <boost/json/src.hpp>
