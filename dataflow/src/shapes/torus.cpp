#include "bsp2/dataflow/shapes/torus.hpp"

#include <cmath>

namespace bsp2::dataflow {

RoundFrame<3> Torus::frame(const model::Torus& torus) {
  const double minor = torus.minor / torus.major, reach = std::nextafter(1 + minor, 3.0),
               height = std::nextafter(minor, 2.0);
  return {{torus.major, torus.major, torus.major},
          {{-reach, -reach, -height}, {reach, reach, height}},
          std::nullopt,
          {}};
}

Torus Torus::place(const model::Torus& torus, geometry::HyperplaneTable<3>& table, std::uint32_t map,
                   std::uint32_t limit) {
  const geometry::RoundFamily<3> fan(2, 1, 1, limit / 8);
  const geometry::TorusFamily family(torus.minor / torus.major, limit - limit / 8);
  check_hyperplanes(std::uint64_t{fan.count()} + family.count(), limit);
  const auto first_of_fan = table.add_family(map, fan);
  return {fan, first_of_fan, family, table.add_family(map, family), table.map(map).inverse(table.radius())};
}

}  // namespace bsp2::dataflow
