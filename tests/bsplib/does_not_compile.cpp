// Each CASE_... must be refused by the compiler; without one this file compiles.
#include <does_not_compile.hpp>

using namespace bsp2::bsplib;

void check([[maybe_unused]] World& world) {
#ifdef CASE_NOTHING
  Array<double> array(world, 1);
  array.put(0, 1.0, 0);
  Queue<std::string> queue(world);
  queue.send(0, "text");
  Array<std::array<std::optional<int>, 3>> nested(world, 1);
  Queue<std::pair<std::string, std::vector<double>>> pairs(world);
  pairs.send(0, {});
#endif
#ifdef CASE_PUT_REFERENCE_WRAPPER
  Array<std::reference_wrapper<int>> array(world, 1);
#endif
#ifdef CASE_PUT_ARRAY_OF_POINTERS
  Array<std::array<int*, 3>> array(world, 1);
#endif
#ifdef CASE_PUT_NESTED_POINTERS
  Array<std::array<std::optional<const char*>, 2>> array(world, 1);
#endif
#ifdef CASE_REGISTERED_POINTERS
  std::vector<std::array<int*, 2>> local(1);
  Registered<std::array<int*, 2>> registered(world, local);
#endif
#ifdef CASE_QUEUE_REFERENCE_WRAPPER
  Queue<std::reference_wrapper<int>> queue(world);
#endif
#ifdef CASE_QUEUE_ARRAY_OF_POINTERS
  Queue<std::array<int*, 3>> queue(world);
#endif
#ifdef CASE_QUEUE_PAIR_OF_POINTERS
  Queue<std::pair<int, std::string*>> queue(world);
#endif
#ifdef CASE_QUEUE_TUPLE_OF_POINTERS
  Queue<std::tuple<int, const int&>> queue(world);
#endif
#ifdef CASE_QUEUE_VECTOR_OF_POINTERS
  Queue<std::vector<std::string*>> queue(world);
#endif
#ifdef CASE_COLLECTIVES_PAIR_OF_POINTERS
  Collectives<std::pair<int*, int>> all(world);
#endif
#ifdef CASE_BROADCAST_POINTERS
  std::vector<std::array<int*, 2>> local(1);
  broadcast(world, std::span(local), 0);
#endif
#ifdef CASE_QUEUE_WITHOUT_DEFAULT
  struct Named {
    explicit Named(int number) : text(std::to_string(number)) {}
    std::string text;
  };
  Queue<Named> queue(world);
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
