#include "readers/cad_document.hpp"

#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <IGESCAFControl_Reader.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <ShapeExtend_MsgRegistrator.hxx>
#include <ShapeFix_Face.hxx>
#include <ShapeFix_Shape.hxx>
#include <ShapeFix_Shell.hxx>
#include <ShapeFix_Solid.hxx>
#include <ShapeFix_Wire.hxx>
#include <ShapeProcess_ShapeContext.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSAlgo.hxx>
#include <XSAlgo_AlgoContainer.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "import/part_names.hpp"

namespace bsp2::model {
namespace {

using Colour = std::optional<Quantity_ColorRGBA>;

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// Keeps the first complaint of a reader.
class Complaints final : public Message_Printer {
  DEFINE_STANDARD_RTTI_INLINE(Complaints, Message_Printer)
 public:
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  void send(const TCollection_AsciiString& text, const Message_Gravity gravity) const override {
    if (gravity >= Message_Fail && first_.empty()) first_ = printable_name(text.ToCString());
  }
  mutable std::string first_;
};

/// Solids, and faces that are of none, from the labels of a document or from a shape.
class Collector {
 public:
  explicit Collector(const Handle(TDocStd_Document) & document)
      : shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
        colours_(XCAFDoc_DocumentTool::ColorTool(document->Main())) {}
  Collector() = default;

  void add_document() {
    TDF_LabelSequence roots;
    shapes_->GetFreeShapes(roots);
    for (int i = 1; i <= roots.Length(); ++i) visit(roots.Value(i), TopLoc_Location(), {}, 0);
  }

  /// A shape without names: each solid is a part.
  void add_shape(const TopoDS_Shape& shape) {
    std::vector<TopoDS_Shape> solids;
    for (TopExp_Explorer solid(shape, TopAbs_SOLID); solid.More(); solid.Next())
      solids.push_back(solid.Current());
    for (std::size_t i = 0; i < solids.size(); ++i)
      add_part(solids.size() > 1 ? "solid " + std::to_string(i + 1) : "", {}, {solids[i]});
    add_loose(shape, TopLoc_Location(), {}, {});
  }

  CadDocument finished() {
    sew_loose();
    if (faces_of_many_colours_ > 0)
      document_.notes.push_back(counted(faces_of_many_colours_,
                                        "# solid[s] [has|have] faces of several colours; a part has one "
                                        "colour, and gets that of most of its faces"));
    if (curves_ > 0)
      document_.notes.push_back(
          counted(curves_, "# curve[s] that [bounds|bound] no face [is|are] passed over"));
    return std::move(document_);
  }

  CadDocument& document() { return document_; }

 private:
  static constexpr std::size_t most_instances = 1'000'000, most_depth = 1000;

  CadDocument document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
  PartNames names_;
  struct LooseFace {
    std::string name;
    Colour colour;
    TopoDS_Shape shape;
  };
  std::vector<LooseFace> loose_;
  std::size_t instances_ = 0, faces_of_many_colours_ = 0, curves_ = 0;

  static std::string name_of(const TDF_Label& label) {
    Handle(TDataStd_Name) name;
    if (!label.FindAttribute(TDataStd_Name::GetID(), name)) return {};
    const TCollection_ExtendedString& text = name->Get();
    std::string bytes(static_cast<std::size_t>(text.LengthOfCString()) + 1, '\0');
    Standard_PCharacter to = bytes.data();
    text.ToUTF8CString(to);
    return printable_name(bytes.c_str());
  }

  [[nodiscard]] Colour colour_of(const TDF_Label& label) const {
    Quantity_ColorRGBA colour;
    for (const XCAFDoc_ColorType type : {XCAFDoc_ColorSurf, XCAFDoc_ColorGen})
      if (colours_->GetColor(label, type, colour)) return colour;
    return std::nullopt;
  }

  /// @param above the colour of what it is a component of.
  void visit(const TDF_Label& label, const TopLoc_Location& place, const Colour& above, std::size_t depth) {
    if (++instances_ > most_instances || depth > most_depth)
      throw Error("its assemblies have more than " + std::to_string(most_instances) + " components");
    const Colour own = colour_of(label);
    if (XCAFDoc_ShapeTool::IsReference(label)) {
      TDF_Label referred;
      if (XCAFDoc_ShapeTool::GetReferredShape(label, referred))
        visit(referred, place * XCAFDoc_ShapeTool::GetLocation(label), own ? own : above, depth + 1);
      return;
    }
    if (XCAFDoc_ShapeTool::IsAssembly(label)) {
      TDF_LabelSequence components;
      XCAFDoc_ShapeTool::GetComponents(label, components);
      for (int i = 1; i <= components.Length(); ++i)
        visit(components.Value(i), place, own ? own : above, depth + 1);
      return;
    }
    add_product(label, place, own ? own : above);
  }

