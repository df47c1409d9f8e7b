#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/regions/partition.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "regions/cell_stream.hpp"
#include "regions/region_mesh.hpp"

/// The supersteps, one file each; `run.cpp` has the loop. All are collective.
namespace bsp2::supersteps {

/// A model as text, which travels, and as an expression.
struct Source {
  std::string text;
  model::Model model;
  std::vector<std::string> warnings;  ///< of whoever translated it
};

/// How many threads each rank computes with. Collective.
inline unsigned threads_of(const RunOptions& options, Ranks& ranks) {
  return options.threads != 0 ? options.threads : ranks.cores_of_a_rank();
}

/// What the text is called in messages: its path, which also says where the files are that it names.
std::string source_name(const RunOptions& options);

/// Compilation, the master's part: it reads the file. Empty elsewhere.
/// @throws bsp2::Error if it is no readable file.
/// Source: the paper, section 4.2, "Compilation".
Source compilation(const Ranks& ranks, const RunOptions& options);

/// Broadcast: the text reaches all ranks, so that none waits for another one to parse it. h = (p - 1) times
/// its size. Source: the paper, section 4.2, "Broadcasting".
void broadcasting(Ranks& ranks, Source& source);

/// Compilation on every rank, first half: the text becomes a symbolic model.
/// @throws bsp2::Error that names the place in the file; the same on all ranks.
Source parsed(Source source, const RunOptions& options);

/// The meshes that overlap themselves. @param threads that look for them. @param sound meshes that are known
/// not to.
model::MeshOverlaps overlaps_in(const Source& source, const RunOptions& options, unsigned threads,
                                std::span<const model::TriangleMesh* const> sound = {});

/// Compilation on every rank, second half: the symbolic model becomes a network with canonical hyperplanes
/// and bounds. @param threads that place its primitives.
/// @throws bsp2::Error for lengths that are too large or too small.
template <int D>
dataflow::Network<D> translation(const Source& source, const RunOptions& options, unsigned threads = 1);

/// What merging may have to do with a solid that came out empty, and what to do: to go on a sentence with;
/// nothing if no hyperplanes that differ are one.
/// @param hyperplanes that the network has.
std::string lost_by_merging(const Source& source, const RunOptions& options, std::uint64_t hyperplanes,
                            unsigned threads);

/// Round solids are refined without end, so something has to say where: a thousandth of the model unless
/// the user does. A budget alone does not: depth first, it would be spent in one place.
template <int D>
void limit_refinement(const dataflow::Network<D>& network, RunOptions& options);

/// With --strict, before time is spent on a model that is not as it should be. The same on all ranks.
/// @throws bsp2::Error if there are any.
void refuse_warnings(const std::vector<std::string>& warnings);

/// A partition of space, with the regions of this rank.
template <int D>
struct Distribution {
  dataflow::Partition<D> partition;
  std::vector<std::int32_t> rank_of_region;
};

/// The region with the most work goes to the rank with the least, and so on. @return the rank of each region.
std::vector<std::int32_t> assign_regions(const std::vector<double>& work, int ranks);
/// Each rank gets regions that follow each other in the partition, and so lie beside each other, with its
/// part of the work, but for half a region at each end. @return the rank of each region; ascending.
std::vector<std::int32_t> assign_neighbours(const std::vector<double>& work, int ranks);

/// Distribution: space is cut into regions of about equal work, which do not depend on who computes. Each
/// rank makes its part of them, on `threads` threads, and learns the trees of the others; the master says who
/// gets which, and regions go to their owners without their cells.
/// @param for_ranks so many will share the regions, if more than these ranks: for many, work is estimated
/// more closely. Source: the paper, section 4.2, "Distribution".
template <int D>
Distribution<D> distribution(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options,
                             unsigned threads, unsigned for_ranks = 1);

/// What one rank does of it by itself. Not collective.
template <int D>
dataflow::PartitionPart<D> part_of_distribution(const dataflow::Network<D>& network,
                                                const RunOptions& options, dataflow::PartitionShare share,
                                                unsigned threads, unsigned for_ranks = 1);

template <int D>
struct Computed {
  dataflow::Evaluation<D> evaluation;
  bool shall_move = false;  ///< it was ended since a rank has nothing left to do; the same on all ranks
};

/// Computation: the workers of each rank refine its regions up to the budget; decided cells go to the
/// consumers, what is left comes back as unfinished regions. The ranks stay in touch: a failure of one ends
/// all, the cells of all are counted together, and a rank that has nothing left to do may end the step.
/// @param so_far what the new tree is numbered from.
/// @param quota this rank stops at so many cells more than it has, undecided ones counted; options.cells is
/// for all ranks together.
/// @param stream whose cells travel meanwhile; may be null.
/// Source: the paper, section 4.2, "Computation".
template <int D>
Computed<D> computation(Ranks& ranks, const dataflow::Network<D>& network,
                        std::vector<dataflow::Region<D>> regions, const RunOptions& options, unsigned threads,
                        const Recorded& so_far, std::optional<std::uint64_t> quota, CellStream* stream,
                        std::span<dataflow::Consumer* const> consumers);

/// The picture of what is left, for the report and the outputs: FUZZY where it is undecided. Each rank draws
/// its own regions.
template <int D>
dataflow::Evaluation<D> provisional_cells(const dataflow::Network<D>& network,
                                          std::span<const dataflow::Region<D>> regions,
                                          const RunOptions& options, unsigned threads, const Recorded& so_far,
                                          std::span<dataflow::Consumer* const> consumers);

/// Collection: brings the cells of all ranks to the master, or leaves them where they are. Cost: h = bytes of
/// all cells that the master receives, or of what the stream has not brought there before; with `tree`, half
/// of them at a time.
/// @param stream what it brought becomes the meshes'; may be null.
/// @return whether the master has all cells; the other ranks then have none.
/// Source: the paper, section 4.2, "Collection" and the hierarchical architecture.
bool collection(Ranks& ranks, RegionMeshes& meshes, Collect how, CellStream* stream = nullptr);

/// Sends a region's mesh, batch by batch. @see receive
void send(Ranks& ranks, int to, RegionMesh mesh);
/// Takes in one message of those that `send` made of a mesh. @return whether it was the last one.
bool receive(std::string_view message, RegionMesh& mesh);

/// The cells that a rank glues: those of its own regions, whether they have been collected since or not.
struct CellShare {
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
  std::vector<std::uint64_t>
      first_cell;  ///< number of the first cell of each batch, counted through all regions in their order
};
CellShare share_of(Ranks& ranks, const RegionMeshes& meshes, std::size_t regions);  ///< Collective.

/// What the cells are to each other and to the space around them.
struct Resolution {
  std::vector<geometry::Contact> contacts;  ///< when asked for: those that this rank found, by cells
  std::optional<geometry::TriangleSurface> boundary;           ///< when asked for: on the master
  std::optional<geometry::Brep> faces;                         ///< likewise
  std::optional<std::vector<geometry::PartOutline>> outlines;  ///< of a plane solid, likewise
};

/// Resolution: glues the IN cells. Where cells touch, on either side of a cut, of the same region or not,
/// their facets are matched hyperplane by hyperplane; what no other cell covers is the boundary. Each rank
/// glues its own regions, and some of the cuts between regions. h = facets that lie on cuts between regions
/// of different ranks, and then the edges of the boundary, which all triangulate. Of a plane solid
/// the master traces the outline; h = its cells. Nothing is found for other dimensions. Collective.
/// @param share is given up region by region: cells that nobody else holds are freed on the way.
/// Source: the paper, section 4.2, "Resolution".
template <int D>
Resolution resolution(Ranks& ranks, const dataflow::Network<D>& network,
                      const dataflow::Partition<D>& partition, CellShare share, const RunOptions& options,
                      unsigned threads);

/// Puts the skins that the ranks have found together: on the master, the boundary, and its faces if they are
/// wanted. Collective.
void find_boundary(Ranks& ranks, const geometry::HyperplaneTable<3>& table, geometry::Skin mine,
                   bool with_faces, unsigned threads, std::optional<geometry::TriangleSurface>& boundary,
                   std::optional<geometry::Brep>& faces, const geometry::ToldShare& told);

/// Meshing: the IN cells as a complex that conforms, on the master; each rank makes the faces of its own
/// cells. h = the cells around those of other ranks, and then the faces, which the master receives.
/// Collective. @throws geometry::Interrupted on all ranks if one has been told to end.
std::shared_ptr<meshing::Complex> meshing_cells(Ranks& ranks, const geometry::HyperplaneTable<3>& table,
                                                std::vector<std::shared_ptr<const geometry::CellBatch>> cells,
                                                const RunOptions& options, unsigned threads);

/// Tells whoever follows the run of a part of a superstep, which leads from one share of it to another one;
/// empty where nobody does, as on all ranks but the master.
geometry::ToldShare told_share(const Ranks& ranks, const RunOptions& options, double from, double to);

/// The contacts among cells of any region, counted through the batches. Not collective.
std::vector<geometry::Contact> contacts_among(
    const geometry::HyperplaneTable<3>& table,
    std::span<const std::shared_ptr<const geometry::CellBatch>> batches, unsigned threads);

/// Sums over all ranks, on the master: exact, so they do not depend on who computed what.
template <int D>
dataflow::Totals<D> sum_totals(Ranks& ranks, const dataflow::Network<D>& network,
                               const dataflow::Totals<D>& totals);

/// The partition's tree over trees of its regions.
/// @param roots of the regions in `tree`, by number.
template <int D>
geometry::BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition,
                             geometry::BspTree tree, const std::vector<std::int32_t>& roots);

}  // namespace bsp2::supersteps
