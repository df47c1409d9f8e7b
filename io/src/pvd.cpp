#include "bsp2/io/pvd.hpp"

#include <vtkNew.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include <sstream>

#include "bsp2/io/file.hpp"

namespace bsp2::io {

void write_pvd(const std::filesystem::path& pvd, std::span<const std::pair<double, std::filesystem::path>> meshes) {
  vtkNew<vtkXMLDataElement> file, collection;
  file->SetName("VTKFile");
  file->SetAttribute("type", "Collection");
  file->SetAttribute("version", "0.1");
  collection->SetName("Collection");
  file->AddNestedElement(collection);
  for (const auto& [time, path] : meshes) {
    vtkNew<vtkXMLDataElement> mesh;
    mesh->SetName("DataSet");
    mesh->SetDoubleAttribute("timestep", time);
    mesh->SetIntAttribute("part", 0);
    mesh->SetAttribute("file", path.lexically_proximate(pvd.parent_path()).c_str());
    collection->AddNestedElement(mesh);
  }
  std::ostringstream text;
  text << "<?xml version=\"1.0\"?>\n";
  vtkIndent indent;
  vtkXMLUtilities::FlattenElement(file, text, &indent);
  write_file(pvd, text.str());
}

}  // namespace bsp2::io
