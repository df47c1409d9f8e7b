// Files of CAD programs as others write them, made by Open CASCADE: units, assemblies, surfaces, curved
// faces.
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <GProp_GProps.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <STEPControl_Writer.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopoDS_Compound.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
// gtest after Open CASCADE: both have macros
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::model {
namespace {

struct Read {
  std::vector<SolidPart> solids;
  std::vector<std::string> warnings, notes;
};

Read read(const std::filesystem::path& path, const Fineness& fineness = {}) {
  Read result;
  result.solids = solids_of_file(path, fineness,
                                 {[&](const std::string& text) { result.warnings.push_back(text); },
                                  [&](const std::string& text) { result.notes.push_back(text); }});
  return result;
}

double volume(const SolidPart& part) { return signed_volume(part.mesh.points, part.mesh.triangles); }

double volume_of(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties);
  return properties.Mass();
}

void expect_one_line(const std::vector<std::string>& told, const std::string& part) {
  ASSERT_EQ(told.size(), 1U) << (told.empty() ? "" : told[1]);
  EXPECT_NE(told[0].find(part), std::string::npos) << told[0];
}

class CadImport : public testing::Test {
 protected:
  CadImport() {
    Message::DefaultMessenger()->ChangePrinters().Clear();
    STEPCAFControl_Controller::Init();
    IGESControl_Controller::Init();
    Interface_Static::SetCVal("write.step.unit", "MM");
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_.path() / name).string(); }
  std::string step(const TopoDS_Shape& shape, const char* name, const char* unit = "MM") {
    Interface_Static::SetCVal("write.step.unit", unit);
    STEPControl_Writer writer;
    writer.Transfer(shape, STEPControl_AsIs);
    writer.Write(path(name).c_str());
    return path(name);
  }
  std::string iges(const TopoDS_Shape& shape, const char* name, bool as_solids, const char* unit = "MM") {
    IGESControl_Writer writer(unit, as_solids ? 1 : 0);
    writer.AddShape(shape);
    writer.ComputeModel();
    writer.Write(path(name).c_str());
    return path(name);
  }
  static TopoDS_Shape drilled() {
    return BRepAlgoAPI_Cut(
               BRepPrimAPI_MakeBox(10, 20, 30).Shape(),
               BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(5, 10, -1), gp_Dir(0, 0, 1)), 3, 40).Shape())
        .Shape();
  }

  samples::TemporaryFolder folder_;
};

TEST_F(CadImport, PlaneFacesAreExact) {
  const auto box = read(step(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), "box.step"));
  ASSERT_EQ(box.solids.size(), 1U);
  EXPECT_EQ(volume(box.solids[0]), 6000);
  EXPECT_EQ(box.solids[0].mesh.points.size(), 8U);
  EXPECT_TRUE(box.warnings.empty() && box.notes.empty());
}

/// However small: Open CASCADE wants no finer triangles than it can tell points apart.
TEST_F(CadImport, SmallSolidsAreRead) {
  for (const double size : {1e-2, 1e-4, 1e-5}) {
    BRepTools::Write(BRepPrimAPI_MakeBox(size, size, size).Shape(), path("small.brep").c_str());
    const auto box = read(path("small.brep"));
    ASSERT_EQ(box.solids.size(), 1U);
    EXPECT_NEAR(volume(box.solids[0]), size * size * size, 1e-9 * size * size * size);
  }
}

TEST_F(CadImport, UnitsBecomeMillimetres) {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(25.4, 20, 30).Shape();
  const auto inches = read(step(box, "inches.stp", "INCH"));
  EXPECT_NEAR(volume(inches.solids.at(0)), 25.4 * 600, 1e-8);
  expect_one_line(inches.notes, "its unit is the inch; lengths become millimetres");
  const auto other = read(iges(box, "inches.igs", true, "IN"));
  EXPECT_NEAR(volume(other.solids.at(0)), 25.4 * 600, 1e-5);
  expect_one_line(other.notes, "its unit is");
}

