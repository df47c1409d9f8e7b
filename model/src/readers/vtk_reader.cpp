// bsp2-read-vtk: reads surfaces of VTK (.vtp) for the model, and sizes by place (.vtu).
#include <vtkAbstractArray.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkTriangleFilter.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "import/part_names.hpp"
#include "readers/reader_main.hpp"

namespace bsp2::model {
namespace {

/// Keeps the first error that VTK tells of.
class FirstError final : public vtkCommand {
 public:
  static FirstError* New() { return new FirstError; }
  void Execute(vtkObject*, unsigned long, void* data) override {
    if (!text.empty() || data == nullptr) return;
    std::string said = static_cast<const char*>(data);
    // "ERROR: In file, line n\nvtkClass (0x...): what it is about"
    if (const std::size_t at = said.find("): "); at != std::string::npos) said = said.substr(at + 3);
    text = printable_name(said);
    if (text.empty()) text = "VTK cannot read it";
  }
  std::string text;
};

struct Part {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::unordered_map<vtkIdType, std::uint32_t> own;
  std::optional<std::array<double, 4>> colour;
  bool is_of_one_colour = true;
};

std::optional<std::array<double, 4>> colour_at(vtkDataArray* colours, vtkIdType cell) {
  if (colours == nullptr) return std::nullopt;
  std::array<double, 4> colour{0, 0, 0, 255};
  for (int k = 0; k < std::min(colours->GetNumberOfComponents(), 4); ++k)
    colour[static_cast<std::size_t>(k)] = std::clamp(colours->GetComponent(cell, k), 0.0, 255.0);
  for (double& channel : colour) channel /= 255;
  return colour;
}

void add_triangle(vtkPolyData* data, const vtkIdType* corners, Part& part) {
  std::array<std::uint32_t, 3> triangle{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (corners[k] < 0 || corners[k] >= data->GetNumberOfPoints())
      throw Error("a polygon names point " + std::to_string(corners[k]) + ", but there are " +
                  std::to_string(data->GetNumberOfPoints()) + ", the first being 0");
    const auto [found, is_new] =
        part.own.try_emplace(corners[k], static_cast<std::uint32_t>(part.points.size()));
    if (is_new) {
      std::array<double, 3> point{};
      data->GetPoint(corners[k], point.data());
      for (const double x : point)
        if (!(std::fabs(x) <= 1e100))
          throw Error("point " + std::to_string(corners[k]) +
                      " has a coordinate that is not finite or too large");
      part.points.push_back(point);
    }
    triangle[k] = found->second;
  }
  part.triangles.push_back(triangle);
}

void check_corners(vtkPolyData* data) {
  for (vtkCellArray* cells : {data->GetPolys(), data->GetStrips()}) {
    vtkNew<vtkIdList> corners;
    for (vtkIdType i = 0; i < cells->GetNumberOfCells(); ++i) {
      cells->GetCellAtId(i, corners);
      for (vtkIdType k = 0; k < corners->GetNumberOfIds(); ++k)
        if (corners->GetId(k) < 0 || corners->GetId(k) >= data->GetNumberOfPoints())
          throw Error("polygon " + std::to_string(i) + " names point " + std::to_string(corners->GetId(k)) +
                      ", but there are " + std::to_string(data->GetNumberOfPoints()) + ", the first being 0");
    }
  }
}

/// VTK tells of a text that is no XML, or ends too early, by no word.
[[noreturn]] void fail_without(const std::string& what, const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  if (bytes.find("<VTKFile") == std::string::npos)
    throw Error("is no XML file of VTK: there is no <VTKFile> in it");
  if (bytes.find("</VTKFile>") == std::string::npos)
    throw Error("is damaged or cut off: it does not end with </VTKFile>");
  throw Error("there are no " + what + " in it");
}

/// What a reader of VTK makes of a file. @throws Error with the first thing that it says.
template <typename Reader>
void update(Reader* reader, const std::string& path) {
  vtkObject::GlobalWarningDisplayOff();
  vtkNew<FirstError> errors;
  reader->AddObserver(vtkCommand::ErrorEvent, errors);
  reader->SetFileName(path.c_str());
  reader->SetReaderErrorObserver(errors);
  reader->SetParserErrorObserver(errors);
  reader->Update();
  if (!errors->text.empty()) throw Error("it is damaged: " + errors->text);
  if (reader->GetErrorCode() != 0) throw Error("it is damaged, or cut off");
}

void read_surface(const ReadRequest& request, PartsWriter& writer) {
  vtkNew<vtkXMLPolyDataReader> reader;
  update(reader.Get(), request.path);
  vtkPolyData* const data = reader->GetOutput();
  check_corners(data);
  const vtkIdType passed_over = data->GetNumberOfVerts() + data->GetNumberOfLines();
  vtkNew<vtkTriangleFilter> filter;
  filter->SetInputData(data);
  filter->PassVertsOff();
  filter->PassLinesOff();
  filter->Update();
  vtkPolyData* const triangles = filter->GetOutput();
  vtkDataArray* const part_of = triangles->GetCellData()->GetArray("part");
  vtkDataArray* colours = triangles->GetCellData()->GetArray("color");
  if (colours != nullptr && colours->GetNumberOfComponents() < 3) colours = nullptr;
  std::map<long long, Part> parts;
  vtkNew<vtkIdList> corners;
  vtkCellArray* const cells = triangles->GetPolys();
  for (vtkIdType i = 0; i < cells->GetNumberOfCells(); ++i) {
    cells->GetCellAtId(i, corners);
    if (corners->GetNumberOfIds() != 3) continue;
    const double number = part_of != nullptr ? part_of->GetComponent(i, 0) : 0;
    Part& part = parts[std::fabs(number) < 1e9 ? std::llround(number) : -1];
    const auto colour = colour_at(colours, i);
    if (part.triangles.empty()) part.colour = colour;
    if (colour != part.colour) part.is_of_one_colour = false;
    add_triangle(triangles, corners->GetPointer(0), part);
  }
  if (parts.empty()) fail_without("polygons", request.path);
  auto* const names = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("part_names"));
  PartNames used;
  vtkIdType many_coloured = 0;
  for (auto& [number, part] : parts) {
    const bool is_named = names != nullptr && number >= 0 && number < names->GetNumberOfValues();
    if (!part.is_of_one_colour) {
      part.colour.reset();
      ++many_coloured;
    }
    const std::string name = is_named           ? std::string(names->GetValue(number))
                             : names != nullptr ? "no_part"
                                                : "";
    writer.part(used.once(printable_name(name)), part.colour ? &*part.colour : nullptr, part.points,
                part.triangles);
  }
  if (passed_over > 0)
    writer.text(PartsStream::Record::note,
                counted(passed_over, "# [vertex or line is|vertices and lines are] passed over"));
  if (many_coloured > 0)
    writer.text(PartsStream::Record::note,
                counted(many_coloured,
                        "# part[s] [has|have] polygons of several colours, and [comes|come] without one"));
}

// --- sizes by place ---

struct SizeArray {
  vtkDataArray* numbers = nullptr;
  bool is_of_points = false;
};

std::string name_of(const SizeArray& array) {
  const char* const name = array.numbers->GetName();
  return std::string("'") + (name == nullptr ? "" : name) + "' of " +
         (array.is_of_points ? "points" : "cells");
}

/// The one that is called "size", of points before cells, or else the only one that has a number for each.
SizeArray size_array(vtkUnstructuredGrid* grid) {
  std::vector<SizeArray> all;
  for (const bool is_of_points : {true, false}) {
    vtkFieldData* const data = is_of_points ? static_cast<vtkFieldData*>(grid->GetPointData())
                                            : static_cast<vtkFieldData*>(grid->GetCellData());
    for (int i = 0; i < data->GetNumberOfArrays(); ++i) {
      vtkDataArray* const array = data->GetArray(i);
      if (array == nullptr || array->GetNumberOfComponents() != 1) continue;
      if (array->GetName() != nullptr && std::string(array->GetName()) == "size")
        return {array, is_of_points};
      all.push_back({array, is_of_points});
    }
  }
  if (all.size() == 1) return all.front();
  if (all.empty()) throw Error("no array has one number for each point or cell");
  std::string names;
  for (const SizeArray& array : all) names += (names.empty() ? "" : ", ") + name_of(array);
  throw Error("which array are the sizes? None is called 'size', and there are " + names);
}

std::array<double, 3> middle_of_cell(vtkUnstructuredGrid* grid, vtkIdType cell) {
  vtkNew<vtkIdList> corners;
  grid->GetCellPoints(cell, corners);
  std::array<double, 3> middle{}, corner{};
  for (vtkIdType i = 0; i < corners->GetNumberOfIds(); ++i) {
    if (corners->GetId(i) < 0 || corners->GetId(i) >= grid->GetNumberOfPoints())
      throw Error("cell " + std::to_string(cell) + " names point " + std::to_string(corners->GetId(i)) +
                  ", but there are " + std::to_string(grid->GetNumberOfPoints()) + ", the first being 0");
    grid->GetPoint(corners->GetId(i), corner.data());
    for (std::size_t k = 0; k < 3; ++k)
      middle[k] += corner[k] / static_cast<double>(corners->GetNumberOfIds());
  }
  return middle;
}

void read_sizes(const ReadRequest& request, PartsWriter& writer) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  update(reader.Get(), request.path);
  vtkUnstructuredGrid* const grid = reader->GetOutput();
  if (grid->GetNumberOfPoints() == 0) fail_without("points", request.path);
  const auto [sizes, is_of_points] = size_array(grid);
  const vtkIdType count = is_of_points ? grid->GetNumberOfPoints() : grid->GetNumberOfCells();
  if (sizes->GetNumberOfTuples() < count) throw Error("it is damaged: there are too few sizes");
  std::vector<std::array<double, 4>> rows;
  for (vtkIdType i = 0; i < count; ++i) {
    std::array<double, 3> at{};
    if (is_of_points)
      grid->GetPoint(i, at.data());
    else
      at = middle_of_cell(grid, i);
    rows.push_back({at[0], at[1], at[2], sizes->GetComponent(i, 0)});
  }
  writer.sizes(rows);
}

void read(const ReadRequest& request, PartsWriter& writer) {
  request.path.ends_with(".vtu") || request.path.ends_with(".VTU") ? read_sizes(request, writer)
                                                                   : read_surface(request, writer);
}

}  // namespace
}  // namespace bsp2::model

// What is thrown before it listens ends it, which bsp2 tells of.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) { return bsp2::model::read_for_model(argc, argv, &bsp2::model::read); }
