// Formats of lines or plain bytes: STL, PLY, OFF, OBJ.
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "surfaces/manifold.hpp"
#include "surfaces/text.hpp"
#include "surfaces/writers.hpp"

namespace bsp2::io {
namespace {

using geometry::TriangleSurface;

static_assert(std::endian::native == std::endian::little,
              "binary STL and PLY are written as they lie in memory");

/// Of the corners as they are written, which may turn a sliver over. None of a triangle without area.
std::array<float, 3> stl_normal(const std::array<const float*, 3>& corners) {
  const auto& [p, q, r] = corners;
  std::array<double, 3> normal;
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    normal[k] = (double{q[l]} - p[l]) * (double{r[m]} - p[m]) - (double{q[m]} - p[m]) * (double{r[l]} - p[l]);
  }
  double square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
  double length = std::sqrt(square);
  if (!(square > 1e-280 && square < 1e280)) length = std::hypot(normal[0], normal[1], normal[2]);
  std::array<float, 3> unit;
  for (int k = 0; k < 3; ++k)
    unit[k] = static_cast<float>(length > 0 ? normal[k] / length : 0) + 0.0F;  // no -0
  return unit;
}

/// Records of one size, each written where it is told to.
struct Records {
  std::size_t count, size;
  std::function<void(std::size_t i, char* at)> write;
};

/// A text, and then records of one kind after the other.
Pieces in_pieces(std::string head, std::vector<Records> kinds) {
  constexpr std::size_t piece_size = 1 << 18;
  return [head = std::move(head), kinds = std::move(kinds), buffer = std::string(piece_size, '\0'),
          done = false, kind = std::size_t{0}, next = std::size_t{0}]() mutable -> std::string_view {
    if (!std::exchange(done, true)) return head;
    while (kind < kinds.size() && next == kinds[kind].count) ++kind, next = 0;
    if (kind == kinds.size()) return {};
    const Records& records = kinds[kind];
    const std::size_t count = std::min(records.count - next, piece_size / records.size);
    for (std::size_t i = 0; i < count; ++i) records.write(next + i, buffer.data() + i * records.size);
    next += count;
    return std::string_view(buffer).substr(0, count * records.size);
  };
}

/// The triangles of each part one after the other.
std::vector<std::size_t> by_owner(const TriangleSurface& surface) {
  std::vector<std::size_t> order(surface.triangles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!std::is_sorted(surface.owner.begin(), surface.owner.end()))
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return surface.owner[a] < surface.owner[b]; });
  return order;
}

/// A word for each part that has triangles.
std::map<std::int32_t, std::string> obj_words(const TriangleSurface& surface, const PartLabels& labels) {
  std::map<std::int32_t, std::string> of_owner;
  for (std::size_t i = 0; i < surface.owner.size(); ++i)
    if (i == 0 || surface.owner[i] != surface.owner[i - 1]) of_owner[surface.owner[i]];
  Words words(Words::Kind::without_spaces);
  static_cast<void>(words.word(std::string(no_part_name), 0));  // no part is called like that
  for (auto& [owner, word] : of_owner)
    word = owner < 0 ? std::string(no_part_name) : words.word(labels.name(owner), owner);
  return of_owner;
}

}  // namespace

Pieces to_stl(const SingleSurface& surface) {
  std::string head = "binary STL, written by bsp2";  // must not begin with "solid"
  head.resize(80, '\0');                             // readers print it, some of them up to the first zero
  std::array<char, sizeof(std::uint32_t)> count;
  put(count.data(), static_cast<std::uint32_t>(surface.triangles.size()));
  head.append(count.data(), count.size());
  return in_pieces(std::move(head), {{surface.triangles.size(), 50, [&surface](std::size_t i, char* at) {
                                        const auto& [a, b, c] = surface.triangles[i];
                                        const std::array<const float*, 3> corners{surface.points[a].data(),
                                                                                  surface.points[b].data(),
                                                                                  surface.points[c].data()};
                                        at = put(at, stl_normal(corners));
                                        for (const float* corner : corners) {
                                          std::memcpy(at, corner, 3 * sizeof(float));
                                          at += 3 * sizeof(float);
                                        }
                                        put(at, std::uint16_t{0});
                                      }}});
}

