#pragma once

// Random models as text, with round solids, in two to four dimensions.

#include <array>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace bsp2::samples {

class RandomText {
 public:
  explicit RandomText(std::uint64_t seed) : random_(seed) {}

  /// A Boolean of Booleans of primitives that are placed anywhere. @param curved share of the primitives that
  /// have no facets.
  std::string model(int dimension, int depth, double curved) {
    if (depth == 0) return placed(dimension, primitive(dimension, curved));
    static constexpr std::array<const char*, 5> kinds{"union", "intersection", "difference", "difference",
                                                      "symmetric_difference"};
    std::string text = kinds[static_cast<std::size_t>(pick(0, 4))] + std::string("() {");
    for (int i = pick(2, 3); i > 0; --i) text += " " + model(dimension, chance(0.4) ? 0 : depth - 1, curved);
    return text + " }";
  }

  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool chance(double share) { return uniform(0, 1) < share; }

 private:
  std::mt19937_64 random_;

  static std::string text_of(double x) {
    std::ostringstream out;
    out.precision(17);
    out << x;
    return out.str();
  }
  std::string number(double low, double high) { return text_of(uniform(low, high)); }

  std::string primitive(int dimension, double curved) {
    const std::string in = "(dimension=" + std::to_string(dimension) + ", ";
    if (!chance(curved)) {
      if (chance(0.3)) return "simplex" + in + "size=" + number(0.5, 2) + ");";
      std::string sizes;
      for (int i = 0; i < dimension; ++i) sizes += (i > 0 ? "," : "") + number(0.3, 2);
      return "cuboid(size=[" + sizes + "]);";
    }
    const int kind = pick(0, 5);
    if (kind < 2) return "ball" + in + "r=" + number(0.3, 1.2) + ");";
    if (kind == 2 && dimension == 3)
      return "cone(h=" + number(0.5, 2) + ", r1=" + number(0.3, 1.2) +
             ", r2=" + (chance(0.5) ? "0" : number(0.1, 1)) + ");";
    if (kind == 3 && dimension == 3) return "torus(R=" + number(0.6, 1.2) + ", r=" + number(0.1, 0.6) + ");";
    if (kind == 3 && dimension == 2)
      return "section(axis=" + std::to_string(pick(1, 3)) + ", at=" + number(-0.3, 0.3) + ") { " +
             primitive(3, 1) + " }";
    if (kind == 4 && dimension == 4) return "extrude(h=" + number(0.3, 1.5) + ") { " + primitive(3, 1) + " }";
    if (kind == 5 && dimension == 2)
      return "bspline(closed=true, points=[[1,0],[0.3,1.1],[-0.9," + number(0.1, 0.9) +
             "],[-0.4,-1],[0.5,-0.7]]);";
    return "d_cylinder" + in + "r=" + number(0.3, 1.2) + ", h=" + number(0.3, 2) + ");";
  }

  std::string placed(int dimension, const std::string& primitive) {
    const int size = std::max(dimension, 3) + 1;  // matrices of the plane are those of space
    std::vector<std::vector<double>> m(static_cast<std::size_t>(size),
                                       std::vector<double>(static_cast<std::size_t>(size)));
    for (std::size_t i = 0; i < m.size(); ++i) m[i][i] = 1;
    for (std::size_t i = 0; i < static_cast<std::size_t>(dimension); ++i)
      m[i].back() = chance(0.3) ? pick(-1, 1) : uniform(-1, 1);
    for (int turn = pick(0, dimension - 1); turn > 0; --turn) {
      const auto i = static_cast<std::size_t>(pick(0, dimension - 2));
      const auto j = static_cast<std::size_t>(pick(static_cast<int>(i) + 1, dimension - 1));
      const double angle = uniform(-3, 3), c = std::cos(angle), s = std::sin(angle);
      for (std::size_t k = 0; k < m.size(); ++k) {
        const double a = m[i][k], b = m[j][k];
        m[i][k] = c * a - s * b;
        m[j][k] = s * a + c * b;
      }
    }
    std::string rows;
    for (const auto& row : m) {
      std::string numbers;
      for (const double x : row) numbers += (numbers.empty() ? "" : ",") + text_of(x);
      rows += (rows.empty() ? "[" : ",[") + numbers + "]";
    }
    return "multmatrix(m=[" + rows + "]) { " + primitive + " }";
  }
};

}  // namespace bsp2::samples
