#include "common/contact/distance_grid.hpp"
