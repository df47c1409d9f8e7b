// bsp2-read-cad: reads files for CAD programs for the model.
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <new>
#include <sstream>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "readers/cad_document.hpp"
#include "readers/cad_mesh.hpp"
#include "readers/reader_main.hpp"

namespace bsp2::model {
namespace {

std::string short_text(double x) {
  std::ostringstream text;
  text.precision(3);
  text << x;
  return text.str();
}

std::string lost_text(std::size_t lost, std::size_t faces) {
  return counted(lost, "# of ") + counted(faces, "# face[s] could not be cut into triangles, and ") +
         counted(lost, "[is|are] missing");
}

void tell(const CadDocument& document, const ReadRequest& request, PartsWriter& parts) {
  std::size_t faces = 0, lost = 0;
  double deviation = 0;
  for (const CadPart& part : document.parts) {
    const CadMesh mesh = mesh_of(part.shape, request);
    faces += mesh.faces;
    lost += mesh.faces_lost;
    deviation = std::max(deviation, mesh.deviation);
    std::array<double, 4> colour{};
    if (part.colour) {
      part.colour->GetRGB().Values(colour[0], colour[1], colour[2], Quantity_TOC_sRGB);
      colour[3] = part.colour->Alpha();
      for (double& channel : colour) channel = std::round(std::clamp(channel, 0.0, 1.0) * 255) / 255;
    }
    parts.part(part.name, part.colour ? &colour : nullptr, mesh.points, mesh.triangles);
  }
  for (const std::string& text : document.warnings) parts.text(PartsStream::Record::warning, text);
  if (lost > 0) parts.text(PartsStream::Record::warning, lost_text(lost, faces));
  if (deviation > 1e-7)
    parts.text(PartsStream::Record::warning,
               "its curved faces are triangles here, up to " + short_text(deviation) +
                   " away from them; a `deflection` in import(), as 0.01, or $fn, or smaller $fa and $fs "
                   "bring them nearer");
  for (const std::string& text : document.notes) parts.text(PartsStream::Record::note, text);
}

void read(const ReadRequest& request, PartsWriter& parts) {
  try {
    const CadDocument document = read_cad(request.path);
    file_is_read();
    tell(document, request, parts);
  } catch (const Standard_OutOfMemory&) {
    throw std::bad_alloc();
  } catch (const Standard_Failure& failure) {
    throw Error(std::string("Open CASCADE cannot read it: ") + failure.GetMessageString());
  }
}

}  // namespace
}  // namespace bsp2::model

// What is thrown before it listens ends it, which bsp2 tells of.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) { return bsp2::model::read_for_model(argc, argv, &bsp2::model::read); }
