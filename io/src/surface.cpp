#include "bsp2/io/surface.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <string>

#include "bsp2/geometry/error.hpp"
#include "bsp2/io/file.hpp"
#include "modules.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::TriangleSurface;

static_assert(std::endian::native == std::endian::little, "binary STL and PLY are written as they lie in memory");

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

using SinglePoint = std::array<float, 3>;

SinglePoint single(const std::array<double, 3>& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

/// What rounding to single precision does to a surface.
struct Rounding {
  double moved = 0;  ///< a coordinate, at most; infinite if one is too large
  double size = 0;   ///< the longest side of the surface's box
};

Rounding rounding_of(const TriangleSurface& surface) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Rounding result;
  std::array<double, 3> lower, upper;
  lower.fill(infinity);
  upper.fill(-infinity);
  for (const auto& point : surface.points)
    for (int k = 0; k < 3; ++k) {
      const bool fits = std::fabs(point[k]) <= std::numeric_limits<float>::max();
      result.moved = std::max(result.moved, fits ? std::fabs(static_cast<float>(point[k]) - point[k]) : infinity);
      lower[k] = std::min(lower[k], point[k]);
      upper[k] = std::max(upper[k], point[k]);
    }
  for (int k = 0; k < 3; ++k) result.size = std::max(result.size, upper[k] - lower[k]);
  return result;
}

std::string to_stl(const TriangleSurface& surface) {
  const auto rounded = [&](std::uint32_t point) { return single(surface.points[point]); };
  std::string bytes = "binary STL, written by bsp2";  // must not begin with "solid"
  bytes.resize(80, ' ');
  put(bytes, std::uint32_t{0});
  std::uint32_t count = 0;
  for (const auto& triangle : surface.triangles) {
    const SinglePoint a = rounded(triangle[0]), b = rounded(triangle[1]), c = rounded(triangle[2]);
    if (a == b || b == c || c == a) continue;
    std::array<double, 3> p, q, r, normal;  // of the corners as they are written, which may turn a sliver over
    std::copy_n(a.begin(), 3, p.begin());
    std::copy_n(b.begin(), 3, q.begin());
    std::copy_n(c.begin(), 3, r.begin());
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      normal[k] = (q[l] - p[l]) * (r[m] - p[m]) - (q[m] - p[m]) * (r[l] - p[l]);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    for (const double n : normal) put(bytes, static_cast<float>(length > 0 ? n / length : 0));
    for (const SinglePoint& corner : {a, b, c})
      for (const float x : corner) put(bytes, x);
    put(bytes, std::uint16_t{0});
    ++count;
  }
  bytes.replace(80, sizeof count, reinterpret_cast<const char*>(&count), sizeof count);
  return bytes;
}

std::string to_ply(const TriangleSurface& surface) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment written by bsp2\nelement vertex " + std::to_string(surface.points.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nelement face " + std::to_string(surface.triangles.size()) +
                      "\nproperty list uchar int vertex_indices\nproperty int part\nend_header\n";
  for (const auto& point : surface.points)
    for (const double x : point) put(bytes, x);
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    put(bytes, std::uint8_t{3});
    for (const std::uint32_t corner : surface.triangles[i]) put(bytes, static_cast<std::int32_t>(corner));
    put(bytes, surface.part[i]);
  }
  return bytes;
}

std::string to_obj(const TriangleSurface& surface) {
  std::string text = "# written by bsp2\n";
  std::array<char, 32> digits;
  const auto add = [&](auto number) {
    text += ' ';
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  };
  for (const auto& point : surface.points) {
    text += 'v';
    for (const double x : point) add(x);
    text += '\n';
  }
  std::vector<std::size_t> order(surface.triangles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return surface.part[a] < surface.part[b]; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::int32_t part = surface.part[order[i]];
    if (i == 0 || part != surface.part[order[i - 1]]) text += part == geometry::no_part ? "g no_part\n" : "g part_" + std::to_string(part) + '\n';
    text += 'f';
    for (const std::uint32_t corner : surface.triangles[order[i]]) add(corner + 1);
    text += '\n';
  }
  return text;
}

}  // namespace

namespace {

/// @return a warning, as write_surface.
std::string write_stl(const fs::path& path, const TriangleSurface& surface) {
  constexpr double much = 1e-5;
  const Rounding rounding = rounding_of(surface);
  if (std::isinf(rounding.moved))
    throw Error("cannot write '" + path.string() + "': coordinates above 3.4e38 are too large for the single precision of .stl; --boundary FILE.ply, .obj or .vtp keeps them");
  write_file(path, to_stl(surface));
  if (!(rounding.moved > much * rounding.size)) return "";
  std::ostringstream text;
  text << path.string() << ": the single precision of .stl moves corners by up to " << rounding.moved << ", and the solid is only " << rounding.size
       << " long; .ply, .obj and .vtp keep all digits";
  return text.str();
}

}  // namespace

bool is_surface_file(const fs::path& path) {
  const std::string ending = ending_of(path);
  return ending == ".vtp" || ending == ".stl" || ending == ".ply" || ending == ".obj";
}

void check_surface_file(const fs::path& path) {
  if (!is_surface_file(path)) throw Error("cannot write '" + path.string() + "': a boundary is written as .vtp, .stl, .ply or .obj");
  if (ending_of(path) == ".vtp") vtk_module();
}

std::string write_surface(const fs::path& path, const TriangleSurface& surface) {
  check_surface_file(path);
  const std::string ending = ending_of(path);
  if (ending == ".stl") return write_stl(path, surface);
  write_file(path, ending == ".vtp" ? vtk_module().to_vtp(surface) : ending == ".ply" ? to_ply(surface) : to_obj(surface));
  return "";
}

}  // namespace bsp2::io
