#include "render/shading.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::supersteps {
namespace {

std::uint32_t scrambled(std::uint32_t h) {
  h *= 0x9e3779b9U;
  h = (h ^ (h >> 15)) * 0x85ebca6bU;
  return h ^ (h >> 13);
}

/// A little lighter or darker, warmer or colder from primitive to primitive, so that neighbours can be told
/// apart.
Colour varied(const Colour& colour, std::int32_t primitive) {
  const std::uint32_t h = scrambled(static_cast<std::uint32_t>(primitive));
  const double light = 1 + 0.07 * ((h & 0xff) / 127.5 - 1), warmth = 0.03 * (((h >> 8) & 0xff) / 127.5 - 1);
  return {colour[0] * light + warmth, colour[1] * light, colour[2] * light - warmth};
}

/// Hue in turns, from red over green to blue.
Colour from_hue(double hue, double saturation, double value) {
  Colour colour;
  for (int i = 0; i < 3; ++i) {
    const double t = std::fabs(6 * (hue + (3 - i) / 3.0 - std::floor(hue + (3 - i) / 3.0)) - 3);
    colour[i] = value * (1 - saturation * (1 - std::clamp(t - 1, 0.0, 1.0)));
  }
  return colour;
}

/// Colours that differ well for neighbouring numbers: hues a golden section apart.
Colour numbered(std::int64_t number) {
  if (number < 0) return {0.75, 0.75, 0.75};
  const double turns = 0.58 + 0.61803398874989485 * static_cast<double>(number);
  return from_hue(turns - std::floor(turns), 0.45 + 0.15 * static_cast<double>(number % 3),
                  0.95 - 0.1 * static_cast<double>(number / 3 % 3));
}

constexpr Colour mist{0.96, 0.55, 0.22};

Ink model_ink(const RunResult& result, std::int32_t primitive) {
  const auto& colours = result.colour_of_primitive;
  if (primitive >= 0 && static_cast<std::size_t>(primitive) < colours.size() &&
      colours[static_cast<std::size_t>(primitive)]) {
    const Rgba& c = *colours[static_cast<std::size_t>(primitive)];
    return {{c[0] / 255.0, c[1] / 255.0, c[2] / 255.0}, c[3] / 255.0};
  }
  const Colour stone{uncoloured[0] / 255.0, uncoloured[1] / 255.0, uncoloured[2] / 255.0};
  return {varied(stone, primitive)};
}

/// Parts with names, else primitives.
Ink part_ink(const RunResult& result, const geometry::CellBatch& batch, std::size_t cell) {
  return {numbered(result.part_names.empty() ? batch.primitive[cell] : batch.part[cell])};
}

}  // namespace

Ink ink_of(const RunResult& result, const geometry::CellBatch& batch, std::size_t cell, Shade shade) {
  Ink ink;
  const std::uint32_t region = batch.region[cell];
  const bool fuzzy = batch.label[cell] == geometry::Label::fuzzy;
  switch (shade) {
    case Shade::colour:
      ink = fuzzy ? Ink{mist} : model_ink(result, batch.primitive[cell]);
      break;
    case Shade::part:
      ink = fuzzy ? Ink{mist} : part_ink(result, batch, cell);
      break;
    case Shade::rank:
      ink.colour = numbered(result.rank_of_region.empty() ? 0 : result.rank_of_region.at(region));
      break;
    case Shade::region:
      ink.colour = numbered(region);
      break;
    case Shade::label:
      ink.colour = fuzzy ? mist : Colour{0.45, 0.65, 0.85};
      break;
  }
  if (fuzzy) ink.opacity = 0.5;
  return ink;
}

Ink lit(const Ink& ink, const Vector& normal) {
  // The second light is for what is turned away from the first one.
  static const Vector light = normalized({-0.5, 0.6, 0.7}), from_beside = normalized({0.9, 0.1, 0.4});
  const double brightness = 0.4 + 0.08 * normal[1] + 0.52 * std::max(0.0, dot(normal, light)) +
                            0.2 * std::max(0.0, dot(normal, from_beside));
  Ink result = ink;
  for (double& channel : result.colour) channel = std::clamp(channel * brightness, 0.0, 1.0);
  return result;
}

}  // namespace bsp2::supersteps
