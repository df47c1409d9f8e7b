#include "bsp2/io/vtu.hpp"

#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridAlgorithm.h>
#include <vtkXMLPUnstructuredGridWriter.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <string>
#include <system_error>

#include "bsp2/geometry/error.hpp"
#include "bsp2/io/file.hpp"
#include "vtk_piece.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;

/// A source that makes the piece that is asked for, so that only one piece exists at a time.
class PieceSource : public vtkUnstructuredGridAlgorithm {
 public:
  static PieceSource* New();
  PieceSource(const PieceSource&) = delete;
  PieceSource& operator=(const PieceSource&) = delete;

  std::vector<Piece> pieces;
  bool with_polyhedra = false;  ///< whether any piece has some
  VtuOptions options;
  std::exception_ptr failure;  // VTK knows no exceptions: kept here, thrown after its pipeline has returned

 protected:
  PieceSource() { SetNumberOfInputPorts(0); }

  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override {
    outputs->GetInformationObject(0)->Set(vtkAlgorithm::CAN_HANDLE_PIECE_REQUEST(), 1);
    return 1;
  }

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override {
    try {
      const int asked =
          outputs->GetInformationObject(0)->Get(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER());
      vtkUnstructuredGrid::GetData(outputs)->ShallowCopy(
          make_grid(pieces.at(static_cast<std::size_t>(asked)), with_polyhedra, options));
      return 1;
    } catch (...) {
      failure = std::current_exception();
      return 0;
    }
  }
};
vtkStandardNewMacro(PieceSource);

namespace {

/// VTK prints its errors to stderr; ours are thrown instead.
class SilencedVtk {
 public:
  SilencedVtk() : before_(vtkObject::GetGlobalWarningDisplay()) { vtkObject::GlobalWarningDisplayOff(); }
  ~SilencedVtk() { vtkObject::SetGlobalWarningDisplay(before_); }
  SilencedVtk(const SilencedVtk&) = delete;
  SilencedVtk& operator=(const SilencedVtk&) = delete;

 private:
  int before_;
};

/// VTK notices most failed writes, but not that of a file's last bytes.
bool is_complete(const fs::path& file) {
  constexpr std::string_view end = "</VTKFile>\n";
  std::ifstream in(file, std::ios::binary);
  std::string tail(end.size(), '\0');
  in.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
  in.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return in && tail == end;
}

fs::path piece_name(const fs::path& pvtu, std::size_t piece) {
  return pvtu.stem().string() + "_" + std::to_string(piece) + ".vtu";
}

/// VTK writes no file for a piece without cells; only an empty mesh has one.
std::size_t file_count(const std::vector<Piece>& pieces) {
  return pieces.front().empty() ? 0 : pieces.size();
}

/// Writes all files into a folder of their own.
void write_all(const fs::path& summary, const fs::path& shown, PieceSource* source) {
  const SilencedVtk silenced;
  const int count = static_cast<int>(source->pieces.size());
  vtkNew<vtkXMLPUnstructuredGridWriter> writer;
  writer->SetFileName(summary.c_str());
  writer->SetInputConnection(source->GetOutputPort());
  writer->SetNumberOfPieces(count);
  writer->SetStartPiece(0);
  writer->SetEndPiece(count - 1);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToNone();
  writer->SetHeaderTypeToUInt64();
  writer->SetIdTypeToInt32();  // a piece is small
  const bool written = writer->Write() != 0;
  if (source->failure) std::rethrow_exception(source->failure);
  bool complete = written && writer->GetErrorCode() == vtkErrorCode::NoError && is_complete(summary);
  for (std::size_t i = 0; complete && i < file_count(source->pieces); ++i) {
    complete = is_complete(summary.parent_path() / piece_name(summary, i));
  }
  if (complete) return;
  // VTK's codes below its own range are those of the system; the folder is new, so what else fails is the
  // space.
  const auto code = static_cast<int>(writer->GetErrorCode());
  const bool from_system = code != vtkErrorCode::NoError && code < vtkErrorCode::FirstVTKErrorCode;
  throw Error("cannot write '" + shown.string() +
              "': " + (from_system ? std::generic_category().message(code) : "the disk is full"));
}

/// Moves the files to their names, and removes the pieces that an earlier, larger mesh left there.
void publish(const fs::path& from, const fs::path& pvtu, std::size_t pieces) {
  const fs::path folder = pvtu.has_parent_path() ? pvtu.parent_path() : ".";
  try {
    for (std::size_t i = 0; i < pieces; ++i)
      fs::rename(from / piece_name(pvtu, i), folder / piece_name(pvtu, i));
    fs::rename(from / pvtu.filename(), pvtu);
    for (std::size_t i = pieces; fs::remove(folder / piece_name(pvtu, i)); ++i) {
    }
  } catch (const fs::filesystem_error& error) {
    throw Error("cannot write '" + pvtu.string() + "': " + error.code().message());
  }
}

}  // namespace

void write_vtu(const fs::path& pvtu, int dimension,
               std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
               const VtuOptions& options) {
  if (dimension < 1 || dimension > 3) {
    throw Error("cannot write '" + pvtu.string() + "': VTK grids hold solids of dimension 1 to 3, not " +
                std::to_string(dimension));
  }
  vtkNew<PieceSource> source;
  source->options = options;
  // A cell becomes about nine tetrahedra: smaller pieces for the same memory.
  source->pieces =
      divide(batches, std::max<std::size_t>(1, options.tets ? options.piece_cells / 4 : options.piece_cells));
  source->with_polyhedra = dimension == 3 && !options.tets &&
                           std::any_of(source->pieces.begin(), source->pieces.end(), has_polyhedra);
  const TemporaryDirectory scratch(pvtu.has_parent_path() ? pvtu.parent_path() : ".");
  write_all(scratch.path() / pvtu.filename(), pvtu, source);
  publish(scratch.path(), pvtu, file_count(source->pieces));
}

}  // namespace bsp2::io
