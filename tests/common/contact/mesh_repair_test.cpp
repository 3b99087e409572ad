#include "common/contact/mesh_repair.hpp"
