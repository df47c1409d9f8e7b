#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

/// How many tetrahedra are to be expected by their length.
using Counts = std::map<double, double>;

Counts by_parts(const Tetrahedra& mesh, const ShapeOptions& options) {
  Counts counts;
  const std::size_t parts = options.size_of_part.size();
  const std::vector<double> volumes = volumes_of(mesh, parts);
  for (std::size_t part = 0; part <= parts; ++part) {
    const double size = options.size_in(static_cast<std::int32_t>(part));
    counts[size] += count_of_size(volumes[part], size);
  }
  return counts;
}

/// A place in a tetrahedron for a number below 1 in each direction.
Point place_in(const Tetrahedra& mesh, std::size_t t, std::array<double, 3> u) {
  std::sort(u.begin(), u.end());
  const std::array<double, 4> weights{u[0], u[1] - u[0], u[2] - u[1], 1 - u[2]};
  Point place{};
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] += weights[k] * mesh.points[mesh.tetrahedra[t][k]][axis];
  return place;
}

/// At places of equal shares of the volume. Two that say most are not heard: what they stand for may be much
/// smaller than such a share.
Counts by_places(const Tetrahedra& mesh, const ShapeOptions& options) {
  constexpr std::size_t places = 20000, unheard = 2;
  std::vector<double> until(mesh.tetrahedra.size());  // the volume up to each
  double volume = 0;
  for (std::size_t t = 0; t < until.size(); ++t) {
    const auto& [a, b, c, d] = mesh.tetrahedra[t];
    volume += std::max(0.0, volume_of(mesh.points[a], mesh.points[b], mesh.points[c], mesh.points[d]));
    until[t] = volume;
  }
  std::vector<double> sizes;
  // Source: Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018).
  constexpr std::array<double, 3> steps{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  for (std::size_t i = 0; i < places; ++i) {
    const double at = volume * (static_cast<double>(i) + 0.5) / places;
    const auto t = static_cast<std::size_t>(std::lower_bound(until.begin(), until.end(), at) - until.begin());
    if (t == until.size()) continue;
    std::array<double, 3> u;
    for (std::size_t k = 0; k < 3; ++k) u[k] = std::fmod(static_cast<double>(i + 1) * steps[k], 1.0);
    sizes.push_back(std::min(options.size_in(mesh.part[t]), options.field.at(place_in(mesh, t, u))));
  }
  std::sort(sizes.begin(), sizes.end());
  Counts counts;
  for (std::size_t i = std::min(unheard, sizes.size()); i < sizes.size(); ++i)
    counts[sizes[i]] += count_of_size(volume / places, sizes[i]);
  return counts;
}

}  // namespace

double ShapeOptions::size_in(std::int32_t part) const {
  const auto number = static_cast<std::size_t>(part);
  const bool is_own = part >= 0 && number < size_of_part.size() && size_of_part[number] > 0;
  return is_own ? size_of_part[number] : size;
}

double count_of_size(double volume, double size) {
  constexpr double volume_of_regular = 0.118;  // by the cube of its edges
  return volume / (volume_of_regular * size * size * size);
}

ExpectedCount expected_count(const Tetrahedra& mesh, const ShapeOptions& options) {
  ExpectedCount expected;
  double most = 0;
  for (const auto& [size, count] :
       options.field.is_empty() ? by_parts(mesh, options) : by_places(mesh, options)) {
    expected.tetrahedra += count;
    if (count > most) expected.length = size;
    most = std::max(most, count);
  }
  return expected;
}

}  // namespace bsp2::meshing
