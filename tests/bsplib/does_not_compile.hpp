// What does_not_compile.cpp includes, parsed once for all of its cases.

#include <array>
#include <boost/serialization/utility.hpp>
#include <boost/serialization/vector.hpp>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/queue.hpp"
