// On several processes: mpirun -n 4 ./ranks. The same program runs alone, too.

#include <bsp2/bsp2.hpp>
#include <iostream>

int main() {
  // All processes that were started together. They all run this program and make the same calls of the
  // library in the same order, as each call that takes `ranks` is made by all of them.
  const bsp2::Ranks ranks = bsp2::Ranks::launched();

  bsp2::Expression sponge = bsp2::cube(3);
  for (int i = 0; i < 3; ++i) {
    const bsp2::Expression bar = bsp2::cuboid({1, 1, 5}, true).translate({1.5, 1.5, 1.5});
    sponge -= i == 0   ? bar
              : i == 1 ? bar.rotate({90, 0, 0}).translate({0, 3, 0})
                       : bar.rotate({0, 90, 0}).translate({0, 0, 3});
  }

  // Space is cut into regions, which do not depend on how many processes there are; each computes some. That
  // the cells are the same however many they are, the digest says.
  const bsp2::Result result = bsp2::evaluate(sponge, {.regions = 8, .surface = true}, ranks);

  // The master has all, and speaks; files are written by all together.
  if (ranks.is_master())
    std::cout << "volume " << result.volume().least << ", surface " << result.surface().area << ", digest "
              << result.digest() << '\n';
  result.write("sponge.pvtu");
}
