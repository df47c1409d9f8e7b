#include "render/shading.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>

#include "ranks/exchange.hpp"
#include "render/round_faces.hpp"
#include "render/space.hpp"

namespace bsp2::supersteps {

using geometry::CellBatch;
using geometry::Label;

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
  const double light = 1 + 0.03 * ((h & 0xff) / 127.5 - 1), warmth = 0.015 * (((h >> 8) & 0xff) / 127.5 - 1);
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

constexpr Colour solid{0.45, 0.65, 0.85};

/// From dark blue over green to yellow.
Colour ramp(double t) {
  constexpr std::array<Colour, 5> colours{Colour{0.27, 0.22, 0.5}, Colour{0.2, 0.42, 0.62},
                                          Colour{0.15, 0.64, 0.56}, Colour{0.5, 0.8, 0.36},
                                          Colour{0.98, 0.9, 0.3}};
  const double place = std::clamp(t, 0.0, 1.0) * (colours.size() - 1);
  const auto before = std::min(static_cast<std::size_t>(place), colours.size() - 2);
  Colour colour;
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = colours[before][k] +
                (place - static_cast<double>(before)) * (colours[before + 1][k] - colours[before][k]);
  return colour;
}

std::int64_t number_of(const RunResult& result, const CellBatch& batch, std::size_t cell, Shade shade) {
  switch (shade) {
    case Shade::colour:
    case Shade::label:
      return batch.label[cell] == Label::fuzzy ? 1 : 0;
    case Shade::part:
      return result.part_names.empty() ? batch.primitive[cell] : batch.part[cell];
    case Shade::rank:
      return result.rank_of_region.empty() ? 0 : result.rank_of_region.at(batch.region[cell]);
    case Shade::region:
      return batch.region[cell];
    case Shade::level:
      return batch.level[cell];
  }
  return 0;
}

std::string name_of(const RunResult& result, Shade shade, std::int64_t number) {
  const std::string digits = std::to_string(number);
  switch (shade) {
    case Shade::colour:
    case Shade::label:
      return number == 0 ? "IN" : "FUZZY";
    case Shade::part:
      if (number < 0) return "nothing with a name";
      return result.part_names.empty() ? "primitive " + digits
                                       : result.part_names.at(static_cast<std::size_t>(number));
    case Shade::rank:
      return "rank " + digits;
    case Shade::region:
      return "region " + digits;
    case Shade::level:
      return "level " + digits;
  }
  return digits;
}

}  // namespace

