#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "editing/editor.hpp"
#include "shaping/displacement.hpp"
#include "shaping/pieces.hpp"
#include "shaping/sizing.hpp"
#include "shaping/surface_moves.hpp"
#include "shaping/wanted_lengths.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

// Shapes (`shape_of`): up to where the points that there are are arranged anew, below what new ones are worth
// it, and what a collapse may leave at first.
constexpr double very_good = 0.6, good = 0.35, fair = 0.2;
constexpr double very_thin = 0.0175;  // has an angle below 1 degree, or above 179
/// Of what is cleaned: what is so near to an edge is on it, but for rounding.
constexpr double as_good_as_on = 1e-3;
/// What may be moved is not used up at once: a share is left for what refining brings near to each other, and
/// one for the worst of what there is then.
constexpr double share_at_first = 0.8, share_when_refined = 0.9;

using geometry::Interruption;
using Pair = Sizing::Pair;

std::array<Pair, 6> edges_of(const Editor::Tetrahedron& t) {
  const auto& p = t.point;
  return {{{p[0], p[1]}, {p[0], p[2]}, {p[0], p[3]}, {p[1], p[2]}, {p[1], p[3]}, {p[2], p[3]}}};
}

class Shaping {
 public:
  Shaping(const Tetrahedra& mesh, const ShapeOptions& options) : options_(options), editor_(mesh) {}
  Shaping(const Piece& piece, const ShapeOptions& options)
      : options_(options), editor_(piece.mesh, piece.kind), shared_(piece.shared) {}

  ShapeReport run() {
    report_.tetrahedra_at_first = editor_.size();
    report_.turned_at_first = turned();
    if (options_.size > 0) clean_ = share_at_first * options_.clean;
    for (int pass = 0; pass < 5; ++pass) {
      if (pass == 4) clean_ = options_.clean;  // rather than that something stays turned over
      clean();
      absorb();
      if (turned() == 0) break;
      loosen();
    }
    clean();
    remember_moves();
    if (options_.size > 0) make_good();
    clean_ = options_.clean;
    absorb();
    if (options_.size > 0 && options_.true_place) place_truly();
    report_.turned = turned();
    return report_;
  }
  /// Of a piece that shares points with others.
  void run_of_piece() {
    refine_well();
    finish();
  }
  /// What there is now.
  [[nodiscard]] Piece result() const {
    Piece piece;
    std::vector<std::uint32_t> map;
    piece.mesh = editor_.result(map);
    piece.kind.resize(piece.mesh.points.size());
    for (std::uint32_t p = 0; p < map.size(); ++p)
      if (map[p] != Editor::none) piece.kind[map[p]] = editor_.kind(p);
    for (const Piece::Shared& shared : shared_)
      piece.shared.push_back({map[shared.point], shared.of_whole, shared.wanted});
    piece.too_many = wanted_.too_many();
    return piece;
  }

 private:
  const ShapeOptions& options_;
  Editor editor_;
  ShapeReport report_;
  double clean_ = options_.clean;      // by now
  SurfaceMoves before_;                // up to remember_moves; and since:
  std::vector<Displacement> moved_;    // of what has become this point
  std::vector<Displacement> bent_at_;  // by point: of edges that lead through it
  std::map<Pair, Displacement> bent_;  // by edge: of what has become it, besides that of its ends
  std::vector<Piece::Shared> shared_;  // points that stay
  std::vector<std::pair<std::uint64_t, bool>> tried_;  // by tetrahedron: when it was tried in vain, and how
  WantedLengths wanted_{editor_, options_, shared_};
  Sizing sizing_{editor_, wanted_};

