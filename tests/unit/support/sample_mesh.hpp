#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

/// Meshes made by hand, for the tests of what consumes a mesh.
namespace bsp2::samples {

using Point = std::array<double, 3>;

/// A convex polyhedron as loops of points, counter-clockwise seen from outside.
struct Polyhedron {
  std::vector<std::vector<Point>> facets;
};

Polyhedron box(const Point& low, const Point& high);
Polyhedron tetrahedron(const Point& a, const Point& b, const Point& c, const Point& d);
/// The triangle a, b, c (in any order) moved along `up`.
Polyhedron wedge(const Point& a, const Point& b, const Point& c, const Point& up);
double volume(const Polyhedron& solid);

/// The parts of a polyhedron on the two sides of c0 + c1 x + c2 y + c3 z = 0; no facets where a part is
/// empty.
std::array<Polyhedron, 2> split(const Polyhedron& solid, const std::array<double, 4>& plane);

void append(geometry::CellBatch& batch, const Polyhedron& solid, geometry::Label label = geometry::Label::in,
            std::int32_t part = 0);
/// A polygon, counter-clockwise; its edges are stored in a shuffled order.
void append_polygon(geometry::CellBatch& batch, const std::vector<std::array<double, 2>>& polygon,
                    std::mt19937& random);
void append_segment(geometry::CellBatch& batch, double low, double high);

struct SampleMesh {
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
  geometry::BspTree tree;
  double volume = 0;
  std::size_t cells = 0;
};

/// The box [0, 10]^3 split by random planes into `cells` IN cells of random parts, and their tree. The
/// volumes sum to 1000.
SampleMesh random_mesh(std::mt19937& random, std::size_t cells, std::size_t batch_size = 64);

}  // namespace bsp2::samples
