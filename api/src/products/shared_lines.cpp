#include "products/shared_lines.hpp"

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace bsp2::api {
namespace {

using drawing::Piece;
using drawing::ViewLines;
using geometry::Brep;

/// Puts numbers one after the other, and takes them out in the same order.
class Packed {
 public:
  Packed() = default;
  explicit Packed(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] bool is_over() const { return at_ == bytes_.size(); }

  template <typename Item>
  void put(const Item* items, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Item>);
    bytes_.append(reinterpret_cast<const char*>(&count), sizeof count);
    if (count > 0) bytes_.append(reinterpret_cast<const char*>(items), count * sizeof(Item));
  }
  template <typename Item>
  void put(const std::vector<Item>& items) {
    put(items.data(), items.size());
  }
  template <typename Item>
  void take(std::vector<Item>& items) {
    static_assert(std::is_trivially_copyable_v<Item>);
    std::size_t count = 0;
    std::memcpy(&count, bytes_.data() + at_, sizeof count);
    items.resize(count);
    if (count > 0) std::memcpy(items.data(), bytes_.data() + at_ + sizeof count, count * sizeof(Item));
    at_ += sizeof count + count * sizeof(Item);
  }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

/// What lines need of a complex.
template <typename Some, typename Work>
void for_each_array(Some& brep, const Work& work) {
  work(brep.points);
  work(brep.edges);
  work(brep.faces);
  work(brep.uses);
  work(brep.uses_of_edges);
  work(brep.triangles);
  work(brep.face_of_triangle);
}

void put(Packed& packed, const Brep& brep) {
  for_each_array(brep, [&](const auto& array) { packed.put(array); });
}

std::vector<Brep> breps_in(Packed packed) {
  std::vector<Brep> breps;
  while (!packed.is_over()) for_each_array(breps.emplace_back(), [&](auto& array) { packed.take(array); });
  return breps;
}

/// Of a stroke, but for its points.
struct Pen {
  drawing::LineKind kind;
  bool is_closed;
  std::size_t points;
};

void put(Packed& packed, const ViewLines& lines) {
  std::vector<Pen> pens;
  std::vector<drawing::Point2> points;
  for (const drawing::Stroke& stroke : lines.strokes) {
    pens.push_back({stroke.kind, stroke.is_closed, stroke.points.size()});
    points.insert(points.end(), stroke.points.begin(), stroke.points.end());
  }
  packed.put(pens);
  packed.put(points);
  packed.put(&lines.short_lines, 1);
}

ViewLines lines_in(Packed& packed) {
  std::vector<Pen> pens;
  std::vector<drawing::Point2> points;
  std::vector<std::uint64_t> short_lines;
  packed.take(pens);
  packed.take(points);
  packed.take(short_lines);
  ViewLines lines{{}, short_lines.front()};
  auto at = points.begin();
  for (const Pen& pen : pens) {
    const auto end = at + static_cast<std::ptrdiff_t>(pen.points);
    lines.strokes.push_back({pen.kind, pen.is_closed, {at, end}});
    at = end;
  }
  return lines;
}

/// Sends the master's complexes to all other ranks. @param brep null there. Collective.
void share(const Brep* brep, std::span<const Brep> cuts, supersteps::Ranks& ranks) {
  if (ranks.count() > 1 && ranks.is_master()) {
    Packed packed;
    put(packed, *brep);
    for (const Brep& cut : cuts) put(packed, cut);
    for (int rank = 1; rank < ranks.count(); ++rank) ranks.send(rank, packed.bytes());
  }
  ranks.sync();
}

/// Pieces go to the rank that puts those of their view together.
int joiner(std::size_t view, const supersteps::Ranks& ranks) {
  return static_cast<int>(view % static_cast<std::size_t>(ranks.count()));
}

/// Sends pieces to the ranks that put their views together. Collective.
void send_pieces(std::vector<std::vector<Piece>>& pieces, supersteps::Ranks& ranks) {
  std::vector<Packed> packed(static_cast<std::size_t>(ranks.count()));
  for (std::size_t view = 0; view < pieces.size(); ++view)
    if (const int rank = joiner(view, ranks); rank != ranks.rank())
      packed[static_cast<std::size_t>(rank)].put(std::exchange(pieces[view], {}));
  for (int rank = 0; rank < ranks.count(); ++rank)
    if (rank != ranks.rank()) ranks.send(rank, packed[static_cast<std::size_t>(rank)].bytes());
  ranks.sync();
}

/// Those of the others, of the views that this rank puts together.
void take_pieces(std::vector<std::vector<Piece>>& pieces, const supersteps::Ranks& ranks) {
  std::vector<Piece> some;
  for (const auto& message : ranks.received()) {
    Packed bytes(message.bytes);
    for (std::size_t view = 0; view < pieces.size(); ++view) {
      if (joiner(view, ranks) != ranks.rank()) continue;
      bytes.take(some);
      pieces[view].insert(pieces[view].end(), some.begin(), some.end());
    }
  }
}

}  // namespace

std::vector<ViewLines> shared_lines(const Brep* brep, std::span<const Brep> cuts,
                                    const drawing::DrawingOptions& options, supersteps::Ranks& ranks) {
  std::vector<std::vector<Piece>> pieces;
  share(brep, cuts, ranks);
  ranks.agree([&] {
    const drawing::Share mine{static_cast<std::size_t>(ranks.rank()),
                              static_cast<std::size_t>(ranks.count())};
    if (ranks.is_master()) {
      pieces = drawing::pieces_of_views(*brep, cuts, options, mine);
    } else {
      const std::vector<Brep> received = breps_in(Packed(ranks.received().front().bytes));
      pieces = drawing::pieces_of_views(received.front(), std::span(received).subspan(1), options, mine);
    }
  });
  send_pieces(pieces, ranks);
  std::vector<ViewLines> lines(pieces.size());
  Packed found;
  ranks.agree([&] {
    take_pieces(pieces, ranks);
    for (std::size_t view = 0; view < lines.size(); ++view) {
      if (joiner(view, ranks) != ranks.rank()) continue;
      lines[view] = drawing::lines_from(std::move(pieces[view]));
      if (!ranks.is_master()) put(found, lines[view]);
    }
  });
  if (!ranks.is_master()) ranks.send(0, found.bytes());
  ranks.sync();
  ranks.agree([&] {
    for (const auto& message : ranks.received()) {
      Packed packed(message.bytes);
      for (std::size_t view = 0; view < lines.size(); ++view)
        if (joiner(view, ranks) == message.source) lines[view] = lines_in(packed);
    }
  });
  return lines;
}

}  // namespace bsp2::api