  /// What the shapes within that of a label have by themselves.
  struct Details {
    TopTools_DataMapOfShapeInteger number;  // without the place of the label's shape
    std::vector<std::pair<std::string, Colour>> of;

    [[nodiscard]] const std::pair<std::string, Colour>* find(const TopoDS_Shape& shape) const {
      const int* found = number.Seek(shape);
      return found == nullptr ? nullptr : &of[static_cast<std::size_t>(*found)];
    }
  };

  [[nodiscard]] Details details_of(const TDF_Label& label) const {
    Details details;
    TDF_LabelSequence within;
    XCAFDoc_ShapeTool::GetSubShapes(label, within);
    for (int i = 1; i <= within.Length(); ++i) {
      details.number.Bind(XCAFDoc_ShapeTool::GetShape(within.Value(i)), static_cast<int>(details.of.size()));
      details.of.emplace_back(name_of(within.Value(i)), colour_of(within.Value(i)));
    }
    return details;
  }

  /// The colour of a solid: its own, or that of most of its faces, unless those have none.
  Colour colour_within(const Details& details, const TopoDS_Shape& solid, const Colour& otherwise) {
    const auto key = [](const Quantity_ColorRGBA& colour) {
      const Quantity_Color& rgb = colour.GetRGB();
      return std::array<double, 4>{rgb.Red(), rgb.Green(), rgb.Blue(), colour.Alpha()};
    };
    Colour all = otherwise;
    for (const TopAbs_ShapeEnum kind : {TopAbs_SOLID, TopAbs_SHELL})
      for (TopExp_Explorer at(solid, kind); at.More(); at.Next())
        if (const auto* detail = details.find(at.Current()); detail != nullptr && detail->second)
          all = detail->second;
    std::map<std::array<double, 4>, std::pair<std::size_t, Colour>> times;
    for (TopExp_Explorer face(solid, TopAbs_FACE); face.More(); face.Next()) {
      const auto* detail = details.find(face.Current());
      const Colour colour = detail != nullptr && detail->second ? detail->second : all;
      auto& [count, which] = times[colour ? key(*colour) : std::array<double, 4>{-1, 0, 0, 0}];
      ++count;
      which = colour;
    }
    if (times.empty()) return all;
    if (times.size() > 1) ++faces_of_many_colours_;
    return std::max_element(times.begin(), times.end(),
                            [](const auto& a, const auto& b) { return a.second.first < b.second.first; })
        ->second.second;
  }

