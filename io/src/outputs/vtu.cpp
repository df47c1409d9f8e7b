#include "bsp2/io/outputs/vtu.hpp"

#include <algorithm>
#include <bit>
#include <string>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "files/xml.hpp"
#include "outputs/modules.hpp"
#include "outputs/piece.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;

namespace {

std::string piece_name(const fs::path& pvtu, std::uint64_t piece) {
  return pvtu.stem().string() + "_" + std::to_string(piece) + ".vtu";
}

/// Removes pieces from this one on, as far as they are numbered without a gap.
void remove_pieces(const fs::path& pvtu, std::uint64_t first) {
  std::error_code ignored;
  for (std::uint64_t i = first; fs::remove(folder_of(pvtu) / piece_name(pvtu, i), ignored); ++i) {
  }
}

/// Names and types as the pieces have them.
std::string summary(const fs::path& pvtu, std::uint64_t pieces, const VtuOptions& options) {
  std::string text = R"(<VTKFile type="PUnstructuredGrid" version="1.0" byte_order=")";
  text += std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";
  text += R"(" header_type="UInt64">
  <PUnstructuredGrid GhostLevel="0">
    <PCellData Scalars=")";
  text += options.part_names.empty() ? "primitive" : "part";
  text += R"(">
      <PDataArray type="UInt8" Name="label"/>
      <PDataArray type="Int32" Name="primitive"/>
      <PDataArray type="Int32" Name="part"/>
      <PDataArray type="UInt32" Name="region"/>
      <PDataArray type="Int32" Name="rank"/>
      <PDataArray type="UInt16" Name="level"/>
      <PDataArray type="Float64" Name="volume"/>
)";
  if (!options.colour_of_primitive.empty())
    text += "      <PDataArray type=\"UInt8\" Name=\"color\" NumberOfComponents=\"4\"/>\n";
  text += R"(    </PCellData>
    <PPoints>
      <PDataArray type="Float64" Name="Points" NumberOfComponents="3"/>
    </PPoints>
)";
  for (std::uint64_t i = 0; i < pieces; ++i)
    text += "    <Piece Source=\"" + quoted(piece_name(pvtu, i)) + "\"/>\n";
  return text + "  </PUnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace

void check_vtu() { vtk_module(); }

struct VtuShare::Content {
  std::vector<Piece> pieces;
};

VtuShare::VtuShare(const fs::path& pvtu, int dimension,
                   std::span<const std::shared_ptr<const geometry::CellBatch>> batches, VtuOptions options)
    : pvtu_(pvtu), options_(std::move(options)), content_(std::make_unique<Content>()) {
  if (dimension < 1 || dimension > 3)
    throw Error("cannot write '" + pvtu.string() + "': VTK grids hold solids of dimension 1 to 3, not " +
                std::to_string(dimension) + "; section() or project() in the model give what can be shown");
  // A cell becomes about nine tetrahedra: smaller pieces for the same memory.
  content_->pieces = divide(
      batches, std::max<std::size_t>(1, options_.tets ? options_.piece_cells / 4 : options_.piece_cells));
  if (content_->pieces.front().empty()) content_->pieces.clear();
  scratch_.emplace(folder_of(pvtu_));
}

VtuShare::~VtuShare() = default;

VtuShare::Size VtuShare::size() const {
  const auto& pieces = content_->pieces;
  return {pieces.size(), !options_.tets && std::any_of(pieces.begin(), pieces.end(), [](const Piece& piece) {
            return vtk_module().has_polyhedra(piece);
          })};
}

void VtuShare::write(std::uint64_t before, const Size& all) {
  before_ = before;
  all_pieces_ = all.pieces;
  for (std::size_t i = 0; i < content_->pieces.size();
       ++i) {  // one after the other: only one grid exists at a time
    geometry::Interruption::check();
    const PieceFile file{scratch_->path() / piece_name(pvtu_, before + i), pvtu_};
    const SimplexCount count =
        vtk_module().write_piece(file, content_->pieces[i], all.has_polyhedra, options_);
    simplices_.add(count);
  }
  if (before > 0) return;
  try {
    write_file(scratch_->path() / pvtu_.filename(), summary(pvtu_, all.pieces, options_));
  } catch (const Error&) {
    throw Error("cannot write '" + pvtu_.string() + "': the disk is full");
  }
}

void VtuShare::publish() {
  for (std::size_t i = 0; i < content_->pieces.size(); ++i) publish(piece_name(pvtu_, before_ + i));
}

void VtuShare::finish() {
  publish(pvtu_.filename());
  remove_pieces(pvtu_, all_pieces_);
}

void VtuShare::publish(const fs::path& name) const {
  std::error_code error;
  fs::rename(scratch_->path() / name, folder_of(pvtu_) / name, error);
  if (error) throw Error("cannot write '" + pvtu_.string() + "': " + error.message());
}

void remove_vtu(const fs::path& pvtu) {
  std::error_code ignored;
  fs::remove(pvtu, ignored);  // first: it names the pieces
  remove_pieces(pvtu, 0);
}

void write_vtu(const fs::path& pvtu, int dimension,
               std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
               const VtuOptions& options) {
  VtuShare share(pvtu, dimension, batches, options);
  const VtuShare::Size size = share.size();
  share.write(0, size);
  share.publish();
  share.finish();
}

}  // namespace bsp2::io