  [[nodiscard]] std::uint64_t turned() const {
    std::uint64_t count = 0;
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape <= 0) ++count;
    return count;
  }

  // --- what rounding has turned over, and what is too small ---

  void absorb() {
    for (int pass = 0; pass < 12; ++pass) {
      std::uint64_t left = 0, changed = 0;
      for (std::uint32_t t = 0, end = static_cast<std::uint32_t>(editor_.size()); t < end; ++t) {
        if (editor_.at(t).is_gone() || editor_.at(t).shape > 0) continue;
        Interruption::check();
        ++left;
        if (absorb(t)) ++changed;
      }
      if (left == 0 || changed == 0) return;
    }
  }

  /// Makes what is around those that are left better, which gives them room.
  void loosen() {
    std::vector<std::uint32_t> near;
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape <= 0)
        for (const std::uint32_t p : editor_.at(t).point) {
          const auto around = editor_.neighbours(p);
          near.insert(near.end(), around.begin(), around.end());
        }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::uint32_t p : near) {
      Interruption::check();
      const std::vector<std::uint32_t> star(editor_.star(p).begin(), editor_.star(p).end());
      for (const std::uint32_t t : star)
        if (!editor_.at(t).is_gone() && editor_.at(t).shape > 0 && editor_.at(t).shape < fair)
          improve_one(t, false);
    }
  }

  bool absorb(std::uint32_t t) {
    auto edges = edges_of(editor_.at(t));
    std::sort(edges.begin(), edges.end(), [&](const Pair& a, const Pair& b) {
      return editor_.length(a[0], a[1]) < editor_.length(b[0], b[1]);
    });
    for (const auto& [u, v] : edges)
      if (editor_.collapse_either(u, v, {.shape = 0, .length = 0}) || merge_either(u, v, false)) return true;
    for (const auto& [u, v] : edges)
      if (editor_.remove_edge(u, v)) return true;
    for (int face = 0; face < 4; ++face)
      if (editor_.flip_face(t, face)) return true;
    for (const std::uint32_t p : editor_.at(t).point)
      if (editor_.smooth(p) || editor_.centre(p)) return true;
    if (editor_.separate(t) || mend(t) || dissolve(t) || editor_.hollow(t) || pull_apart(t)) return true;
    if (std::any_of(edges.begin(), edges.end(),
                    [&](const Pair& edge) { return merge_either(edge[0], edge[1], true); }))
      return true;
    return attach(t, as_good_as_on, Editor::Gain::none_deeper) || attach_around(t);
  }

  /// What is shorter than that there is absorbed.
  [[nodiscard]] double clean_at(const Point& place) const {
    return options_.clean_by_place.is_empty() ? clean_ : std::min(clean_, options_.clean_by_place.at(place));
  }
  [[nodiscard]] double clean_between(std::uint32_t u, std::uint32_t v) const {
    return std::min(clean_at(editor_.point(u)), clean_at(editor_.point(v)));
  }

  /// Takes it away, and closes what that leaves open.
  bool mend(std::uint32_t t) { return attach(t, 1, Editor::Gain::less) || cross_edges(t) || peel(t); }

  /// Where a point of the tetrahedron is on one of its edges, the edge leads through the point.
  /// @param share of what is cleaned: so far from the edge it may be.
  bool attach(std::uint32_t t, double share, Editor::Gain gain) {
    const auto points = editor_.at(t).point;
    const double most = share * clean_at(editor_.middle(t));
    for (const std::uint32_t m : points)
      for (const std::uint32_t u : points)
        for (const std::uint32_t v : points) {
          if (m == u || m == v || u >= v || !lead_through({u, v}, m, most, gain)) continue;
          ++report_.taken_away;
          return true;
        }
    return false;
  }

  /// Where several points are on one line, those of the tetrahedron alone do not do: edges lead through any
  /// that is on them, which makes the line a row of short edges, step by step.
  bool attach_around(std::uint32_t t) {
    for (const auto& [u, v] : edges_of(editor_.at(t))) {
      const std::vector<std::uint32_t> at_u = editor_.neighbours(u), at_v = editor_.neighbours(v);
      for (const std::uint32_t m : at_u) {
        if (!std::ranges::binary_search(at_v, m)) continue;
        const double most = as_good_as_on * clean_at(editor_.point(m));
        if (!lead_through({std::min(u, v), std::max(u, v)}, m, most, Editor::Gain::none_deeper)) continue;
        ++report_.taken_away;
        return true;
      }
    }
    return false;
  }

  /// Where two edges of the tetrahedron cross, both lead through a new point.
  bool cross_edges(std::uint32_t t) {
    const auto p = editor_.at(t).point;
    const double most = clean_at(editor_.middle(t));
    for (const Editor::Across& edges :
         {Editor::Across{{{p[0], p[1]}, {p[2], p[3]}}}, Editor::Across{{{p[0], p[2]}, {p[3], p[1]}}},
          Editor::Across{{{p[0], p[3]}, {p[1], p[2]}}}}) {
      const auto gap = editor_.gap_between(edges);
      if (!gap || *gap > most) continue;
      Displacement since;  // of the surface at that point
      const Point middle = editor_.middle(t);
      for (const auto& [u, v] : edges)
        if (editor_.is_on_surface(u, v)) since.unite(since_along(u, v, middle).then_within(*gap / 2));
      const Displacement moved = in_all(since, middle);
      if (!is_left(moved, *gap, most) || !editor_.cross_edges(t, edges)) continue;
      tell_move(moved);
      const auto m = static_cast<std::uint32_t>(editor_.point_count() - 1);
      raise(bent_at_, m, since);
      for (const auto& [u, v] : edges)
        for (const std::uint32_t q : p) bend(q, m, bent_along(u, v).then_within(*gap / 2));
      ++report_.taken_away;
      return true;
    }
    return false;
  }

  bool peel(std::uint32_t t) {
    const auto how = editor_.look_at_peel(t);
    if (!how) return false;
    const auto points = editor_.at(t).point;
    const auto edges = edges_of(editor_.at(t));
    const Displacement step =
        how->way ? Displacement().then_up_to(*how->way) : Displacement().then_within(how->depth);
    Displacement since, moved;
    for (const std::uint32_t p : points) {
      since.unite(since_at(p).then_as(step));
      moved.unite(in_all(since_at(p).then_as(step), editor_.point(p)));
    }
    for (const auto& [u, v] : edges) moved.unite(in_all(bent_along(u, v).then_as(since), editor_.middle(t)));
    if (!is_left(moved, how->depth, clean_at(editor_.middle(t))) || !editor_.peel(t)) return false;
    tell_move(moved);
    for (const std::uint32_t p : points) raise(bent_at_, p, since);
    for (const auto& [u, v] : edges) bend(u, v, bent_along(u, v).then_as(step));
    ++report_.taken_away;
    return true;
  }

  /// Collapses an edge that leads away from it: then all is another around one of its points.
  bool dissolve(std::uint32_t t) {
    const auto points = editor_.at(t).point;
    for (const std::uint32_t p : points)
      for (const std::uint32_t q : editor_.neighbours(p))
        if (std::find(points.begin(), points.end(), q) == points.end() &&
            editor_.collapse(p, q, {.shape = 0, .length = 0}))
          return true;
    for (const std::uint32_t p : points)
      for (const std::uint32_t q : editor_.neighbours(p))
        if (editor_.remove_edge(p, q)) return true;
    return false;
  }

  /// Moves one of the points away from the other three, as little as helps: what is there is thinner than the
  /// points are rounded, and no other step has helped.
  bool pull_apart(std::uint32_t t) {
    constexpr double least = 0x1p-30, step = 0.25;  // of what may be moved
    const auto points = editor_.at(t).point;
    for (double share = least; share <= 1; share /= step)
      for (int k = 0; k < 4; ++k) {
        const std::uint32_t p = points[static_cast<std::size_t>(k)];
        const double length =
            share * (clean_at(editor_.point(p)) - in_all(since_at(p), editor_.point(p)).length());
        const Point across = normal_of_face(points, k);
        for (const double side : {length, -length}) {
          const Point from = editor_.point(p);
          Point to = from;
          for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += side * across[axis];
          if (!(length > 0) || !editor_.nudge(p, to)) continue;
          if (editor_.kind(p) != Editor::inside) {
            const Displacement since = since_at(p).then(to - from);
            if (of_point(moved_, p).is_none()) ++report_.moved_points;
            raise(moved_, p, since);
            tell_move(in_all(since, to));
          }
          return true;
        }
      }
    return false;
  }

  /// Of the face opposite of a point, one long; as long as nothing where that has no area.
  [[nodiscard]] Point normal_of_face(const std::array<std::uint32_t, 4>& points, int k) const {
    std::array<Point, 3> corner;
    for (int i = 0, n = 0; i < 4; ++i)
      if (i != k) corner[static_cast<std::size_t>(n++)] = editor_.point(points[static_cast<std::size_t>(i)]);
    Point u, v, normal;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      u[axis] = corner[1][axis] - corner[0][axis];
      v[axis] = corner[2][axis] - corner[0][axis];
    }
    double length = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
      normal[axis] = u[a] * v[b] - u[b] * v[a];
      length += normal[axis] * normal[axis];
    }
    for (double& x : normal) x = length > 0 ? x / std::sqrt(length) : 0;
    return normal;
  }

  /// Makes two points one that are closer than what is cleaned, whatever they are on; told.
  bool merge_either(std::uint32_t u, std::uint32_t v, bool may_leave_more) {
    if (editor_.kind(u) < editor_.kind(v)) std::swap(u, v);
    const double length = editor_.length(u, v);
    for (const auto& [from, to] : {std::pair(u, v), std::pair(v, u)}) {
      const bool is_told = editor_.kind(from) != Editor::inside;
      const Displacement since =
          is_told ? since_at(from).then(editor_.point(to) - editor_.point(from)) : Displacement();
      const Displacement moved = is_told ? in_all(since, editor_.point(to)) : Displacement();
      // A point inside may go as far as it likes where nothing else has helped: that moves no surface.
      const double far = is_told || !may_leave_more ? std::max(length, moved.length()) : 0;
      if (far > clean_ || far > clean_between(u, v) || !editor_.merge(from, to, may_leave_more)) continue;
      if (!is_told) return true;
      raise(moved_, to, since);
      ++report_.moved_points;
      tell_move(moved);
      return true;
    }
    return !may_leave_more && length <= clean_between(u, v) && (merge_half_way(u, v) || merge_half_way(v, u));
  }

  /// Makes two points of the surface one in the middle between them, so that either goes half as far.
  /// @return whether something has changed.
  bool merge_half_way(std::uint32_t from, std::uint32_t to) {
    if (editor_.kind(from) == Editor::inside || editor_.kind(to) == Editor::inside) return false;
    const Point at = editor_.point(to), middle = between(at, editor_.point(from));
    Displacement since = since_at(from).then(middle - editor_.point(from));
    since.unite(since_at(to).then(middle - at));
    const Displacement moved = in_all(since, middle);
    if (moved.length() > clean_between(from, to) || !editor_.put(to, middle, 0)) return false;
    const bool is_merged = editor_.merge(from, to, false);
    if (!is_merged && editor_.put(to, at, 0)) return false;
    raise(moved_, to, since);
    if (!is_merged) editor_.hold(to);
    report_.moved_points += is_merged ? 2 : 1;
    tell_move(moved);
    return true;
  }

  // Displacements since moves were remembered.

  /// Of a point, and of edges that lead through it.
  [[nodiscard]] Displacement since_at(std::uint32_t p) const {
    Displacement moved = of_point(moved_, p);
    moved.unite(of_point(bent_at_, p));
    return moved;
  }
  /// Of what is this edge of the surface, at a place on it: in between it has gone as a mean of its ends.
  [[nodiscard]] Displacement since_along(std::uint32_t u, std::uint32_t v, const Point& place) const {
    const double to_u = distance(place, editor_.point(u)), all = to_u + distance(place, editor_.point(v));
    const double share = all > 0 ? to_u / all : 0;
    return Displacement::mean({since_at(u), since_at(v), {}}, {1 - share, share, 0})
        .then_as(bent_along(u, v));
  }
  /// Of what is at a place of the surface, in all.
  [[nodiscard]] Displacement in_all(const Displacement& since, const Point& place) const {
    return before_.at(place).then_as(since);
  }
  [[nodiscard]] Displacement bent_along(std::uint32_t u, std::uint32_t v) const {
    const auto bent = bent_.find({std::min(u, v), std::max(u, v)});
    return bent == bent_.end() ? Displacement() : bent->second;
  }
  void bend(std::uint32_t u, std::uint32_t v, const Displacement& bent) {
    bent_[{std::min(u, v), std::max(u, v)}].unite(bent);
  }
  /// Whether a step of this length may be made with which that is moved in all. Some that are nothing but
  /// rounding may where no moves are left.
  static bool is_left(const Displacement& moved, double step, double most) {
    constexpr double some = 20 * as_good_as_on;
    return moved.length() <= (step <= as_good_as_on * most ? 1 + some : 1) * most;
  }
  void tell_move(const Displacement& moved) {
    report_.largest_move = std::max(report_.largest_move, moved.length());
  }
  static Displacement of_point(const std::vector<Displacement>& of_points, std::uint32_t p) {
    return p < of_points.size() ? of_points[p] : Displacement();
  }
  void raise(std::vector<Displacement>& of_points, std::uint32_t p, const Displacement& moved) const {
    if (p >= of_points.size()) of_points.resize(editor_.point_count());
    of_points[p].unite(moved);
  }

  void clean() {
    if (!(clean_ > 0)) return;
    for (int pass = 0; pass < 4; ++pass) {
      std::uint64_t changed = 0;
      for (const auto& [u, v] : sizing_.edges_where([&](double length, double) { return length < clean_; })) {
        Interruption::check();
        if (editor_.star(u).empty() || editor_.star(v).empty() || editor_.length(u, v) > clean_between(u, v))
          continue;
        if (editor_.collapse_either(u, v, {.shape = 0, .length = 0}) || merge_either(u, v, false)) ++changed;
      }
      changed += lead_edges_through_points() + peel_flakes();
      if (changed == 0) return;
    }
  }

  /// From here on points become others than those that were moved, but the surface is where it is now.
  void remember_moves() {
    std::vector<Displacement> moved(editor_.point_count());
    for (std::uint32_t p = 0; p < moved.size(); ++p)
      if (!editor_.star(p).empty() && editor_.kind(p) != Editor::inside)
        moved[p] = in_all(since_at(p), editor_.point(p));
    before_ = SurfaceMoves(editor_, moved, options_.clean);
    moved_.clear();
    bent_.clear();
    bent_at_.clear();
  }

  /// What is thinner than is cleaned though its edges are long: three points on a line, but for that.
  std::uint64_t lead_edges_through_points() {
    std::uint64_t changed = 0;
    for (std::uint32_t t = 0; t < editor_.size(); ++t) {
      if (editor_.at(t).is_gone() || editor_.at(t).shape > fair) continue;
      Interruption::check();
      const auto points = editor_.at(t).point;
      const auto edges = edges_of(editor_.at(t));
      changed += std::ranges::any_of(edges, [&](const Pair& edge) {
        return std::ranges::any_of(points, [&](std::uint32_t m) {
          const auto& [u, v] = edge;
          if (m == u || m == v) return false;
          const auto distance = editor_.distance_from_edge(m, u, v);
          const double most = clean_at(editor_.point(m));
          return distance && *distance <= most && editor_.is_on_surface(u, v) &&
                 lead_through({std::min(u, v), std::max(u, v)}, m, most, Editor::Gain::no_more);
        });
      });
    }
    return changed;
  }

  /// Takes away what stands out of the surface and is thinner than is cleaned.
  std::uint64_t peel_flakes() {
    std::uint64_t changed = 0;
    for (std::uint32_t t = 0; t < editor_.size(); ++t) {
      if (editor_.at(t).is_gone() || editor_.at(t).shape > fair ||
          std::ranges::count(editor_.at(t).side, Editor::inner) > 2)
        continue;
      Interruption::check();
      if (peel(t)) ++changed;
    }
    return changed;
  }

  /// An edge that passes by a point leads through it, if it is no farther from it than this; told if it is on
  /// the surface.
  bool lead_through(const Pair& edge, std::uint32_t m, double most, Editor::Gain gain) {
    const auto& [u, v] = edge;
    const auto foot = editor_.foot_on_edge(m, u, v);
    if (!foot) return false;
    const Point step = editor_.point(m) - *foot;
    const double length = std::sqrt(dot(step, step));
    if (length > most) return false;
    if (!editor_.is_on_surface(u, v)) return editor_.lead_through(u, v, m, gain);
    if (is_left(in_all(since_along(u, v, *foot).then(step), *foot), length, clean_at(editor_.point(m))))
      return lead_to(edge, m, step, gain);
    return lead_half_way(edge, m, *foot, gain);
  }

  /// @param step from the edge to the point.
  bool lead_to(const Pair& edge, std::uint32_t m, const Point& step, Editor::Gain gain) {
    const auto& [u, v] = edge;
    const Point foot = editor_.point(m) - step;
    const Displacement since = since_along(u, v, foot).then(step);
    const Displacement bent = bent_along(u, v).then_up_to(step);
    const std::vector<std::uint32_t> around = editor_.neighbours(u), around_v = editor_.neighbours(v);
    if (!editor_.lead_through(u, v, m, gain)) return false;
    bend(u, m, bent);
    bend(v, m, bent);
    for (const std::uint32_t p : around)
      if (p != m && std::ranges::binary_search(around_v, p)) bend(p, m, bent);
    raise(bent_at_, m, since);
    ++report_.bent_edges;
    tell_move(in_all(since, foot));
    return true;
  }

  /// The point comes to meet the edge, so that either goes half as far.
  /// @return whether something has changed.
  bool lead_half_way(const Pair& edge, std::uint32_t m, const Point& foot, Editor::Gain gain) {
    if (editor_.kind(m) == Editor::inside) return false;
    const Point at = editor_.point(m), middle = between(foot, at);
    const Displacement since = since_at(m).then(middle - at), moved = in_all(since, at);
    const Displacement of_edge = since_along(edge[0], edge[1], foot).then(middle - foot);
    const double most = clean_at(at);
    if (moved.length() > most || in_all(of_edge, foot).length() > most || !editor_.put(m, middle, 0))
      return false;
    const bool is_led = lead_to(edge, m, middle - foot, gain);
    if (!is_led && editor_.put(m, at, 0)) return false;
    if (!is_led) editor_.hold(m);
    raise(moved_, m, since);
    ++report_.moved_points;
    tell_move(moved);
    return true;
  }
  static Point between(const Point& a, const Point& b) {
    Point middle;
    for (std::size_t k = 0; k < 3; ++k) middle[k] = a[k] + (b[k] - a[k]) / 2;
    return middle;
  }

  // --- shape ---

  /// See Editor::arrange. What has been tried is tried once more.
  void arrange() {
    const std::vector<std::uint32_t> map = editor_.arrange();
    for (Piece::Shared& shared : shared_) shared.point = map[shared.point];
    tried_.clear();
  }

  void make_good() {
    arrange();
    wanted_.find(false);
    for (int pass = 0; pass < 6; ++pass)
      if (sizing_.coarsen(1, fair) * 50 < editor_.point_count() && pass > 1) break;
    improve(good, false);
    const auto counts = wanted_.tetrahedra_by_part();
    const bool is_in_pieces = is_for_pieces(counts);
    is_in_pieces ? work_in_pieces(counts) : refine_well();
    clean_ = share_when_refined * options_.clean;
    clean_and_finish();  // what that has brought near to each other; not in pieces: what they share stays
    clean_ = options_.clean;
    if (has_worse_than(very_thin)) clean_and_finish();
    if (!is_in_pieces && has_worse_than(very_thin) && wanted_.begin_again_with_cleaned()) {
      refine_well();
      clean_and_finish();
    }
    report_.detail = wanted_.detail();
    report_.too_many = std::max(report_.too_many, wanted_.too_many());
  }

  void refine_well() {
    for (int pass = 0; pass < 10; ++pass) {
      arrange();
      const auto before = static_cast<double>(editor_.count());
      wanted_.find_finer();
      refine_once();
      const double change = std::abs(static_cast<double>(editor_.count()) - before);
      if (!wanted_.may_be_finer() && change < 0.02 * before) break;
    }
  }

  void refine_once() {
    sizing_.refine();
    for (int again = 0; again < 3; ++again)
      if (sizing_.coarsen() * 50 < editor_.point_count()) break;
    improve(good, false);
    sizing_.smooth_all();
  }

  /// Edges near what pieces share; what is fine beside it stays so.
  void refine_seam(const std::vector<std::uint32_t>& seam) {
    const std::uint64_t since = editor_.clock();
    for (const std::uint32_t p : seam) editor_.touch(p);
    wanted_.find_finest();
    sizing_.coarsen(since);
    for (int pass = 0; pass < 6; ++pass) {
      wanted_.find_finer();
      const std::uint64_t split = sizing_.refine(since);
      improve(good, false);
      sizing_.smooth_all();
      if (split == 0) break;
    }
  }

  [[nodiscard]] bool has_worse_than(double shape) const {
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape < shape) return true;
    return false;
  }

  void clean_and_finish() {
    clean();
    remember_moves();
    finish();
  }

  void finish() {
    for (int pass = 0; pass < 6; ++pass) {
      if (improve(pass < 3 ? fair : good, true) == 0) break;
      sizing_.smooth_all();
    }
    for (int pass = 0; pass < 2; ++pass) {
      improve(very_good, false);
      sizing_.smooth_all();
    }
    // The worst ones, as long as that helps.
    for (int pass = 0; pass < 20 && improve(fair, true) > 0; ++pass) sizing_.smooth_all();
  }

  // --- parts by themselves ---

  /// Whether there are several, and enough to do for what that costs.
  [[nodiscard]] bool is_for_pieces(const std::map<std::int32_t, double>& expected) const {
    double sum = 0;
    for (const auto& [part, count] : expected) sum += count;
    return expected.size() > 1 && sum >= options_.by_parts_from;
  }

  /// Each part becomes a mesh of its own, in which what it shares stays; what comes of that does not depend
  /// on who makes it. Then the seams are improved.
  void work_in_pieces(const std::map<std::int32_t, double>& expected) {
    arrange();
    wanted_.find(true, true);
    sizing_.refine();
    improve(good, false);
    sizing_.smooth_all();
    arrange();
    wanted_.find(true);
    const Piece whole = result();
    std::vector<Piece> pieces = divided(whole, wanted_.at_points());
    editor_ = Editor({});
    std::sort(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
      return expected.at(a.mesh.part.front()) > expected.at(b.mesh.part.front());
    });
    replace_all(pieces, options_.threads, [this](const Piece& piece) {
      Shaping shaping(piece, options_);
      shaping.run_of_piece();
      return shaping.result();
    });
    for (const Piece& piece : pieces) report_.too_many = std::max(report_.too_many, piece.too_many);
    std::vector<std::uint32_t> seam;
    const Piece all = joined(whole, std::move(pieces), seam);
    editor_ = Editor(all.mesh, all.kind);
    settle_all_but(seam);
    refine_seam(seam);
  }

  /// What is away from these points was improved already.
  void settle_all_but(const std::vector<std::uint32_t>& seam) {
    std::vector<bool> is_near(editor_.point_count(), false);
    for (const std::uint32_t p : seam)
      for (const std::uint32_t q : editor_.neighbours(p)) is_near[q] = true;
    for (std::uint32_t p = 0; p < is_near.size(); ++p)
      if (!is_near[p]) editor_.settle(p);
    tried_.assign(editor_.size(), {});
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (std::ranges::none_of(editor_.at(t).point, [&](std::uint32_t p) { return is_near[p]; }))
        tried_[t] = {editor_.clock(), true};
  }

  /// Points of the surface go to where they belong, as far as what is around them lets them, and those inside
  /// make room.
  void place_truly() {
    std::vector<std::uint32_t> planes;
    std::vector<std::pair<std::uint32_t, Point>> left;
    for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
      if (editor_.star(p).empty() || editor_.kind(p) == Editor::inside) continue;
      Interruption::check();
      editor_.find_planes(p, planes);
      if (const auto place = options_.true_place(planes, editor_.point(p))) left.emplace_back(p, *place);
    }
    std::vector<Point> before;
    for (const auto& [p, place] : left) before.push_back(editor_.point(p));
    auto open = left;
    for (int pass = 0; pass < 6 && !open.empty(); ++pass) {
      std::erase_if(open, [&](const auto& item) { return put_towards(item.first, item.second); });
      for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
        Interruption::check();
        if (editor_.kind(p) == Editor::inside) editor_.smooth(p);
      }
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
      const double moved = distance(before[i], editor_.point(left[i].first));
      report_.placed += moved > 0 ? 1 : 0;
      report_.largest_placing = std::max(report_.largest_placing, moved);
    }
  }
  static double distance(const Point& a, const Point& b) { return std::sqrt(squared_distance(a, b)); }

  /// @return whether it has got there.
  bool put_towards(std::uint32_t p, const Point& place) {
    Interruption::check();
    for (const double share : {1.0, 0.5, 0.25}) {
      Point to = editor_.point(p);
      for (std::size_t k = 0; k < 3; ++k) to[k] = share < 1 ? to[k] + share * (place[k] - to[k]) : place[k];
      if (editor_.put(p, to, fair)) return share == 1;
    }
    return false;
  }

  /// Tetrahedra that are worse than `below` are made better. @return how often one was.
  std::uint64_t improve(double below, bool with_new_points) {
    std::vector<std::tuple<std::uint32_t, std::uint32_t, double>> worst;
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (const double shape = editor_.at(t).shape; !editor_.at(t).is_gone() && shape < below)
        worst.emplace_back(rank_of(std::max(shape, 0.0)), t, shape);
    std::sort(worst.begin(), worst.end());
    std::uint64_t count = 0;
    for (const auto& [rank, t, shape] : worst) {
      Interruption::check();
      if (editor_.at(t).is_gone() || editor_.at(t).shape != shape || is_settled(t, with_new_points)) continue;
      if (improve_one(t, with_new_points))
        ++count;
      else
        tried_[t] = {editor_.clock(), with_new_points};
    }
    return count;
  }

  /// Whether it was tried in vain, and nothing around it has changed since.
  bool is_settled(std::uint32_t t, bool with_new_points) {
    if (tried_.size() < editor_.size()) tried_.resize(editor_.size());
    const auto& [clock, with] = tried_[t];
    const auto& points = editor_.at(t).point;
    return with >= with_new_points && std::all_of(points.begin(), points.end(), [&, when = clock](auto p) {
             return editor_.changed_at(p) < when;
           });
  }

  bool improve_one(std::uint32_t t, bool with_new_points) {
    const auto edges = edges_of(editor_.at(t));
    for (const auto& [u, v] : edges)
      if (editor_.remove_edge(u, v)) return true;
    for (int face = 0; face < 4; ++face)
      if (editor_.flip_face(t, face)) return true;
    const auto points = editor_.at(t).point;
    for (const std::uint32_t p : points)
      if (editor_.smooth(p)) return true;
    // A collapse counts if all that comes of it is better than this one.
    const double better = editor_.at(t).shape * 1.01 + 1e-9;
    for (const auto& [u, v] : edges)
      for (const auto& [from, to] : {std::pair(u, v), std::pair(v, u)})
        if (collapse_to_better(from, to, better)) return true;
    if (!with_new_points) return false;
    for (const auto& [u, v] : edges)
      if (editor_.split_better(u, v)) return true;
    return insert_near(t);
  }

  /// Puts a point in the middle of a tetrahedron, or of it and one beside it.
  bool insert_near(std::uint32_t t) {
    const double better = std::max(0.0, editor_.at(t).shape) * 1.1;
    const Point middle = editor_.middle(t);
    std::vector<Point> places{middle};
    for (int face = 0; face < 4; ++face)
      if (const std::uint32_t other = editor_.beyond(t, face); other != Editor::none) {
        Point x = editor_.middle(other);
        for (std::size_t k = 0; k < 3; ++k) x[k] = (x[k] + middle[k]) / 2;
        places.push_back(x);
      }
    return std::any_of(places.begin(), places.end(), [&](const Point& x) {
      if (!editor_.insert(t, x, better)) return false;
      editor_.smooth(static_cast<std::uint32_t>(editor_.point_count() - 1));
      return true;
    });
  }

  bool collapse_to_better(std::uint32_t u, std::uint32_t v, double better) {
    return editor_.kind(u) > Editor::corner &&
           editor_.collapse(u, v, {.shape = better, .length = 2 * wanted_.between(u, v)});
  }
};

}  // namespace

ShapeReport shape(Tetrahedra& mesh, const ShapeOptions& options) {
  Shaping shaping(mesh, options);
  mesh = {};
  const ShapeReport report = shaping.run();
  mesh = shaping.result().mesh;
  return report;
}

}  // namespace bsp2::meshing