  /// All solids of a product are one part, but for those that have a name or a colour of their own.
  void add_product(const TDF_Label& label, const TopLoc_Location& place, const Colour& colour) {
    const std::string product = name_of(label);
    const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(label);
    if (shape.IsNull()) return;
    const Details details = details_of(label);
    struct Group {
      std::string name;
      Colour colour;
      std::vector<TopoDS_Shape> solids;
    };
    std::vector<Group> groups;
    for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next()) {
      const auto* detail = details.find(at.Current());
      const std::string own = detail != nullptr ? detail->first : "";
      const Colour of_solid = colour_within(details, at.Current(), colour);
      auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& each) {
        return each.name == own && each.colour.has_value() == of_solid.has_value() &&
               (!of_solid || each.colour->IsEqual(*of_solid));
      });
      if (group == groups.end()) group = groups.insert(group, {own, of_solid, {}});
      group->solids.push_back(at.Current().Moved(place));
    }
    for (Group& group : groups) {
      const bool is_own = groups.size() > 1 && !group.name.empty() && group.name != product;
      add_part(!is_own           ? product
               : product.empty() ? group.name
                                 : product + " " + group.name,
               group.colour, group.solids);
    }
    add_loose(shape, place, product, colour);
  }

  void add_part(const std::string& name, const Colour& colour, const std::vector<TopoDS_Shape>& solids) {
    TopoDS_Shape shape = solids.front();
    if (solids.size() > 1) {
      TopoDS_Compound all;
      BRep_Builder builder;
      builder.MakeCompound(all);
      for (const TopoDS_Shape& solid : solids) builder.Add(all, solid);
      shape = all;
    }
    document_.parts.push_back({names_.once(name), colour, shape});
  }

  void add_loose(const TopoDS_Shape& shape, const TopLoc_Location& place, const std::string& name,
                 const Colour& colour) {
    for (TopExp_Explorer face(shape, TopAbs_FACE, TopAbs_SOLID); face.More(); face.Next())
      loose_.push_back({name, colour, face.Current().Moved(place)});
    for (TopExp_Explorer edge(shape, TopAbs_EDGE, TopAbs_FACE); edge.More(); edge.Next()) ++curves_;
  }

  /// Whether each edge of a face is between two faces, or two sides of itself.
  static bool is_complete(const TopoDS_Face& face,
                          const TopTools_IndexedDataMapOfShapeListOfShape& faces_at) {
    for (TopExp_Explorer at(face, TopAbs_EDGE); at.More(); at.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(at.Current());
      if (!BRep_Tool::Degenerated(edge) && !BRep_Tool::IsClosed(edge, face) &&
          faces_at.FindFromKey(edge).Extent() < 2)
        return false;
    }
    return true;
  }

  /// Faces that belong to no solid: as those of IGES files of surfaces. Those with open edges are sewn, as
  /// tightly as closes them.
  void sew_loose() {
    if (loose_.empty()) return;
    TopTools_IndexedDataMapOfShapeListOfShape faces_at;
    for (const LooseFace& face : loose_)
      TopExp::MapShapesAndAncestors(face.shape, TopAbs_EDGE, TopAbs_FACE, faces_at);
    std::vector<TopoDS_Shape> whole, open;
    for (const LooseFace& face : loose_)
      (is_complete(TopoDS::Face(face.shape), faces_at) ? whole : open).push_back(face.shape);
    std::ostringstream note;
    note << counted(loose_.size(),
                    "# face[s] [belongs|belong] to no solid; what [it encloses|they enclose] is a part");
    if (const TopoDS_Shape sewn = sewn_shape(open, note); !sewn.IsNull()) whole.push_back(sewn);
    document_.notes.push_back(note.str());
    if (whole.empty()) return;
    const bool is_one_name = std::all_of(loose_.begin(), loose_.end(), [&](const LooseFace& face) {
      return face.name == loose_.front().name;
    });
    const bool is_one_colour = std::all_of(loose_.begin(), loose_.end(), [&](const LooseFace& face) {
      return face.colour.has_value() == loose_.front().colour.has_value() &&
             (!face.colour || face.colour->IsEqual(*loose_.front().colour));
    });
    std::string name = is_one_name ? loose_.front().name : "";
    if (name.empty() && !document_.parts.empty()) name = "surfaces";
    add_part(name, is_one_colour ? loose_.front().colour : std::nullopt, whole);
  }

  /// @param note is told the tolerance.
  static TopoDS_Shape sewn_shape(const std::vector<TopoDS_Shape>& faces, std::ostringstream& note) {
    TopoDS_Shape best;
    int fewest = -1;
    double tolerance = 0;
    for (const double attempt : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
      if (faces.empty() || fewest == 0) break;
      BRepBuilderAPI_Sewing sewing(attempt);
      for (const TopoDS_Shape& face : faces) sewing.Add(face);
      sewing.Perform();
      if (sewing.SewedShape().IsNull() || (fewest >= 0 && sewing.NbFreeEdges() >= fewest)) continue;
      best = sewing.SewedShape();
      fewest = sewing.NbFreeEdges();
      tolerance = attempt;
    }
    if (!best.IsNull()) note << "; sewn at their edges, with a tolerance of " << tolerance;
    return best;
  }
};

