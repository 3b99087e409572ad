#include "common/contact/contact_pair.hpp"
