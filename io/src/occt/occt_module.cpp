#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <IGESCAFControl_Writer.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESData_IGESModel.hxx>
#include <IGESData_IGESWriter.hxx>
#include <IGESData_Protocol.hxx>
#include <IGESSelect_WorkLibrary.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_ProgressIndicator.hxx>
#include <Message_ProgressScope.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopoDS_Compound.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <new>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "occt/round_shapes.hpp"
#include "occt/shapes.hpp"
#include "outputs/modules.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

/// What it has to say it says in exceptions and return values: nothing on our output.
void silence() { Message::DefaultMessenger()->ChangePrinters().Clear(); }

using PartShapes = std::map<std::int32_t, TopoDS_Shape>;

/// The pieces of each part, by its number.
PartShapes parts_of(const geometry::Brep& brep, const Shapes& shapes, const RoundShapes& rounds) {
  std::map<std::int32_t, std::vector<TopoDS_Shape>> pieces;
  for (const auto& [part, solid] : rounds.solids) pieces[part].push_back(solid);
  for (std::size_t i = 0; i < shapes.solids.size(); ++i)
    if (!shapes.solids[i].IsNull()) pieces[brep.solids[i].part].push_back(shapes.solids[i]);
  PartShapes parts;
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

/// Parts with their names and colours, as the writers of STEP and IGES take them. The application would keep
/// it for ever.
class Document {
 public:
  Document(const PartShapes& of_parts, const CadParts& parts) {
    XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document_);
    for (const auto& [part, shape] : of_parts) add(shape, parts.at(part));
  }
  ~Document() { XCAFApp_Application::GetApplication()->Close(document_); }
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;
  [[nodiscard]] const Handle(TDocStd_Document) & get() const { return document_; }

 private:
  Handle(TDocStd_Document) document_;

  void add(const TopoDS_Shape& shape, const CadPart& part) {
    const TDF_Label label = XCAFDoc_DocumentTool::ShapeTool(document_->Main())->AddShape(shape, false);
    TDataStd_Name::Set(label, TCollection_ExtendedString(part.name.c_str(), true));
    if (!part.colour) return;
    const auto& [red, green, blue, opacity] = *part.colour;
    const Quantity_Color colour(red / 255.0, green / 255.0, blue / 255.0, Quantity_TOC_sRGB);
    XCAFDoc_DocumentTool::ColorTool(document_->Main())
        ->SetColor(label, Quantity_ColorRGBA(colour, static_cast<float>(opacity) / 255), XCAFDoc_ColorSurf);
  }
};

/// Writes a whole file with all digits of its numbers: by itself the writer of STEP gives 12 and that of IGES
/// 9, which bends plane faces. (More than 12 with its own formats cost it the exponents.)
template <typename Writer, typename Protocol>
bool print(const fs::path& path, Writer& writer, const Handle(Protocol) & protocol) {
  writer.FloatWriter().SetFormat("%#.17G");
  writer.FloatWriter().SetFormatForRange("%#.0f", 0, std::numeric_limits<double>::min());  // zeros
  writer.SendModel(protocol);
  std::ofstream file(path, std::ios::binary);
  return writer.Print(file) && file.flush().good();
}

Handle(TCollection_HAsciiString) text(const char* of) { return new TCollection_HAsciiString(of); }

/// By which Open CASCADE asks now and then whether to go on.
class Stop : public Message_ProgressIndicator {
 public:
  explicit Stop(bool (*is_over)()) : is_over_(is_over) {}
  Standard_Boolean UserBreak() override { return is_over_(); }

 private:
  void Show(const Message_ProgressScope&, const Standard_Boolean) override {}
  bool (*is_over_)();
};

bool write_step(const fs::path& path, const PartShapes& of_parts, const CadParts& parts,
                const Handle(Stop) & stop) {
  STEPCAFControl_Controller::Init();
  Interface_Static::SetCVal("write.step.schema", "AP242DIS");
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetIVal("write.surfacecurve.mode", 0);
  STEPCAFControl_Writer writer;
  writer.SetColorMode(true);
  writer.SetNameMode(true);
  const Document document(of_parts, parts);
  if (!writer.Transfer(document.get(), STEPControl_AsIs, nullptr, stop->Start())) return false;
  APIHeaderSection_MakeHeader header(writer.ChangeWriter().Model());
  header.SetName(text(path.filename().c_str()));
  header.SetOriginatingSystem(text("bsp2"));
  StepData_StepWriter whole(writer.ChangeWriter().Model());
  return print(path, whole, Handle(StepData_Protocol)::DownCast(writer.ChangeWriter().WS()->Protocol()));
}

bool write_iges(const fs::path& path, const PartShapes& of_parts, const CadParts& parts,
                const Handle(Stop) & stop) {
  IGESControl_Controller::Init();
  Interface_Static::SetIVal("write.iges.brep.mode", 1);
  Interface_Static::SetCVal("write.iges.unit", "MM");
  IGESCAFControl_Writer writer;
  writer.SetColorMode(true);
  writer.SetNameMode(true);
  const Document document(of_parts, parts);
  if (!writer.Transfer(document.get(), stop->Start())) return false;
  writer.ComputeModel();
  IGESData_GlobalSection& header = writer.Model()->ChangeGlobalSection();
  header.SetFileName(text(path.filename().c_str()));
  header.SetAuthorName(text("bsp2"));  // not the user's login
  header.SetCompanyName(text("bsp2"));
  if (writer.Model()->NbEntities() == 0) return false;
  IGESData_IGESWriter whole(writer.Model());
  return print(path, whole, IGESSelect_WorkLibrary::DefineProtocol());
}

bool write_brep(const fs::path& path, const PartShapes& of_parts, const Handle(Stop) & stop) {
  TopoDS_Compound all;
  BRep_Builder builder;
  builder.MakeCompound(all);
  for (const auto& [part, shape] : of_parts) builder.Add(all, shape);
  return BRepTools::Write(all, path.c_str(), stop->Start());
}

CadRemarks write(const fs::path& path, CadFormat format, const geometry::Brep& brep,
                 std::span<const geometry::RoundSolid> round_solids, const CadParts& parts,
                 bool (*is_over)()) {
  static std::mutex one_at_a_time;  // Open CASCADE's settings and documents are those of the process
  const std::lock_guard lock(one_at_a_time);
  try {
    silence();
    const RoundShapes rounds = round_shapes(brep, round_solids);
    const Shapes shapes = shapes_of(brep, rounds.others, is_over);
    CadRemarks remarks{false, shapes.short_edges, shapes.thin_solids, rounds.solids.size()};
    if (is_over()) return remarks;
    const PartShapes of_parts = parts_of(brep, shapes, rounds);
    const Handle(Stop) stop = new Stop(is_over);
    switch (format) {
      case CadFormat::step:
        remarks.is_written = write_step(path, of_parts, parts, stop);
        break;
      case CadFormat::iges:
        remarks.is_written = write_iges(path, of_parts, parts, stop);
        break;
      case CadFormat::brep:
        remarks.is_written = write_brep(path, of_parts, stop);
        break;
    }
    return remarks;
  } catch (const Standard_OutOfMemory&) {
    throw std::bad_alloc();
  } catch (const Standard_Failure& failure) {
    throw Error(std::string("Open CASCADE cannot make the shapes: ") + failure.GetMessageString());
  }
}

}  // namespace
}  // namespace bsp2::io

BSP2_DEFINE_MODULE(bsp2::io::OcctModule, &bsp2::io::write)
