#include "bsp2/io/outputs/pvd.hpp"

#include <array>
#include <charconv>
#include <string>
#include <string_view>

#include "bsp2/io/files/file.hpp"
#include "files/xml.hpp"

namespace bsp2::io {

void write_pvd(const std::filesystem::path& pvd,
               std::span<const std::pair<double, std::filesystem::path>> meshes) {
  std::string text = R"(<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1">
  <Collection>
)";
  for (const auto& [time, path] : meshes) {
    std::array<char, 32> digits;
    const std::string_view timestep(digits.data(),
                                    std::to_chars(digits.data(), digits.data() + digits.size(), time).ptr);
    const std::string file = path.lexically_proximate(pvd.parent_path()).string();
    text +=
        "    <DataSet timestep=\"" + std::string(timestep) + R"(" part="0" file=")" + quoted(file) + "\"/>\n";
  }
  write_file(pvd, text + "  </Collection>\n</VTKFile>\n");
}

}  // namespace bsp2::io
