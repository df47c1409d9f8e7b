#include "vtk/vtk_piece.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedIntArray.h>
#include <vtkUnsignedShortArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <array>
#include <bit>
#include <unordered_map>

#include "vtk/vtk_cell.hpp"

namespace bsp2::io {
namespace {

using geometry::CellBatch;

struct PointHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t h = 0;
    for (const double x : p) h = (std::rotl(h, 23) ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15U;
    return h ^ (h >> 32);
  }
};

/// Makes one point of equal ones.
class PointWelder {
 public:
  PointWelder() { points_->SetDataTypeToDouble(); }

  vtkIdType id_of(std::span<const double> coordinates) {
    std::array<double, 3> p{};
    for (std::size_t i = 0; i < coordinates.size(); ++i)
      p[i] = coordinates[i] + 0.0;  // -0 and +0 are one point
    const auto [found, is_new] = ids_.try_emplace(p, static_cast<vtkIdType>(ids_.size()));
    if (is_new) points_->InsertNextPoint(p.data());
    return found->second;
  }
  [[nodiscard]] vtkPoints* points() const { return points_; }

 private:
  std::unordered_map<std::array<double, 3>, vtkIdType, PointHash> ids_;
  vtkNew<vtkPoints> points_;
};

/// The cell arrays; one value each a cell of the grid.
class CellArrays {
 public:
  explicit CellArrays(const VtuOptions& options) : options_(&options) {
    color_->SetName("color");
    color_->SetNumberOfComponents(4);
    label_->SetName("label");
    primitive_->SetName("primitive");
    part_->SetName("part");
    region_->SetName("region");
    rank_->SetName("rank");
    level_->SetName("level");
    volume_->SetName("volume");
  }
  void add(const CellBatch& batch, std::size_t cell, int rank, double volume) {
    if (!options_->colour_of_primitive.empty()) color_->InsertNextTypedTuple(colour_of(batch, cell).data());
    label_->InsertNextValue(static_cast<unsigned char>(batch.label[cell]));
    primitive_->InsertNextValue(batch.primitive[cell]);
    part_->InsertNextValue(batch.part[cell]);
    region_->InsertNextValue(batch.region[cell]);
    rank_->InsertNextValue(rank);
    level_->InsertNextValue(batch.level[cell]);
    volume_->InsertNextValue(volume);
  }
  void attach_to(vtkCellData* data) const {
    for (vtkDataArray* array :
         std::initializer_list<vtkDataArray*>{label_, primitive_, part_, region_, rank_, level_, volume_}) {
      data->AddArray(array);
    }
    if (!options_->colour_of_primitive.empty()) data->AddArray(color_);
    data->SetActiveScalars(options_->part_names.empty() ? "primitive"
                                                        : "part");  // what ParaView colours by at first
  }

 private:
  [[nodiscard]] const std::array<std::uint8_t, 4>& colour_of(const CellBatch& batch, std::size_t cell) const {
    const auto primitive = static_cast<std::size_t>(batch.primitive[cell]);  // none: beyond all
    const bool has_one =
        batch.label[cell] == geometry::Label::in && primitive < options_->colour_of_primitive.size();
    return has_one ? options_->colour_of_primitive[primitive] : options_->other_colour;
  }

  const VtuOptions* options_;
  vtkNew<vtkUnsignedCharArray> label_, color_;
  vtkNew<vtkIntArray> primitive_, part_, rank_;
  vtkNew<vtkUnsignedIntArray> region_;
  vtkNew<vtkUnsignedShortArray> level_;
  vtkNew<vtkDoubleArray> volume_;
};

class GridBuilder {
 public:
  explicit GridBuilder(const VtuOptions& options) : options_(options), arrays_(options) {}

  /// @param as_polyhedron although the cell may be something simpler.
  void add(const CellBatch& batch, std::size_t cell, bool as_polyhedron) {
    weld(batch, cell);
    if (options_.tets && batch.dimension > 1) {
      add_simplices(batch, cell);
    } else {
      add_whole(batch, cell, as_polyhedron);
    }
  }

  [[nodiscard]] const SimplexCount& simplices() const { return count_; }

  [[nodiscard]] vtkSmartPointer<vtkUnstructuredGrid> finish() const {
    auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
    grid->SetPoints(welder_.points());
    const bool polyhedra = faces_->GetNumberOfValues() > 0;
    grid->SetCells(types_, cells_, polyhedra ? face_locations_.Get() : nullptr,
                   polyhedra ? faces_.Get() : nullptr);
    arrays_.attach_to(grid->GetCellData());
    add_part_names(grid->GetFieldData(), options_.part_names);
    return grid;
  }