Pieces to_ply(const TriangleSurface& surface, const PartLabels& labels) {
  const bool are_coloured = labels.are_coloured();
  std::string head = "ply\nformat binary_little_endian 1.0\ncomment written by bsp2\n";
  for (std::size_t part = 0; part < labels.count(); ++part)
    head +=
        "comment part " + std::to_string(part) + ' ' + labels.name(static_cast<std::int32_t>(part)) + '\n';
  head += "element vertex " + std::to_string(surface.points.size()) +
          "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
          std::to_string(surface.triangles.size()) +
          "\nproperty list uchar int vertex_indices\nproperty int part\n";
  if (are_coloured)
    head += "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
  head += "end_header\n";
  const auto write_point = [&surface](std::size_t i, char* at) { put(at, surface.points[i]); };
  const auto write_face = [&surface, &labels, are_coloured](std::size_t i, char* at) {
    at = put(at, std::uint8_t{3});
    at = put(at, surface.triangles[i]);
    at = put(at, surface.owner[i]);
    if (are_coloured) put(at, labels.shown_colour(surface.owner[i]));
  };
  return in_pieces(std::move(head), {{surface.points.size(), 24, write_point},
                                     {surface.triangles.size(), are_coloured ? 21U : 17U, write_face}});
}

std::string to_off(const TriangleSurface& whole, const PartLabels& labels, std::vector<std::string>& notes) {
  ManifoldMesh<double> surface{whole.points, whole.triangles, whole.owner};
  Touching touching;
  make_manifold(surface, touching);  // CGAL, with which OpenSCAD reads, takes nothing else
  if (std::string told = touching.told(); !told.empty()) notes.push_back(std::move(told));
  const bool are_coloured = labels.are_coloured();
  Text text(60 * surface.points.size() + 24 * surface.triangles.size() + 64);
  text << "OFF\n" << surface.points.size() << ' ' << surface.triangles.size() << " 0\n";
  for (const auto& point : surface.points) text.list(point, " ") << '\n';
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    text << "3 ";
    text.list(surface.triangles[i], " ");
    if (are_coloured) {
      const auto colour = labels.shown_colour(surface.owner[i]);
      text << ' ';
      text.list(std::span(colour).first(colour[3] == 255 ? 3 : 4), " ");
    }
    text << '\n';
  }
  return text.take();
}

std::string to_obj(const TriangleSurface& surface, const PartLabels& labels,
                   const std::string& material_file) {
  Text text(60 * surface.points.size() + 24 * surface.triangles.size() + 64);
  text << "# written by bsp2\n";
  if (!material_file.empty()) text << "mtllib " << material_file << '\n';
  const auto words = obj_words(surface, labels);
  for (const auto& point : surface.points) (text << "v ").list(point, " ") << '\n';
  const std::vector<std::size_t> order = by_owner(surface);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::int32_t owner = surface.owner[order[i]];
    if (i == 0 || owner != surface.owner[order[i - 1]]) {
      text << "g " << words.at(owner) << '\n';
      if (!material_file.empty()) text << "usemtl " << words.at(owner) << '\n';
    }
    const auto& [a, b, c] = surface.triangles[order[i]];
    text << "f " << std::uint64_t{a} + 1 << ' ' << std::uint64_t{b} + 1 << ' ' << std::uint64_t{c} + 1
         << '\n';
  }
  return text.take();
}

std::string to_mtl(const TriangleSurface& surface, const PartLabels& labels) {
  Text text;
  text << "# written by bsp2\n";
  for (const auto& [owner, word] : obj_words(surface, labels)) {
    const auto colour = labels.shown_colour(owner);
    text << "newmtl " << word << "\nKd";
    for (std::size_t k = 0; k < 3; ++k) text << ' ' << static_cast<float>(colour[k]) / 255;
    text << "\nd " << static_cast<float>(colour[3]) / 255 << "\nillum 1\n";
  }
  return text.take();
}

}  // namespace bsp2::io