Numbers Numbers::of(Ranks& ranks, const RunResult& result, const PictureOptions& options) {
  Numbers numbers;
  if (options.shade == Shade::colour || (!options.legend && options.shade != Shade::level)) return numbers;
  std::set<std::int64_t> mine;
  for (const auto& batch : result.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      if (is_drawn(*batch, cell) && (options.shade != Shade::part || batch->label[cell] == Label::in))
        mine.insert(number_of(result, *batch, cell, options.shade));
  std::set<std::int64_t> all;
  for (const auto& some : all_gather(ranks, std::vector<std::int64_t>(mine.begin(), mine.end())))
    all.insert(some.begin(), some.end());
  numbers.present.assign(all.begin(), all.end());
  return numbers;
}

double skin_thickness(const RunResult& result) {
  if (result.report.tolerance) return *result.report.tolerance;
  constexpr double usual = 1e-3;
  double size = 0;
  for (std::size_t i = 0; i < result.bounds.lower.size(); ++i)
    size = std::max(size, result.bounds.upper[i] - result.bounds.lower[i]);
  return usual * size;
}

Inks::Inks(const RunResult& result, const PictureOptions& options, const Numbers& numbers)
    : result_(result), shade_(options.shade), skin_(4 * skin_thickness(result)) {
  if (shade_ == Shade::level && !numbers.present.empty()) {
    least_ = numbers.present.front();
    most_ = numbers.present.back();
  }
  has_skins_ = result.round_faces && result.round_faces->has_curved() && options.shade != Shade::label;
  if (has_skins_) find_owners();
}

/// Counted by region, so that it does not depend on who holds which of them.
void Inks::find_owners() {
  std::map<std::uint32_t, std::map<std::pair<std::int32_t, std::int32_t>, std::size_t>> counts;
  for (const auto& batch : result_.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      if (batch->label[cell] == Label::in)
        ++counts[batch->region[cell]][{batch->primitive[cell], batch->part[cell]}];
  for (const auto& [region, owners] : counts) {
    const auto most = std::max_element(owners.begin(), owners.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    owner_of_region_[region] = {most->first.first, most->first.second};
  }
}

Ink Inks::of(const CellBatch& batch, std::size_t cell) const {
  const bool is_fuzzy = batch.label[cell] == Label::fuzzy;
  if (is_fuzzy && has_skins_)
    if (const RoundPlace place = skin_of(batch, cell); place.body >= 0) return skin(batch, cell, place);
  const bool is_owned = shade_ == Shade::colour || shade_ == Shade::part;
  Ink ink = is_fuzzy && is_owned ? Ink{mist}
            : is_owned           ? owned({batch.primitive[cell], batch.part[cell]})
                                 : Ink{of(number_of(result_, batch, cell, shade_))};
  if (is_fuzzy) ink.opacity = 0.5;
  return ink;
}

/// The round body that the cell is the skin of: it has a facet of it, and is as near to its surface as such
/// cells are when they are no longer refined. Of several, the nearest.
RoundPlace Inks::skin_of(const CellBatch& batch, std::size_t cell) const {
  const RoundFaces& round = *result_.round_faces;
  RoundPlace nearest;
  double least = skin_;
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const std::int32_t plane = batch.facet_hyperplane[f];
    const RoundPlace place = round.of(static_cast<geometry::HyperplaneId>(plane < 0 ? ~plane : plane));
    if (place.body < 0 || !round.is_curved(place.body)) continue;
    double farthest = 0;
    for (std::size_t v = 0; v < batch.point_count(cell) && farthest <= least; ++v)
      farthest = std::max(farthest, round.distance(place.body, point_of(batch, cell, v)));
    if (farthest <= least) nearest = place;
    least = std::min(least, farthest);
  }
  return nearest;
}

/// As the curved solid that it is the skin of; that of a hole belongs to what is around it.
Ink Inks::skin(const CellBatch& batch, std::size_t cell, const RoundPlace& round) const {
  Owner owner;
  if (result_.round_faces->owner(round).owns)
    owner = {result_.round_faces->owner(round).primitive, result_.round_faces->owner(round).part};
  else if (const auto found = owner_of_region_.find(batch.region[cell]); found != owner_of_region_.end())
    owner = found->second;
  const bool is_owned = shade_ == Shade::colour || shade_ == Shade::part;
  Ink ink = is_owned ? owned(owner) : Ink{of(number_of(result_, batch, cell, shade_))};
  ink.round = round;
  return ink;
}

Colour Inks::of(std::int64_t number) const {
  if (shade_ == Shade::label || shade_ == Shade::colour) return number == 0 ? solid : mist;
  if (shade_ == Shade::level)
    return ramp(static_cast<double>(number - least_) /
                static_cast<double>(std::max<std::int64_t>(1, most_ - least_)));
  return numbered(number);
}

/// Parts with names, else primitives.
Ink Inks::owned(const Owner& owner) const {
  if (shade_ == Shade::colour) return model_ink(owner.primitive);
  return {numbered(result_.part_names.empty() ? owner.primitive : owner.part)};
}

Ink Inks::model_ink(std::int32_t primitive) const {
  const auto& colours = result_.colour_of_primitive;
  if (primitive >= 0 && static_cast<std::size_t>(primitive) < colours.size() &&
      colours[static_cast<std::size_t>(primitive)]) {
    const Rgba& c = *colours[static_cast<std::size_t>(primitive)];
    return {{c[0] / 255.0, c[1] / 255.0, c[2] / 255.0}, c[3] / 255.0};
  }
  const Colour stone{uncoloured[0] / 255.0, uncoloured[1] / 255.0, uncoloured[2] / 255.0};
  return {varied(stone, primitive)};
}

namespace {

/// Of letters in a picture of a thousand pixels.
double letter_size(const PictureOptions& options) {
  return std::max(9.0, 15 * std::min(options.width, options.height) / 1000.0);
}

/// A length of 1, 2 or 5 times a power of ten.
double round_length(double most) {
  const double power = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= most) return factor * power;
  return power;
}

std::string digits_of(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", number);
  return text.data();
}

}  // namespace

void add_legend(Overlay& overlay, const RunResult& result, const PictureOptions& options,
                const Numbers& numbers) {
  if (!options.legend || numbers.present.empty()) return;
  const double size = letter_size(options), line = 1.5 * size, margin = size;
  const auto room = static_cast<std::size_t>(std::max(1.0, (options.height - 2 * margin) / line - 1));
  std::vector<std::int64_t> shown = numbers.present;
  std::string rest;
  if (options.shade == Shade::level && shown.size() > 8) {  // a ramp needs few of its levels
    std::vector<std::int64_t> some;
    for (std::size_t i = 0; i < 8; ++i) some.push_back(shown[i * (shown.size() - 1) / 7]);
    shown = some;
  }
  const std::size_t most = std::min<std::size_t>(room, 24);
  if (shown.size() > most) {
    rest = "and " + std::to_string(shown.size() - most + 1) + " more";
    shown.resize(most - 1);
  }
  const Inks inks(result, options, numbers);
  double y = margin;
  for (const std::int64_t number : shown) {
    overlay.boxes.push_back({{margin, y}, {margin + size, y + size}, inks.of(number)});
    overlay.texts.push_back({{margin + 1.6 * size, y + 0.85 * size},
                             name_of(result, options.shade, number),
                             size,
                             0,
                             line_colour});
    y += line;
  }
  if (!rest.empty())
    overlay.texts.push_back({{margin + 1.6 * size, y + 0.85 * size}, rest, size, 0, line_colour});
}

void add_axes(Overlay& overlay, const PictureOptions& options, const Camera& camera, const Frame& frame,
              int dimension) {
  if (!options.axes) return;
  const double size = letter_size(options), bottom = options.height - 1.5 * size, stroke = size / 8;
  if (!camera.is_perspective()) {
    const double length = round_length(0.25 * options.width / frame.scale()), width = length * frame.scale();
    const double left = 1.5 * size;
    overlay.lines.push_back({{left, bottom}, {left + width, bottom}, line_colour, stroke});
    for (const double x : {left, left + width})
      overlay.lines.push_back({{x, bottom - size / 3}, {x, bottom + size / 3}, line_colour, stroke});
    overlay.texts.push_back(
        {{left + width / 2, bottom - 0.6 * size}, digits_of(length), size, 0.5, line_colour});
  }
  constexpr std::array<Colour, 3> colours{Colour{0.8, 0.15, 0.15}, Colour{0.1, 0.55, 0.15},
                                          Colour{0.15, 0.3, 0.8}};
  const Point2 origin{options.width - 5 * size, options.height - 5 * size};
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(std::min(3, dimension)); ++axis) {
    Vector along{};
    along[axis] = 1;
    const Vector seen = camera.turn(along);
    const Point2 tip{origin[0] + 3 * size * seen[0], origin[1] - 3 * size * seen[1]};
    overlay.lines.push_back({origin, tip, colours[axis], stroke});
    overlay.texts.push_back(
        {{origin[0] + 3.8 * size * seen[0], origin[1] - 3.8 * size * seen[1] + 0.35 * size},
         std::string(1, "xyz"[axis]),
         size,
         0.5,
         colours[axis]});
  }
}

}  // namespace bsp2::supersteps