TEST_F(CadImport, AssembliesPlaceTheirComponents) {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document);
  const auto shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  const auto colours = XCAFDoc_DocumentTool::ColorTool(document->Main());
  const TDF_Label plate = shapes->AddShape(drilled(), false),
                  bolt = shapes->AddShape(BRepPrimAPI_MakeBox(1, 1, 50).Shape(), false),
                  sub = shapes->NewShape(), top = shapes->NewShape();
  TDataStd_Name::Set(plate, "plate");
  TDataStd_Name::Set(bolt, TCollection_ExtendedString("bolt \xC3\xA4", true));
  colours->SetColor(plate, Quantity_Color(1, 0, 0, Quantity_TOC_sRGB), XCAFDoc_ColorSurf);
  gp_Trsf moved, turned;
  moved.SetTranslation(gp_Vec(100, 0, 0));
  turned.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), std::numbers::pi / 2);
  shapes->AddComponent(sub, plate, TopLoc_Location());
  shapes->AddComponent(sub, bolt, TopLoc_Location(moved));
  shapes->AddComponent(top, sub, TopLoc_Location(moved));
  shapes->AddComponent(top, sub, TopLoc_Location(turned));
  shapes->UpdateAssemblies();
  STEPCAFControl_Writer writer;
  writer.Transfer(document, STEPControl_AsIs);
  writer.Write(path("assembly.step").c_str());
  XCAFApp_Application::GetApplication()->Close(document);

  const auto found = read(path("assembly.step"), {.resolution = {}, .deflection = 0.001});
  ASSERT_EQ(found.solids.size(), 4U);
  const char* names[] = {"plate", "bolt \xC3\xA4", "plate (2)", "bolt \xC3\xA4 (2)"};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(found.solids[i].name, names[i]);
    EXPECT_EQ(found.solids[i].colour, i % 2 == 0 ? std::optional(Colour{1, 0, 0, 1}) : std::nullopt);
    EXPECT_NEAR(volume(found.solids[i]), i % 2 == 0 ? volume_of(drilled()) : 50, 0.5);
  }
  double bolt_from = 1e9, second_to = -1e9;
  for (const Point3& p : found.solids[1].mesh.points) bolt_from = std::min(bolt_from, p[0]);
  for (const Point3& p : found.solids[3].mesh.points) second_to = std::max(second_to, p[1]);
  EXPECT_NEAR(bolt_from, 200, 1e-9);
  EXPECT_NEAR(second_to, 101, 1e-9) << "turned by a right angle";
}

/// The deviation that is told holds, by the volume that is lost and by a finer mesh.
TEST_F(CadImport, CurvedFacesAreClosedAndTheDeviationIsTold) {
  TopoDS_Compound all;
  const BRep_Builder builder;
  builder.MakeCompound(all);
  builder.Add(all, BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, 0), 10).Shape());
  builder.Add(all, BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(40, 0, 0), gp_Dir(1, 1, 1)), 10, 0, 20).Shape());
  builder.Add(all, BRepPrimAPI_MakeTorus(gp_Ax2(gp_Pnt(80, 0, 0), gp_Dir(0, 1, 1)), 10, 3).Shape());
  builder.Add(all, drilled().Moved([] {
    gp_Trsf moved;
    moved.SetTranslation(gp_Vec(0, 50, 0));
    return TopLoc_Location(moved);
  }()));
  BRepTools::Write(all, path("round.brep").c_str());
  for (const std::string& file : {step(all, "round.step"), path("round.brep"), iges(all, "round.iges", true),
                                  iges(all, "surfaces.iges", false)}) {
    SCOPED_TRACE(file);
    double before = 1e9;
    for (const double deflection : {0.2, 0.04}) {
      const auto found = read(file, {.resolution = {}, .deflection = deflection});
      double sum = 0;
      for (const SolidPart& part : found.solids) sum += volume(part);
      const double lost = std::fabs(volume_of(all) - sum);
      EXPECT_LT(lost, 4500 * 2 * deflection) << "the area is below 4500";
      EXPECT_LT(lost, before / 3);
      before = lost;
      ASSERT_EQ(found.warnings.size(), 1U) << found.warnings.at(0);
      const std::string words = "up to ";
      const double told = std::stod(found.warnings[0].substr(found.warnings[0].find(words) + words.size()));
      EXPECT_LT(told, 3 * deflection);
      EXPECT_GT(told, lost / 4500);
    }
  }
}

/// Faces without solids, as many programs write IGES, are sewn to one.
TEST_F(CadImport, SurfacesAreSewn) {
  const auto box = read(iges(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), "box.iges", false));
  ASSERT_EQ(box.solids.size(), 1U);
  EXPECT_NEAR(volume(box.solids[0]), 6000, 1e-6);
  expect_one_line(box.notes, "6 faces belong to no solid");
}

TEST_F(CadImport, ReadersEndWhenTheyAreNotWaitedFor) {
  const std::string file = step(drilled(), "drilled.step");
  {
    const geometry::Interruption stop([] { return true; });
    EXPECT_THROW(read(file), geometry::Interrupted);
  }
  EXPECT_EQ(read(file).solids.size(), 1U);
}

TEST_F(CadImport, DamagedFilesAreRefused) {
  const auto refused = [&](const std::string& file, const std::string& bytes, const std::string& part) {
    std::ofstream(file, std::ios::binary) << bytes;
    try {
      read(file);
      ADD_FAILURE() << "read";
    } catch (const Error& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find(file), 0U) << text;
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
  };
  refused(path("a.step"), "solid x", "is no STEP file");
  refused(path("a.step"), "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n", "is cut off");
  refused(path("a.iges"), "solid x", "is no IGES file");
  refused(path("a.brep"), "solid x", "is no .brep file");
  EXPECT_THROW(read(path("missing.step")), Error);
}

}  // namespace
}  // namespace bsp2::model
