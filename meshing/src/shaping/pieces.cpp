#include "shaping/pieces.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <map>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::meshing {
namespace {

/// Of each point the part of its tetrahedra, or `several`.
class Owners {
 public:
  static constexpr std::int64_t several = -9;

  explicit Owners(const Tetrahedra& mesh) : owner_(mesh.points.size(), nobody) {
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      for (const std::uint32_t p : mesh.tetrahedra[t])
        owner_[p] = owner_[p] == nobody || owner_[p] == mesh.part[t] ? mesh.part[t] : several;
  }
  [[nodiscard]] bool is_shared(std::uint32_t p) const { return owner_[p] == several; }

 private:
  static constexpr std::int64_t nobody = -10;
  std::vector<std::int64_t> owner_;
};

/// Takes points of the whole into a piece.
class Taker {
 public:
  Taker(const Piece& whole, const Owners& owners, const std::vector<double>& wanted)
      : whole_(whole), owners_(owners), wanted_(wanted), map_(whole.mesh.points.size(), {none, 0}) {}

  std::uint32_t take(std::uint32_t p, std::size_t number, Piece& piece) {
    auto& [last, at] = map_[p];
    if (last == number) return at;
    last = number;
    at = static_cast<std::uint32_t>(piece.mesh.points.size());
    piece.mesh.points.push_back(whole_.mesh.points[p]);
    piece.kind.push_back(owners_.is_shared(p) ? Editor::shared : whole_.kind[p]);
    if (owners_.is_shared(p)) piece.shared.push_back({at, p, wanted_[p]});
    return at;
  }

 private:
  static constexpr std::size_t none = ~std::size_t{0};
  const Piece& whole_;
  const Owners& owners_;
  const std::vector<double>& wanted_;
  std::vector<std::pair<std::size_t, std::uint32_t>> map_;  // of each point: the last piece, and where there
};

}  // namespace

std::vector<Piece> divided(const Piece& whole, const std::vector<double>& wanted) {
  const Tetrahedra& mesh = whole.mesh;
  const Owners owners(mesh);
  std::map<std::int32_t, std::vector<std::size_t>> tetrahedra, triangles;  // by part
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) tetrahedra[mesh.part[t]].push_back(t);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const PlaneSide& side = mesh.sides[mesh.side[t]];
    triangles[side.part].push_back(t);
    if (side.other != PlaneSide::nothing) triangles[side.other].push_back(t);
  }
  std::vector<Piece> pieces;
  Taker taker(whole, owners, wanted);
  for (const auto& [part, own] : tetrahedra) {
    const std::size_t number = pieces.size();
    Piece& piece = pieces.emplace_back();
    const auto take = [&](const auto& corners) {
      auto taken = corners;
      for (std::uint32_t& p : taken) p = taker.take(p, number, piece);
      return taken;
    };
    piece.mesh.sides = mesh.sides;
    piece.mesh.part.assign(own.size(), part);
    for (const std::size_t t : own) piece.mesh.tetrahedra.push_back(take(mesh.tetrahedra[t]));
    for (const std::size_t t : triangles[part]) {
      piece.mesh.triangles.push_back(take(mesh.triangles[t]));
      piece.mesh.side.push_back(mesh.side[t]);
    }
  }
  return pieces;
}

void replace_all(std::vector<Piece>& pieces, unsigned threads,
                 const std::function<Piece(const Piece&)>& work) {
  using geometry::Interruption;
  std::atomic<std::size_t> next{0};
  const auto replace = [&] {
    for (std::size_t i = next++; i < pieces.size(); i = next++) {
      Interruption::check();
      pieces[i] = work(std::exchange(pieces[i], {}));
    }
  };
  if (threads <= 1) return replace();
  // Where one fails, the others end, too, and what it has thrown is passed on.
  std::atomic<bool> is_over{false};
  std::exception_ptr failure;
  std::vector<std::future<void>> crew;
  for (std::size_t i = 0; i < std::min<std::size_t>(threads, pieces.size()); ++i)
    crew.push_back(std::async(std::launch::async, [&] {
      const Interruption inner([&] { return is_over.load(); });
      try {
        replace();
      } catch (...) {
        if (!is_over.exchange(true)) failure = std::current_exception();
      }
    }));
  for (std::future<void>& thread : crew)
    while (thread.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready)
      if (Interruption::is_wanted()) is_over = true;
  for (std::future<void>& thread : crew) thread.get();
  if (failure) std::rethrow_exception(failure);
  Interruption::check();
}

Piece joined(const Piece& whole, std::vector<Piece> pieces, std::vector<std::uint32_t>& seam) {
  Piece all;
  all.mesh.sides = whole.mesh.sides;
  constexpr std::uint32_t none = ~0U;
  std::vector<std::uint32_t> place(whole.mesh.points.size(), none);  // of what is shared
  const auto add = [&](const Point& x, Editor::Kind kind) {
    all.mesh.points.push_back(x);
    all.kind.push_back(kind);
    return static_cast<std::uint32_t>(all.mesh.points.size() - 1);
  };
  seam.clear();
  for (Piece& piece : pieces) {
    std::vector<std::uint32_t> map(piece.mesh.points.size(), none);
    for (const auto& [point, p, wanted] : piece.shared) {
      if (place[p] == none) seam.push_back(place[p] = add(whole.mesh.points[p], whole.kind[p]));
      map[point] = place[p];
    }
    for (std::size_t p = 0; p < map.size(); ++p)
      if (map[p] == none) map[p] = add(piece.mesh.points[p], piece.kind[p]);
    const auto put = [&](auto corners) {
      for (std::uint32_t& p : corners) p = map[p];
      return corners;
    };
    for (const auto& corners : piece.mesh.tetrahedra) all.mesh.tetrahedra.push_back(put(corners));
    all.mesh.part.insert(all.mesh.part.end(), piece.mesh.part.begin(), piece.mesh.part.end());
    for (std::size_t t = 0; t < piece.mesh.triangles.size(); ++t) {
      all.mesh.triangles.push_back(put(piece.mesh.triangles[t]));
      all.mesh.side.push_back(piece.mesh.side[t]);
    }
    piece = {};
  }
  return all;
}

}  // namespace bsp2::meshing
