#include "common/contact/contact_solver.hpp"
