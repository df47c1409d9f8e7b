#include "bsp2/io/outputs/surface.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <sstream>
#include <string>
#include <string_view>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "outputs/modules.hpp"
#include "outputs/single_precision.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::TriangleSurface;
using Names = std::vector<std::string>;

static_assert(std::endian::native == std::endian::little,
              "binary STL and PLY are written as they lie in memory");

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return ending;
}

/// Whether single precision has numbers as large as the coordinates.
bool fits_single(const TriangleSurface& surface) {
  return std::all_of(surface.points.begin(), surface.points.end(), [](const auto& point) {
    return std::all_of(point.begin(), point.end(),
                       [](double x) { return std::fabs(x) <= std::numeric_limits<float>::max(); });
  });
}

std::string to_stl(const SingleSurface& surface) {
  constexpr std::size_t head = 80, of_a_triangle = 50;
  std::string bytes = "binary STL, written by bsp2";  // must not begin with "solid"
  bytes.reserve(head + sizeof(std::uint32_t) + of_a_triangle * surface.triangles.size());
  bytes.resize(head, ' ');
  put(bytes, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const auto& triangle : surface.triangles) {
    std::array<std::array<double, 3>, 3> corners;  // as they are written, which may turn a sliver over
    for (std::size_t i = 0; i < 3; ++i)
      std::copy_n(surface.points[triangle[i]].begin(), 3, corners[i].begin());
    const auto& [p, q, r] = corners;
    std::array<double, 3> normal;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      normal[k] = (q[l] - p[l]) * (r[m] - p[m]) - (q[m] - p[m]) * (r[l] - p[l]);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    for (const double n : normal)
      put(bytes, static_cast<float>(length > 0 ? n / length : 0) + 0.0F);  // no -0
    for (const std::uint32_t corner : triangle)
      for (const float x : surface.points[corner]) put(bytes, x);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

/// A name in one line of text.
std::string one_line(std::string name) {
  for (char& c : name)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return name;
}

std::string to_ply(const TriangleSurface& surface, const Names& part_names) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment written by bsp2\n";
  for (std::size_t part = 0; part < part_names.size(); ++part)
    bytes += "comment part " + std::to_string(part) + ' ' + one_line(part_names[part]) + '\n';
  bytes += "element vertex " + std::to_string(surface.points.size()) +
           "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
           std::to_string(surface.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nproperty int part\nend_header\n";
  for (const auto& point : surface.points)
    for (const double x : point) put(bytes, x);
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    put(bytes, std::uint8_t{3});
    for (const std::uint32_t corner : surface.triangles[i]) put(bytes, static_cast<std::int32_t>(corner));
    put(bytes, surface.owner[i]);
  }
  return bytes;
}

constexpr std::string_view no_part_group = "no_part";

/// A name of a group is one word: white space in it becomes _. Of names that become equal so, all but the
/// first get a number.
std::vector<std::string> group_names(const Names& part_names) {
  std::vector<std::string> groups;
  std::set<std::string> taken{"", std::string(no_part_group)};
  for (std::size_t part = 0; part < part_names.size(); ++part) {
    std::string word = one_line(part_names[part]);
    std::replace(word.begin(), word.end(), ' ', '_');
    while (!taken.insert(word).second) word += "_" + std::to_string(part);
    groups.push_back(word);
  }
  return groups;
}

std::string to_obj(const TriangleSurface& surface, const Names& part_names) {
  std::string text = "# written by bsp2\n";
  const std::vector<std::string> groups = group_names(part_names);
  const auto group_of = [&](std::int32_t owner) {
    if (owner < 0) return std::string(no_part_group);
    return part_names.empty() ? "part_" + std::to_string(owner) : groups.at(static_cast<std::size_t>(owner));
  };
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
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return surface.owner[a] < surface.owner[b]; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::int32_t owner = surface.owner[order[i]];
    if (i == 0 || owner != surface.owner[order[i - 1]]) text += "g " + group_of(owner) + '\n';
    text += 'f';
    for (const std::uint32_t corner : surface.triangles[order[i]]) add(corner + 1);
    text += '\n';
  }
  return text;
}

}  // namespace

namespace {

/// What single precision costs, for who gets the file; empty if that is nothing to tell of.
std::string warning_of(const fs::path& path, const SingleLoss& loss) {
  if (loss.changed == 0) return "";
  const auto point = [](const std::array<double, 3>& p) {
    std::ostringstream text;
    text << '(' << p[0] << ", " << p[1] << ", " << p[2] << ')';
    return text.str();
  };
  std::ostringstream text;
  text.precision(6);
  text << path.string() << ": the single precision of .stl changes ";
  if (loss.parts == 1)
    text << "the solid";
  else
    text << loss.changed << " of the " << loss.parts << " connected parts of the surface";
  text << " by more than a hundred-thousandth of the volume or the size";
  text << (loss.changed > 1 ? "; most of all that between "
           : loss.parts > 1 ? ", that between "
                            : ", between ")
       << point(loss.lower) << " and " << point(loss.upper) << ": corners move by up to " << loss.moved
       << ", and its volume of ";
  text.precision(9);
  text << std::fabs(loss.volume) << " becomes " << std::fabs(loss.rounded_volume)
       << "; .ply, .obj and .vtp keep all digits";
  return text.str();
}

/// @return a warning, as write_surface.
std::string write_stl(const fs::path& path, const TriangleSurface& surface) {
  if (!fits_single(surface))
    throw Error("cannot write '" + path.string() +
                "': coordinates above 3.4e38 are too large for the single precision of .stl; --boundary "
                "FILE.ply, .obj or .vtp keeps them");
  write_file(path, to_stl(rounded_to_single(surface)));
  return warning_of(path, loss_in_single(surface));
}

}  // namespace

bool is_surface_file(const fs::path& path) {
  const std::string ending = ending_of(path);
  return ending == ".vtp" || ending == ".stl" || ending == ".ply" || ending == ".obj";
}

void check_surface_file(const fs::path& path) {
  if (!is_surface_file(path))
    throw Error("cannot write '" + path.string() + "': a boundary is written as .vtp, .stl, .ply or .obj");
  if (ending_of(path) == ".vtp") vtk_module();
}

std::string write_surface(const fs::path& path, const TriangleSurface& surface, const Names& part_names) {
  check_surface_file(path);
  const std::string ending = ending_of(path);
  if (ending == ".stl") return write_stl(path, surface);
  write_file(path, ending == ".vtp"   ? vtk_module().to_vtp(surface, part_names)
                   : ending == ".ply" ? to_ply(surface, part_names)
                                      : to_obj(surface, part_names));
  return "";
}

}  // namespace bsp2::io
