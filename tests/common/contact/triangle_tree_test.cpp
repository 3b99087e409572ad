#include "common/contact/triangle_tree.hpp"
