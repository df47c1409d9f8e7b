// A solid of four dimensions: all places that a moving plate takes, with the time as the fourth axis.

#include <bsp2/bsp2.hpp>
#include <iostream>

int main() {
  // A plate of 4 x 3 x 1. Times an interval of time it is the plate at rest for two units of time.
  const bsp2::Expression plate = bsp2::cuboid({4, 3, 1});
  const bsp2::Expression rests = bsp2::extrude(plate, {2});

  // Sheared along x by the time, it is the plate that moves at a speed of 3: x becomes x + 3 t.
  const bsp2::Expression moves = rests.transform({{1, 0, 0, 3, 0},  //
                                                  {0, 1, 0, 0, 0},
                                                  {0, 0, 1, 0, 0},
                                                  {0, 0, 0, 1, 0},
                                                  {0, 0, 0, 0, 1}});

  // First it moves, then it rests at the end of its way.
  const bsp2::Expression way = moves + rests.translate({6, 0, 0, 2});
  std::cout << "content in space and time " << bsp2::evaluate(way).volume().least << '\n';

  // The plate at a time is a section, the space that it ever takes is a shadow.
  std::cout << "starts at x = " << bsp2::evaluate(bsp2::section(way, 4, 0.5)).bounds().first[0]
            << " at t = 0.5\n";
  std::cout << "sweeps a volume of " << bsp2::evaluate(bsp2::project(way, 3)).volume().least << '\n';

  // Does it hit a post that stands at x = 8 until t = 1? The intersection says where and when: it is empty if
  // not, and otherwise its least t is the time of the collision.
  const bsp2::Expression post = bsp2::extrude(bsp2::cuboid({1, 3, 5}).translate({8, 0, 0}), {1});
  const auto hits = bsp2::evaluate(way & post).bounds().first;
  std::cout << (hits.empty() ? "no collision with the post that leaves early\n" : "collision\n");
  const bsp2::Expression stays = bsp2::extrude(bsp2::cuboid({1, 3, 5}).translate({8, 0, 0}), {4});
  std::cout << "collision with the other one at t = " << bsp2::evaluate(way & stays).bounds().first[3]
            << '\n';
}
