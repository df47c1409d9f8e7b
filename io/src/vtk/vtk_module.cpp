#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <array>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "outputs/modules.hpp"
#include "vtk/vtk_piece.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
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

SimplexCount write_piece(const PieceFile& to, const Piece& piece, bool with_polyhedron,
                         const VtuOptions& options) {
  const SilencedVtk silenced;
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetFileName(to.path.c_str());
  SimplexCount simplices;
  writer->SetInputData(make_grid(piece, with_polyhedron, options, simplices));
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToNone();
  writer->SetHeaderTypeToUInt64();
  writer->SetIdTypeToInt32();  // a piece is small
  const bool written = writer->Write() != 0 && writer->GetErrorCode() == vtkErrorCode::NoError;
  if (written && is_complete(to.path)) return simplices;
  // VTK's codes below its own range are those of the system; the folder is new, so what else fails is the
  // space.
  const auto code = static_cast<int>(writer->GetErrorCode());
  const bool from_system = code != vtkErrorCode::NoError && code < vtkErrorCode::FirstVTKErrorCode;
  throw Error("cannot write '" + to.shown.string() +
              "': " + (from_system ? std::generic_category().message(code) : "the disk is full"));
}

/// The colours of triangles, for the cell array `color`; none if no part has one.
vtkSmartPointer<vtkUnsignedCharArray> colours_of(const geometry::TriangleSurface& surface,
                                                 const SurfaceParts& parts) {
  bool are_any = false;
  for (const auto& colour : parts.colours) are_any = are_any || colour.has_value();
  if (!are_any) return nullptr;
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetName("color");
  colours->SetNumberOfComponents(4);
  for (const std::int32_t owner : surface.owner) {
    const auto part = static_cast<std::size_t>(owner);
    const bool is_known = owner >= 0 && part < parts.colours.size() && parts.colours[part];
    colours->InsertNextTypedTuple((is_known ? *parts.colours[part] : parts.other_colour).data());
  }
  return colours;
}

std::string to_vtp(const geometry::TriangleSurface& surface, const SurfaceParts& parts) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(surface.points.size()));
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    points->SetPoint(static_cast<vtkIdType>(i), surface.points[i].data());
  vtkNew<vtkCellArray> triangles;
  vtkNew<vtkIntArray> owner;
  owner->SetName("part");
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const auto& [a, b, c] = surface.triangles[i];
    const std::array<vtkIdType, 3> corners{a, b, c};
    triangles->InsertNextCell(3, corners.data());
    owner->InsertNextValue(surface.owner[i]);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(triangles);
  data->GetCellData()->AddArray(owner);
  if (const auto colours = colours_of(surface, parts)) data->GetCellData()->AddArray(colours);
  add_part_names(data->GetFieldData(), parts.names);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToNone();
  writer->SetHeaderTypeToUInt64();
  writer->WriteToOutputStringOn();
  if (writer->Write() == 0) throw Error("VTK cannot write the boundary");
  return writer->GetOutputString();
}

}  // namespace
}  // namespace bsp2::io

BSP2_DEFINE_MODULE(bsp2::io::VtkModule, bsp2::io::has_polyhedra, bsp2::io::write_piece, bsp2::io::to_vtp)
