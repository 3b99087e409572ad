#include "common/contact/contact_reduction.hpp"
