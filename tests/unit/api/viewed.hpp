#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/supersteps/loop/run.hpp"
#include "support/seeds.hpp"

// What tests of the viewer need: messages as a page reads them, and models that are random.

namespace bsp2::api {

using Point = std::array<double, 3>;

/// A message as a page reads it.
struct Decoded {
  nlohmann::json header;
  std::string arrays;
  explicit Decoded(const std::string& bytes) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), sizeof length);
    EXPECT_EQ(length % 4, 0U);
    header = nlohmann::json::parse(bytes.substr(4, length));
    arrays = bytes.substr(4 + length);
  }
  /// Whatever the type of whole numbers.
  [[nodiscard]] std::vector<std::int64_t> whole(const char* name) const {
    const std::string type = header["arrays"][name][0];
    if (type == "u8") return read<std::uint8_t, std::int64_t>(name);
    if (type == "u16") return read<std::uint16_t, std::int64_t>(name);
    if (type == "u32") return read<std::uint32_t, std::int64_t>(name);
    EXPECT_EQ(type, "i32");
    return read<std::int32_t, std::int64_t>(name);
  }
  [[nodiscard]] std::vector<double> real(const char* name) const { return read<float, double>(name); }
  [[nodiscard]] std::vector<Point> points() const {
    const std::vector<std::int64_t> places = whole("positions");
    std::vector<Point> points(places.size() / 3);
    for (std::size_t i = 0; i < places.size(); ++i)
      points[i / 3][i % 3] = header["origin"][i % 3].get<double>() +
                             header["step"].get<double>() * static_cast<double>(places[i]);
    return points;
  }

 private:
  template <class Stored, class Number>
  [[nodiscard]] std::vector<Number> read(const char* name) const {
    const nlohmann::json& place = header["arrays"][name];
    std::vector<Stored> stored(place[2].get<std::size_t>());
    const auto first = place[1].get<std::size_t>();
    EXPECT_EQ(first % 4, 0U);
    EXPECT_LE(first + stored.size() * sizeof(Stored), arrays.size());
    if (!stored.empty()) std::memcpy(stored.data(), arrays.data() + first, stored.size() * sizeof(Stored));
    const auto stride = place[3].get<std::size_t>();
    for (std::size_t i = stride; stride > 0 && i < stored.size(); ++i) stored[i] += stored[i - stride];
    return {stored.begin(), stored.end()};
  }
};

inline double six_volumes(const Point& a, const Point& b, const Point& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// Volume inside of triangles, by the divergence theorem.
inline double volume_of(const std::vector<Point>& points, std::span<const std::int64_t> corners) {
  double volume = 0;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    volume += six_volumes(points.at(corners[i]), points.at(corners[i + 1]), points.at(corners[i + 2])) / 6;
  return volume;
}

inline std::uint32_t seed_of_test() {
  const auto seed = samples::new_seed();
  ::testing::Test::RecordProperty("seed", static_cast<int>(seed));
  return seed;
}

/// Boxes turned at random, some of them holes; in two parts that meet.
inline std::string random_model(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-10, 10), size(1, 9), angle(0, 360);
  const auto boxes = [&](int count) {
    std::ostringstream text;
    for (int i = 0; i < count; ++i)
      text << "multmatrix([[1, 0, 0, " << place(random) << "], [0, 1, 0, " << place(random) << "], [0, 0, 1, "
           << place(random)
           << "], [0, 0, 0, 1]]) { multmatrix([[0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0, "
              "1]]) { cube(size = ["
           << size(random) << ", " << size(random) << ", " << size(random) << "], center = true); } }\n";
    return text.str();
  };
  return "part(\"one\") { difference() { union() { " + boxes(6) + "} " + boxes(3) + "} }\npart(\"two\") { " +
         boxes(4) + "}\n";
}

inline supersteps::RunResult evaluated(const std::string& text) {
  supersteps::RunOptions options;
  options.model = "random.csg";
  options.text = std::make_shared<const std::string>(text);
  options.threads = 1;
  options.boundary = options.faces = true;
  return supersteps::run(options);
}

}  // namespace bsp2::api
