// Each CASE_... must be refused by the compiler; without one this file compiles.
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/queue.hpp"

using namespace bsp2::bsplib;

void check([[maybe_unused]] World& world) {
#ifdef CASE_NOTHING
  Array<double> array(world, 1);
  array.put(0, 1.0, 0);
  Queue<std::string> queue(world);
  queue.send(0, "text");
#endif
#ifdef CASE_PUT_STRING
  Array<std::string> array(world, 1);
#endif
#ifdef CASE_PUT_POINTER
  Array<int*> array(world, 1);
#endif
#ifdef CASE_PUT_VIEW
  Array<std::string_view> array(world, 1);
#endif
#ifdef CASE_QUEUE_POINTER
  Queue<const char*> queue(world);
#endif
#ifdef CASE_QUEUE_WITHOUT_SERIALIZE
  struct Opaque {
    std::string text;
  };
  Queue<Opaque> queue(world);
  queue.send(0, Opaque{});
#endif
#ifdef CASE_QUEUE_REFERENCE
  Queue<int&> queue(world);
#endif
#ifdef CASE_WORLD_OF_QUEUE
  Queue<int> queue(world);
  World taken = std::move(queue.world());
#endif
#ifdef CASE_ARRAY_OF_VECTOR
  std::vector<std::vector<int>> local(1);
  Registered<std::vector<int>> registered(world, local);
#endif
#ifdef CASE_SPAN_OF_OTHER_TYPE
  Array<double> array(world, 1);
  std::vector<int> values(1);
  array.put(0, std::span<const int>(values), 0);
#endif
}