 private:
  void weld(const CellBatch& batch, std::size_t cell) {
    const auto d = static_cast<std::size_t>(batch.dimension);
    const std::span<const double> points = batch.cell_points(cell);
    ids_.resize(batch.point_count(cell));
    for (std::size_t i = 0; i < ids_.size(); ++i) ids_[i] = welder_.id_of(points.subspan(i * d, d));
  }

  void add_whole(const CellBatch& batch, std::size_t cell, bool as_polyhedron) {
    describe(batch, cell, shape_);
    if (as_polyhedron) shape_.type = VTK_POLYHEDRON;
    start_cell(shape_.type, shape_.points);
    if (shape_.type == VTK_POLYHEDRON) add_faces(batch, cell);
    arrays_.add(batch, cell, rank_of(batch, cell), batch.volume[cell]);
  }

  void add_simplices(const CellBatch& batch, std::size_t cell) {
    SimplexCount count;
    const bool is_whole = cut_into_simplices(batch, cell, simplices_);
    double volume = 0;
    for (const Simplex& simplex : simplices_) {
      const auto corners = static_cast<std::size_t>(batch.dimension) + 1;
      volume += simplex.volume;
      count.smallest_angle = std::min(count.smallest_angle, smallest_angle(batch, cell, simplex));
      start_cell(batch.dimension == 3 ? VTK_TETRA : VTK_TRIANGLE, std::span(simplex.points).first(corners));
      arrays_.add(batch, cell, rank_of(batch, cell), simplex.volume);
    }
    count.simplices = simplices_.size();
    if (!is_whole) {
      count.incomplete_cells = 1;
      count.left_out_volume = std::max(0.0, batch.volume[cell] - volume);
    }
    count_.add(count);
  }

  void start_cell(unsigned char type, std::span<const std::uint16_t> points) {
    types_->InsertNextValue(type);
    cells_->InsertNextCell(static_cast<int>(points.size()));
    for (const std::uint16_t point : points) cells_->InsertCellPoint(ids_[point]);
    face_locations_->InsertNextValue(type == VTK_POLYHEDRON ? faces_->GetNumberOfValues() : -1);
  }

  void add_faces(const CellBatch& batch, std::size_t cell) {
    faces_->InsertNextValue(static_cast<vtkIdType>(batch.facet_count(cell)));
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      const auto vertices = batch.vertices_of_facet(f);
      faces_->InsertNextValue(static_cast<vtkIdType>(vertices.size()));
      for (const std::uint16_t vertex : vertices) faces_->InsertNextValue(ids_[vertex]);
    }
  }

  [[nodiscard]] int rank_of(const CellBatch& batch, std::size_t cell) const {
    return options_.rank_of_region.empty() ? options_.rank : options_.rank_of_region.at(batch.region[cell]);
  }

  const VtuOptions& options_;
  PointWelder welder_;
  CellArrays arrays_;
  vtkNew<vtkUnsignedCharArray> types_;
  vtkNew<vtkCellArray> cells_;
  vtkNew<vtkIdTypeArray> faces_, face_locations_;
  std::vector<vtkIdType> ids_;  // of the points of the present cell
  VtkCell shape_;
  std::vector<Simplex> simplices_;
  SimplexCount count_;
};

}  // namespace

void add_part_names(vtkFieldData* to, const std::vector<std::string>& part_names) {
  if (part_names.empty()) return;
  vtkNew<vtkStringArray> names;
  names->SetName("part_names");
  for (const std::string& name : part_names) names->InsertNextValue(name);
  to->AddArray(names);
}

bool has_polyhedra(const Piece& piece) {
  VtkCell shape;
  for (const CellRange& range : piece) {
    for (std::size_t cell = range.first; cell < range.last; ++cell) {
      describe(*range.batch, cell, shape);
      if (shape.type == VTK_POLYHEDRON) return true;
    }
  }
  return false;
}

vtkSmartPointer<vtkUnstructuredGrid> make_grid(const Piece& piece, bool with_polyhedron,
                                               const VtuOptions& options, SimplexCount& simplices) {
  GridBuilder builder(options);
  bool missing = with_polyhedron && !has_polyhedra(piece);
  for (const CellRange& range : piece) {
    for (std::size_t cell = range.first; cell < range.last; ++cell) {
      builder.add(*range.batch, cell, missing);
      missing = false;
    }
  }
  simplices.add(builder.simplices());
  return builder.finish();
}

}  // namespace bsp2::io
