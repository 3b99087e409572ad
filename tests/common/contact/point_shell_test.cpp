#include "common/contact/point_shell.hpp"
