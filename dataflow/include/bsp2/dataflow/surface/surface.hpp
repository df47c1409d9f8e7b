#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <string>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/contact.hpp"

namespace bsp2::dataflow {

/// Whether `trace_surface` knows all that the network is made of: convex solids of not too many facets, and
/// one part.
[[nodiscard]] bool has_plain_facets(const Network<3>& network);

struct SurfaceOptions {
  unsigned threads = 1;
  /// Of several that share the work, which one this is: each finds the skin in a part of space.
  unsigned share = 0, shares = 1;
  std::function<bool()> interrupted;  ///< asked often, by the calling thread: true ends the work
  /// Told the share that is done, ten times a second by the calling thread.
  std::function<void(double)> on_progress;
};

struct TracedSurface {
  geometry::Skin skin;
  std::uint64_t boxes = 0;           ///< that were looked at
  std::uint64_t boxes_of_cells = 0;  ///< of these, those in which cells told
  std::uint64_t regions = 0;         ///< of this share
  bool interrupted = false;          ///< the skin is not complete
  bool has_given_up = false;  ///< likewise: too many operands meet in one place, or one reaches out of bounds
  std::exception_ptr failure;  ///< likewise: what a thread threw first
};

/// The surface of a solid without its cells.
///
/// Space is cut by planes across the axes that no operand ends in, until no box has more than one operand's
/// facets, or it has few facets. There the facets of each operand, clipped by the box, are held against the
/// other operands, and the pieces stay across which the expression changes; all others, which no other
/// operand meets, are taken as they are. So no cell is made where the solid is far from its surface, nor
/// along the facets of an operand that meets no other one. Decided by the one exact predicate, as cells are.
/// The skins of all shares together are that of the solid, whatever the number of shares and threads.
/// @pre has_plain_facets(network). @throws what a function of the options throws; the work has ended then.
[[nodiscard]] TracedSurface trace_surface(Network<3>& network, const SurfaceOptions& options);

/// 128 bits of points, triangles and owners, byte for byte.
[[nodiscard]] std::string digest_of(const geometry::TriangleSurface& surface);

}  // namespace bsp2::dataflow
