#include "common/contact/contact_shape.hpp"