/// What Open CASCADE does to shapes that it has read, but for the faces of a shell, which it would turn
/// towards one side in a time that grows with the square of their number: closing the mesh turns them in no
/// time.
class QuickFixes final : public XSAlgo_AlgoContainer {
  DEFINE_STANDARD_RTTI_INLINE(QuickFixes, XSAlgo_AlgoContainer)
 public:
  TopoDS_Shape ProcessShape(const TopoDS_Shape& shape, const Standard_Real precision,
                            const Standard_Real most_tolerance, const Standard_CString,
                            const Standard_CString, Handle(Standard_Transient) & info,
                            const Message_ProgressRange&, const Standard_Boolean) const override {
    if (shape.IsNull()) return shape;
    const Handle(ShapeProcess_ShapeContext) context = new ShapeProcess_ShapeContext(shape, "");
    context->SetDetalisation(TopAbs_EDGE);
    info = context;
    const Handle(ShapeExtend_MsgRegistrator) messages = new ShapeExtend_MsgRegistrator();
    const Handle(ShapeFix_Shape) fix = new ShapeFix_Shape(shape);
    fix->SetMsgRegistrator(messages);
    fix->SetPrecision(precision);
    fix->SetMaxTolerance(most_tolerance);
    fix->FixFaceTool()->FixWireTool()->FixSameParameterMode() = 0;
    fix->FixSolidTool()->CreateOpenSolidMode() = false;
    fix->FixSolidTool()->FixShellTool()->FixOrientationMode() = 0;
    fix->FixShellTool()->FixOrientationMode() = 0;
    try {
      fix->Perform();
    } catch (const Standard_OutOfMemory&) {
      throw;
    } catch (const Standard_Failure&) {
      return shape;  // as it is in the file
    }
    if (!fix->Shape().IsNull() && !fix->Shape().IsSame(shape)) {
      context->RecordModification(fix->Context(), messages);
      context->SetResult(fix->Shape());
    }
    return context->Result();
  }
};

/// A document of the application, which would keep it for ever.
Handle(TDocStd_Document) new_document() {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document);
  return document;
}

/// The end of a file: what is cut off is refused before anybody makes half a solid of it.
std::string last_bytes(const std::string& path, std::size_t most) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::size_t>(std::max<std::streamoff>(file.tellg(), 0));
  const std::size_t count = std::min(size, most);
  file.seekg(static_cast<std::streamoff>(size - count));
  std::string bytes(count, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  return bytes;
}

std::string first_bytes(const std::string& path, std::size_t most) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(most, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(most));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// What the model's own check says of single records, as one warning.
void add_checks(const Handle(XSControl_WorkSession) & session, std::vector<std::string>& warnings) {
  const Handle(Interface_InterfaceModel) model = session->Model();
  if (model.IsNull()) return;
  std::size_t count = 0;
  std::string first;
  Interface_CheckIterator checks = session->ModelCheckList();
  for (checks.Start(); checks.More(); checks.Next()) {
    const Handle(Interface_Check)& check = checks.Value();
    if (!check->HasFailed()) continue;
    ++count;
    if (!first.empty()) continue;
    first = printable_name(check->CFail(1));
    if (checks.Number() > 0) {
      const Handle(TCollection_HAsciiString) label = model->StringLabel(model->Value(checks.Number()));
      if (!label.IsNull()) first = label->ToCString() + (": " + first);
    }
  }
  if (count > 0)
    warnings.push_back(counted(count,
                               "# record[s] of the file [is|are] damaged, and what [it tells|they tell] may "
                               "be missing; the first is ") +
                       first);
}

void check_status(IFSelect_ReturnStatus status, const Handle(Complaints) & complaints) {
  if (status == IFSelect_RetDone) return;
  throw Error(complaints->first().empty() ? "it is damaged: Open CASCADE cannot read it"
                                          : "it is damaged: " + complaints->first());
}

CadDocument read_step(const std::string& path, const Handle(Complaints) & complaints) {
  if (first_bytes(path, 4096).find("ISO-10303-21") == std::string::npos)
    throw Error("is no STEP file: it does not begin with ISO-10303-21");
  if (last_bytes(path, 4096).find("END-ISO-10303-21") == std::string::npos)
    throw Error("is cut off: it does not end with END-ISO-10303-21");
  STEPCAFControl_Reader reader;
  reader.SetColorMode(true);
  reader.SetNameMode(true);
  reader.SetLayerMode(false);
  reader.SetPropsMode(false);
  reader.SetGDTMode(false);
  reader.SetMatMode(false);
  reader.SetViewMode(false);
  check_status(reader.ReadFile(path.c_str()), complaints);
  if (!complaints->first().empty()) throw Error("it is damaged: " + complaints->first());
  Handle(TDocStd_Document) document = new_document();
  CadDocument said;
  TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
  reader.ChangeReader().FileUnits(lengths, angles, solid_angles);
  for (int i = 1; i <= lengths.Length(); ++i) {
    const std::string unit = lower(lengths.Value(i).ToCString());
    if (unit.empty() || unit == "millimetre" || unit == "millimeter" || unit == "mm") continue;
    said.notes.push_back("its unit is the " + printable_name(unit) + "; lengths become millimetres");
    break;
  }
  if (!reader.Transfer(document)) throw Error("there is no shape in it that Open CASCADE can read");
  add_checks(reader.ChangeReader().WS(), said.warnings);
  Collector collector(document);
  collector.add_document();
  CadDocument result = collector.finished();
  result.notes.insert(result.notes.begin(), said.notes.begin(), said.notes.end());
  result.warnings.insert(result.warnings.begin(), said.warnings.begin(), said.warnings.end());
  return result;
}

