#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <IGESCAFControl_Writer.hxx>
#include <IGESControl_Controller.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopoDS_Compound.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <map>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "occt/shapes.hpp"
#include "outputs/modules.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

/// What it has to say it says in exceptions and return values: nothing on our output.
void silence() {
  for (const auto& printer : Message::DefaultMessenger()->Printers())
    Message::DefaultMessenger()->RemovePrinter(printer);
}

/// The pieces of each part, by its number.
std::map<std::int32_t, TopoDS_Shape> parts_of(const geometry::Brep& brep) {
  std::map<std::int32_t, std::vector<TopoDS_Shape>> pieces;
  const auto shapes = shapes_of(brep);
  for (std::size_t i = 0; i < shapes.size(); ++i) pieces[brep.solids[i].part].push_back(shapes[i]);
  std::map<std::int32_t, TopoDS_Shape> parts;
  BRep_Builder builder;
  for (auto& [part, of_part] : pieces) {
    if (of_part.size() == 1) {
      parts[part] = of_part.front();
      continue;
    }
    TopoDS_Compound all;
    builder.MakeCompound(all);
    for (const TopoDS_Shape& piece : of_part) builder.Add(all, piece);
    parts[part] = all;
  }
  return parts;
}

/// Parts with their names and colours, as the writers of STEP and IGES take them.
Handle(TDocStd_Document) document_of(const geometry::Brep& brep, const SurfaceParts& parts) {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document);
  const auto shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  const auto colours = XCAFDoc_DocumentTool::ColorTool(document->Main());
  for (const auto& [part, shape] : parts_of(brep)) {
    const TDF_Label label = shapes->AddShape(shape, false);
    const auto number = static_cast<std::size_t>(part);
    const std::string name = part >= 0 && number < parts.names.size() ? parts.names[number]
                             : parts.names.empty()                    ? "solid"
                                                                      : "rest";
    TDataStd_Name::Set(label, TCollection_ExtendedString(name.c_str(), true));
    if (part < 0 || number >= parts.colours.size() || !parts.colours[number]) continue;
    const auto& [red, green, blue, opacity] = *parts.colours[number];
    const Quantity_Color colour(red / 255.0, green / 255.0, blue / 255.0, Quantity_TOC_sRGB);
    colours->SetColor(label, Quantity_ColorRGBA(colour, static_cast<float>(opacity) / 255),
                      XCAFDoc_ColorSurf);
  }
  return document;
}

bool write_step(const fs::path& path, const geometry::Brep& brep, const SurfaceParts& parts) {
  STEPCAFControl_Controller::Init();
  Interface_Static::SetCVal("write.step.schema", "AP242DIS");
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetIVal("write.surfacecurve.mode", 0);
  STEPCAFControl_Writer writer;
  writer.SetColorMode(true);
  writer.SetNameMode(true);
  if (!writer.Transfer(document_of(brep, parts), STEPControl_AsIs)) return false;
  APIHeaderSection_MakeHeader header(writer.ChangeWriter().Model());
  header.SetName(new TCollection_HAsciiString(path.filename().c_str()));
  header.SetOriginatingSystem(new TCollection_HAsciiString("bsp2"));
  return writer.Write(path.c_str()) == IFSelect_RetDone;
}

bool write_iges(const fs::path& path, const geometry::Brep& brep, const SurfaceParts& parts) {
  IGESControl_Controller::Init();
  Interface_Static::SetIVal("write.iges.brep.mode", 1);
  Interface_Static::SetCVal("write.iges.unit", "MM");
  IGESCAFControl_Writer writer;
  writer.SetColorMode(true);
  writer.SetNameMode(true);
  return writer.Transfer(document_of(brep, parts)) && writer.Write(path.c_str());
}

bool write_brep(const fs::path& path, const geometry::Brep& brep) {
  TopoDS_Compound all;
  BRep_Builder builder;
  builder.MakeCompound(all);
  for (const auto& [part, shape] : parts_of(brep)) builder.Add(all, shape);
  return BRepTools::Write(all, path.c_str());
}

bool write(const fs::path& path, CadFormat format, const geometry::Brep& brep, const SurfaceParts& parts) {
  try {
    silence();
    switch (format) {
      case CadFormat::step:
        return write_step(path, brep, parts);
      case CadFormat::iges:
        return write_iges(path, brep, parts);
      case CadFormat::brep:
        return write_brep(path, brep);
    }
  } catch (const Standard_Failure& failure) {
    throw Error(std::string("Open CASCADE cannot make the shapes: ") + failure.GetMessageString());
  }
  return false;
}

}  // namespace
}  // namespace bsp2::io

BSP2_DEFINE_MODULE(bsp2::io::OcctModule, &bsp2::io::write)
