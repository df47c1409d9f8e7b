#include "outputs/pictures.hpp"

#include <map>
#include <string>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"

namespace bsp2::api {
namespace {

/// What a name stands for. @throws Error that tells which ones there are.
template <typename Value>
Value named(const std::map<std::string, Value>& names, const std::string& name, const char* what) {
  if (const auto found = names.find(name); found != names.end()) return found->second;
  std::string all;
  for (const auto& each : names) all += (all.empty() ? "" : ", ") + each.first;
  throw Error("a picture has no " + std::string(what) + " '" + name + "'; there are " + all);
}

}  // namespace

supersteps::PictureOptions picture_options(const View& view, supersteps::PictureFormat format) {
  using supersteps::Edges;
  using supersteps::Shade;
  static const std::map<std::string, Shade> shades = {
      {"color", Shade::colour},  {"colour", Shade::colour}, {"part", Shade::part},  {"rank", Shade::rank},
      {"region", Shade::region}, {"label", Shade::label},   {"level", Shade::level}};
  static const std::map<std::string, Edges> edges = {
      {"none", Edges::none}, {"feature", Edges::feature}, {"cells", Edges::cells}};
  constexpr int largest = 20000;
  if (view.width < 1 || view.height < 1 || view.width > largest || view.height > largest)
    throw Error("a picture of " + std::to_string(view.width) + " x " +
                counted(view.height, "# pixel[s] cannot be drawn; 1 to ") + std::to_string(largest) +
                " are possible");
  if (view.eye && view.look && *view.eye == *view.look)
    throw Error("eye and look are the same point: the picture needs a direction");
  supersteps::PictureOptions options;
  options.format = format;
  options.width = view.width;
  options.height = view.height;
  options.shade = named(shades, view.shade, "shade");
  options.edges = named(edges, view.edges, "edges");
  options.legend = view.legend;
  options.axes = view.axes;
  options.transparent = view.transparent;
  options.eye = view.eye;
  options.look = view.look;
  options.explode = view.explode;
  return options;
}

supersteps::PictureFormat format_of(const std::filesystem::path& path) {
  const auto format = supersteps::picture_format(path);
  if (!format)
    throw Error("there are no pictures of the format '" + path.string() + "'; png, svg and pdf are");
  return *format;
}

}  // namespace bsp2::api
