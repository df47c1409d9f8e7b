// Extrusions that are scaled and twisted: which diagonals cut their sides, as OpenSCAD 2021.01 writes them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/model/expression/csg.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {
namespace {

using Path = std::vector<std::array<double, 2>>;

struct Sample {
  std::vector<Path> paths;  // the outer one counter-clockwise, holes clockwise
  std::array<double, 2> scale;
  double twist;
  std::uint32_t slices;
  /// What OpenSCAD 2021.01 (openscad -o x.off) has between each edge and its copy above, slice by slice: A
  /// from the first corner below to the second above, B the other diagonal, - where both are the same.
  const char* diagonals;
};

const std::vector<Sample> samples{
    {{{{10.3, 3.6}, {10.5, 13.7}, {-8.2, 11.1}, {-4.9, -6.6}, {0, -11.3}}}, {0, 1}, 30, 1, "BABBB"},
    {{{{12.8, -2.7},
       {7.7, 11.8},
       {-0.2, 5},
       {-3.5, 3.3},
       {-12.8, 1.7},
       {-8.8, -6.2},
       {0.3, -13.1},
       {10.8, -10.2}}},
     {1, 0},
     30,
     2,
     "ABAAAAAB BBBBABBB"},
    {{{{17.1, -4.4}, {7.9, 15}, {-8.1, 14.1}, {-15.5, -2.7}, {-3.8, -14.4}, {4.8, -12.6}},
      {{0.2, -2.3}, {-3.8, 0.6}, {0.7, 3.9}, {2.2, 0.6}}},
     {2, 0},
     0,
     4,
     "ABBABBBABA ABBABBBABA ABBABBBABA BAABAAABAB"},
    {{{{5, 3}, {-5, 3}, {-5, -4}, {5, -4}}, {{2, 1}, {2, -1.5}, {-2, -1.5}, {-2, 1}}},
     {1, 0.5},
     -40,
     2,
     "BBBBAAAA BBBBAAAA"},
    {{{{30, 0}, {0, 10}, {0, -10}}}, {2, 0}, 45, 3, "AAB AAA BBB"},
    {{{{6, 4}, {-3, 4}, {-8, -4}, {6, -4}}}, {0, 0.5}, 90, 3, "AAAA AAAA BBB-"},
    {{{{11.8, 0.6}, {5.8, 18.3}, {-7.3, 13.1}, {-14.9, 4.2}, {-8.3, -18.1}, {6.2, -6.9}}},
     {0.7, 1.2},
     0,
     3,
     "BAABAA BAABAA BAABAA"},
    {{{{13.7, -0.9},
       {5.3, 5.3},
       {1.6, 15.7},
       {-12.6, 13.8},
       {-6.7, 0},
       {-6.2, -5.7},
       {-1.9, -10.7},
       {11.1, -10.6}}},
     {0.5, 0},
     0,
     4,
     "BAABAAAB BAABAAAB BAABAAAB ABBABBBB"},
    {{{{13.1, -2.9}, {8.8, 10.7}, {-8.2, 14.6}, {-11.9, 1.8}, {-8.1, -12.6}, {10.5, -16.6}},
      {{1.4, -5.3}, {-5.1, 2.3}, {-0.5, 4.7}, {4, 0.7}}},
     {2, 0},
     -80,
     4,
     "BBBBBBAAAA BBBBBAAAAA BBABBAAAAB AAAAAABABB"},
    {{{{30, 0}, {0, 10}, {0, -10}}}, {0, 1}, 0, 1, "A-B"},
    {{{{6, 4}, {-3, 4}, {-8, -4}, {6, -4}}}, {0, 2}, 0, 2, "-A-- -B--"},
    {{{{6.5, 0.5}, {3.4, 12.6}, {-13.6, 4.1}, {-7.7, -2.4}, {3.2, -14.2}}},
     {0.5, 0},
     -60,
     3,
     "BBBBB BBBBB ABAAA"},
    {{{{11.3, -3.4}, {-0.5, 11.7}, {-4.5, 4.4}, {-10.8, -11.5}, {4.4, -14.4}}}, {1, 1}, 60, 2, "AAAAA AAAAA"},
    {{{{17.5, -1.5}, {4.7, 17.4}, {-6.6, 15.8}, {-18.1, 4.8}, {-9.4, -16.8}, {5.8, -12.5}},
      {{-0.8, -2.8}, {-4.8, -1.4}, {-0.6, 4.4}, {4, 0.2}}},
     {0, 2},
     0,
     2,
     "BAABAAABAB ABBABBBABA"},
    {{{{5, 3}, {-5, 3}, {-5, -4}, {5, -4}}, {{2, 1}, {2, -1.5}, {-2, -1.5}, {-2, 1}}},
     {2, 0},
     60,
     4,
     "AAAABBBB ABABABAB ABAABBAB BBBBAAAA"},
    {{{{30, 0}, {0, 10}, {0, -10}}}, {1, 0.5}, 60, 4, "AAA AAA AAA BAA"},
    {{{{6, 4}, {-3, 4}, {-8, -4}, {6, -4}}}, {0, 1}, -60, 3, "BBBB BBBB AAAA"},
    {{{{9.9, 3.5}, {4.2, 7.3}, {-5.3, 6.1}, {-13.9, -12.2}, {6.6, -10.3}}},
     {0, 0.5},
     0,
     3,
     "BAABA BBABB AABAA"},
    {{{{15.7, 5}, {1.5, 11.6}, {-10.7, 12.7}, {-14.7, -8.1}, {6.4, -8.1}}}, {0, 2}, 0, 1, "ABB-B"},
    {{{{12.7, -2.7}, {13, 14.2}, {-8.6, 9.9}, {-19.4, -4}, {-6.1, -13.5}, {6.9, -11.1}},
      {{1.8, -5}, {-3.4, -1.5}, {-0.6, 4.1}, {5.3, -2.6}}},
     {1.5, 1},
     15,
     1,
     "AABAAABBBB"},
    {{{{5, 3}, {-5, 3}, {-5, -4}, {5, -4}}, {{2, 1}, {2, -1.5}, {-2, -1.5}, {-2, 1}}},
     {0, 1},
     90,
     3,
     "AAAABBBB AAAABBBB B-B--A-A"},
    {{{{30, 0}, {0, 10}, {0, -10}}}, {2, 0}, 0, 4, "A-B A-B A-B B-A"},
    {{{{6, 4}, {-3, 4}, {-8, -4}, {6, -4}}}, {1, 1}, -60, 3, "BBBB BBBB BBBB"},
    {{{{17.8, 3.7}, {5, 5.3}, {-9.1, 15.6}, {-13.9, -2.4}, {-2.5, -6.8}, {4.2, -13.7}}},
     {1, 0},
     15,
     1,
     "BBABBA"},
    {{{{5.6, 0.8},
       {5.5, 5.8},
       {1.7, 16.3},
       {-9.2, 9.2},
       {-18.5, -2.3},
       {-10, -9.5},
       {0, -12.2},
       {8.6, -7.2}}},
     {2, 0},
     120,
     4,
     "AAAAAAAA ABAAAAAA ABAAAAAA BBBBBBBB"},
    {{{{16.9, 4.8}, {5.5, 18.7}, {-6, 15.3}, {-18, -5.1}, {-8.9, -9.5}, {5.9, -11.1}},
      {{0.9, -4.5}, {-2.4, -1}, {-0.8, 5.1}, {2.2, -0.6}}},
     {0, 1},
     0,
     3,
     "BAABBAABAB BAABBAABAB ABBAABBABA"},
    {{{{30, 0}, {0, 10}, {0, -10}}}, {0, 0.5}, 0, 2, "B-A A-B"},
    {{{{6, 4}, {-3, 4}, {-8, -4}, {6, -4}}}, {0, 0.5}, 120, 4, "AAAA AAAA AAAA -B-B"},
    {{{{7.9, -0.8}, {9.4, 12.7}, {-2.9, 13}, {-5.3, 0.2}, {-8.5, -11.6}, {3, -5.1}}},
     {1.5, 1},
     0,
     1,
     "BABBAB"},
    {{{{18.4, -2.3}, {12, 10.7}, {-6.8, 16.2}, {-17.9, 6.6}, {-11.6, -4.9}, {-2.6, -11.6}, {4.6, -7.1}}},
     {0, 0.5},
     -40,
     2,
     "BBBBBBA AAAAAAB"},
    {{{{13.7, 3.5}, {9.4, 8.6}, {-6.1, 15.7}, {-13.9, 2.4}, {-8.3, -8.8}, {11.4, -10.3}},
      {{-0.6, -2.7}, {-5.4, -2.4}, {2, 4.4}, {4.1, 1.7}}},
     {0.5, 0},
     90,
     3,
     "AAAAAABBBB AAAAAAABBB BBBBBBBAAA"},
    {{{{5, 3}, {-5, 3}, {-5, -4}, {5, -4}}, {{2, 1}, {2, -1.5}, {-2, -1.5}, {-2, 1}}},
     {0, 1},
     -60,
     3,
     "BBBBAAAA BBBBAAAA AAAABBBB"},
    {{{{10, 10}, {-10, 10}, {-10, -10}, {10, -10}}, {{1, 0}, {4, 0}, {4, -3}, {1, -3}}},
     {1.5, 1},
     45,
     3,
     "AAAABBBA AAAABBBA AAAABBBA"},
};

constexpr double height = 10;

std::string text_of(const Sample& sample) {
  std::ostringstream text;
  text.precision(17);
  text << "linear_extrude(height = " << height << ", scale = [" << sample.scale[0] << ", " << sample.scale[1]
       << "], twist = " << sample.twist << ", slices = " << sample.slices << ") polygon(points = [";
  for (const Path& path : sample.paths)
    for (const auto& p : path) text << "[" << p[0] << ", " << p[1] << "], ";
  text << "], paths = [";
  std::size_t first = 0;
  for (const Path& path : sample.paths) {
    text << "[";
    for (std::size_t i = 0; i < path.size(); ++i) text << first + i << ", ";
    text << "], ";
    first += path.size();
  }
  text << "]);";
  return text.str();
}

double volume_of(const std::string& text, double coincidence) {
  const auto network =
      compile<3>(model::parse_csg(text, "test.csg").expression, {.coincidence = coincidence});
  EXPECT_TRUE(network.warnings.empty()) << network.warnings.front() << "\n" << text;
  return evaluate_all(network, 0, {}).evaluation.totals.in.value().volume();
}

using Corner = std::array<double, 3>;

/// A sixth of the determinant: what a triangle adds to the volume that it encloses with others.
double volume_under(const Corner& a, const Corner& b, const Corner& c) {
  return (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
          a[2] * (b[0] * c[1] - b[1] * c[0])) /
         6;
}

/// The corners of a slice's path, below and above.
Corner corner_of(const Sample& sample, const Path& path, std::size_t corner, std::uint32_t j) {
  const auto& p = path[corner % path.size()];
  const double t = static_cast<double>(j) / sample.slices, angle = -sample.twist * t * std::numbers::pi / 180;
  return {(1 - (1 - sample.scale[0]) * t) * (std::cos(angle) * p[0] - std::sin(angle) * p[1]),
          (1 - (1 - sample.scale[1]) * t) * (std::sin(angle) * p[0] + std::cos(angle) * p[1]), height * t};
}

/// The volume that the surface with these diagonals encloses, each point as often as it winds around it.
double surface_volume_of(const Sample& sample) {
  double volume = 0;
  const char* diagonal = sample.diagonals;
  for (std::uint32_t slice = 0; slice < sample.slices; ++slice) {
    if (slice > 0) ++diagonal;  // the space between
    for (const Path& path : sample.paths)
      for (std::size_t i = 0; i < path.size(); ++i, ++diagonal) {
        const auto at = [&](std::size_t corner, std::uint32_t j) {
          return corner_of(sample, path, corner, j);
        };
        const Corner p1 = at(i, slice), q1 = at(i + 1, slice), p2 = at(i, slice + 1),
                     q2 = at(i + 1, slice + 1);
        volume += *diagonal == 'A' ? volume_under(p1, q1, q2) + volume_under(p1, q2, p2)
                                   : volume_under(p1, q1, p2) + volume_under(q1, q2, p2);
        if (slice + 1 == sample.slices) volume += volume_under({0, 0, height}, p2, q2);
      }
  }
  return volume;
}

/// The volume of the solid with these diagonals: a longer one may let sides pass through each other, and then
/// each point counts once.
double solid_volume_of(const Sample& sample) {
  std::vector<model::Expression> slices;
  const char* diagonal = sample.diagonals;
  for (std::uint32_t slice = 0; slice < sample.slices; ++slice) {
    if (slice > 0) ++diagonal;
    std::vector<Corner> points;
    std::vector<std::vector<std::uint32_t>> faces;  // clockwise seen from outside
    for (const Path& path : sample.paths) {
      const auto first = static_cast<std::uint32_t>(points.size()),
                 n = static_cast<std::uint32_t>(path.size());
      for (const std::uint32_t j : {slice, slice + 1})
        for (std::size_t i = 0; i < n; ++i) points.push_back(corner_of(sample, path, i, j));
      std::vector<std::uint32_t> bottom, top;
      for (std::uint32_t i = 0; i < n; ++i, ++diagonal) {
        bottom.push_back(first + i);
        top.push_back(first + 2 * n - 1 - i);
        const std::uint32_t p1 = first + i, q1 = first + (i + 1) % n, p2 = p1 + n, q2 = q1 + n;
        if (*diagonal == 'A')
          faces.insert(faces.end(), {{p1, q2, q1}, {p1, p2, q2}});
        else
          faces.insert(faces.end(), {{p1, p2, q1}, {q1, p2, q2}});
      }
      faces.push_back(std::move(bottom));
      faces.push_back(std::move(top));
    }
    slices.push_back(model::polyhedron(points, faces));
  }
  const auto network = compile<3>(model::unite(std::move(slices)), {});
  return evaluate_all(network, 0, {}).evaluation.totals.in.value().volume();
}

TEST(Extrusion, HasTheDiagonalsOfOpenScad) {
  int uncrossed = 0;
  for (const Sample& sample : samples) {
    const double expected = solid_volume_of(sample), enclosed = surface_volume_of(sample);
    uncrossed += std::fabs(enclosed - expected) <= 1e-9 * expected ? 1 : 0;
    for (const double coincidence : {1e-9, 0.0})
      EXPECT_NEAR(volume_of(text_of(sample), coincidence), expected, 1e-9 * expected)
          << text_of(sample) << " " << sample.diagonals;
  }
  EXPECT_GE(uncrossed, 20) << "of " << std::size(samples) << ": there both volumes are one";
}

}  // namespace
}  // namespace bsp2::dataflow
