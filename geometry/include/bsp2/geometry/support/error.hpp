#pragma once

#include "bsp2/error.hpp"  // what users of the library see of it, too
