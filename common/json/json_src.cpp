// The one translation unit that holds Boost.JSON's definitions, so that Boost stays headers only.
#include <boost/json/src.hpp>
