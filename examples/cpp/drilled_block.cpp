// A drilled block: from an expression to a volume, a mesh of convex cells and a file for the printer.

#include <bsp2/bsp2.hpp>
#include <iostream>

int main() {
  // Solids are values. A block of 40 x 30 x 10, and three holes through it, which are a little longer than it
  // is thick: so no face of theirs lies in a face of the block.
  const bsp2::Expression block = bsp2::cuboid({40, 30, 10});
  const bsp2::Expression hole = bsp2::cylinder(12, 3, /*center=*/false, {.fn = 48}).translate({0, 0, -1});
  const bsp2::Expression drilled =
      block - hole.translate({10, 15, 0}) - hole.translate({20, 15, 0}) - hole.translate({30, 15, 0});

  // Nothing has been computed so far. Now it is, on all cores.
  const bsp2::Result result = bsp2::evaluate(drilled);
  std::cout << "volume " << result.volume().least << ", " << result.cells().size() << " convex cells\n";

  // The surface is found when it is asked for; its edges all fit together.
  const bsp2::Surface surface = result.surface();
  std::cout << "surface " << surface.area << ", " << (surface.closed ? "closed" : "open") << '\n';

  // What is in the middle of the first hole, and how far away is the solid?
  const bsp2::Locations where = result.locate(std::vector<double>{10, 15, 5});
  std::cout << (where.labels[0] == bsp2::label::in ? "solid" : "air") << ", " << where.distances[0]
            << " to the wall\n";

  // Files are written by their endings. What there is to say about one is not lost.
  for (const char* file : {"drilled_block.stl", "drilled_block.csg"})
    for (const std::string& warning : result.write(file)) std::cerr << warning << '\n';
}