CadDocument read_iges(const std::string& path, const Handle(Complaints) & complaints) {
  const std::string end = last_bytes(path, 4096);
  const std::size_t last = end.find_last_not_of(" \t\r\n");
  const std::size_t line = last == std::string::npos ? 0 : end.rfind('\n', last) + 1;
  if (end.size() <= line + 72 || end[line + 72] != 'T')
    throw Error("is no IGES file, or it is cut off: it does not end with a line of the section T");
  IGESCAFControl_Reader reader;
  reader.SetColorMode(true);
  reader.SetNameMode(true);
  reader.SetLayerMode(false);
  check_status(reader.ReadFile(path.c_str()), complaints);
  CadDocument said;
  const Handle(IGESData_IGESModel) model = Handle(IGESData_IGESModel)::DownCast(reader.WS()->Model());
  if (!model.IsNull() && model->GlobalSection().UnitFlag() != 2) {
    const Handle(TCollection_HAsciiString) unit = model->GlobalSection().UnitName();
    said.notes.push_back("its unit is " +
                         (unit.IsNull() ? std::string("another one") : printable_name(unit->ToCString())) +
                         "; lengths become millimetres");
  }
  Handle(TDocStd_Document) document = new_document();
  if (!reader.Transfer(document)) throw Error("there is no shape in it that Open CASCADE can read");
  add_checks(reader.WS(), said.warnings);
  Collector collector(document);
  collector.add_document();
  CadDocument result = collector.finished();
  result.notes.insert(result.notes.begin(), said.notes.begin(), said.notes.end());
  result.warnings.insert(result.warnings.begin(), said.warnings.begin(), said.warnings.end());
  return result;
}

/// The last line of such a file names its shape: "+1 0".
bool has_brep_end(const std::string& path) {
  std::string end = last_bytes(path, 200);
  end.resize(end.find_last_not_of(" \t\r\n") + 1);
  const std::size_t line = end.find_last_of("\r\n") + 1, space = end.find(' ', line);
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  return space != std::string::npos && (end[line] == '+' || end[line] == '-') &&
         is_number(std::string_view(end).substr(line + 1, space - line - 1)) &&
         is_number(std::string_view(end).substr(space + 1));
}

CadDocument read_brep(const std::string& path) {
  if (first_bytes(path, 4096).find("CASCADE Topology V") == std::string::npos)
    throw Error("is no .brep file of Open CASCADE");
  if (!has_brep_end(path)) throw Error("is cut off: it does not end with the shape that it holds");
  TopoDS_Shape shape;
  const BRep_Builder builder;
  if (!BRepTools::Read(shape, path.c_str(), builder) || shape.IsNull())
    throw Error("is no .brep file of Open CASCADE, or a damaged one");
  Collector collector;
  collector.add_shape(shape);
  return collector.finished();
}

}  // namespace

CadDocument read_cad(const std::string& path) {
  const Handle(Complaints) complaints = new Complaints();
  Message::DefaultMessenger()->ChangePrinters().Clear();
  Message::DefaultMessenger()->AddPrinter(complaints);
  STEPCAFControl_Controller::Init();
  IGESControl_Controller::Init();
  XSAlgo::SetAlgoContainer(new QuickFixes());
  const std::string ending = lower(path.substr(path.find_last_of('.')));
  if (ending == ".brep") return read_brep(path);
  return ending == ".iges" || ending == ".igs" ? read_iges(path, complaints) : read_step(path, complaints);
}

}  // namespace bsp2::model
