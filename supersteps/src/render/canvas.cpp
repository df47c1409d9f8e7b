#include "render/canvas.hpp"

#include <utility>

#include "bsp2/geometry/support/module.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "render/cairo_module.hpp"

namespace bsp2::supersteps {
namespace {

const CairoModule& cairo_module() { return loaded_module<CairoModule>(BSP2_MODULE_LAYOUT); }

}  // namespace

void check_pictures() { cairo_module(); }

std::unique_ptr<Canvas> make_canvas(int width, int height) {
  return cairo_module().new_canvas(width, height);
}

void Drawing::fill(std::span<const std::array<double, 2>> polygon, const Ink& ink) {
  for (const auto& point : polygon) all_.points.insert(all_.points.end(), point.begin(), point.end());
  all_.ends.push_back(static_cast<std::uint32_t>(all_.points.size() / 2));
  for (const double channel : ink.colour) all_.inks.push_back(static_cast<float>(channel));
  all_.inks.insert(all_.inks.end(), {static_cast<float>(ink.opacity), ink.edges ? 1.0F : 0.0F});
}

Drawing::Layer Drawing::take() { return std::exchange(all_, {}); }

void Drawing::put(const Layer& layer) {
  const auto first = static_cast<std::uint32_t>(all_.points.size() / 2);
  all_.points.insert(all_.points.end(), layer.points.begin(), layer.points.end());
  for (const std::uint32_t end : layer.ends) all_.ends.push_back(first + end);
  all_.inks.insert(all_.inks.end(), layer.inks.begin(), layer.inks.end());
}

std::string Drawing::file() {
  return cairo_module().draw_vectors(format_, width_, height_, background_, all_);
}

}  // namespace bsp2::supersteps
