#include "common/contact/primitive_fields.hpp"
