// The inertia of an assembly: a steel shaft in an aluminium wheel, each with its own density.

#include <bsp2/bsp2.hpp>
#include <iomanip>
#include <iostream>
#include <map>

int main() {
  // `ball`, `d_cylinder`, `cone` and `torus` are truly round, not polyhedra. The shaft runs along z; the
  // wheel has a bore for it, so the two touch and do not overlap. `measure` has the integrals of what it
  // stands around in the report, under a name.
  const bsp2::Expression shaft = bsp2::d_cylinder(3, 1, {10}, true).measure("steel");
  const bsp2::Expression wheel =
      (bsp2::d_cylinder(3, 5, {2}, true) - bsp2::d_cylinder(3, 1, {3}, true)).measure("aluminium");

  // What is round is refined without end, so one says how far: until nothing undecided is thicker than this.
  // All figures are intervals then, which hold the truth for sure.
  const bsp2::Result result = bsp2::evaluate(shaft + wheel, {.tolerance = 0.05});
  const auto parts = result.named_measures();

  // inertia[i][j] is the integral of x_i x_j, with x_0 = 1. About the axis of rotation it is that of
  // x^2 + y^2, times the density.
  const std::map<std::string, double> densities = {{"steel", 7.85}, {"aluminium", 2.70}};
  double least = 0, most = 0;
  for (const auto& [name, density] : densities) {
    const bsp2::Measures& of = parts.at(name);
    least += density * (of.inertia_least[1][1] + of.inertia_least[2][2]);
    most += density * (of.inertia_most[1][1] + of.inertia_most[2][2]);
  }

  // For cylinders there is a formula to compare with: density pi h (R^4 - r^4) / 2.
  const double pi = 3.14159265358979323846;
  const double truth = 7.85 * pi * 10 / 2 + 2.70 * pi * 2 * (625 - 1) / 2;
  std::cout << std::setprecision(8) << "moment of inertia from " << least << " to " << most << ", by formula "
            << truth << '\n'
            << (least <= truth && truth <= most ? "enclosed" : "NOT enclosed") << '\n';
}
