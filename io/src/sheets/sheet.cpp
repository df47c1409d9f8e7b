#include "bsp2/io/outputs/sheet.hpp"

#include <algorithm>
#include <cctype>

#include "outputs/modules.hpp"
#include "sheets/writers.hpp"
#include "surfaces/labels.hpp"

namespace bsp2::io {

std::optional<SheetFormat> sheet_format(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (ending == ".dxf") return SheetFormat::dxf;
  if (ending == ".pdf") return SheetFormat::pdf;
  if (ending == ".svg") return SheetFormat::svg;
  return std::nullopt;
}

std::string sheet_bytes(const Sheet& given, SheetFormat format) {
  Sheet sheet = given;  // with words that are text
  sheet.title = one_line(sheet.title);
  for (Sheet::Layer& layer : sheet.layers) layer.name = one_line(layer.name);
  for (Sheet::Label& label : sheet.labels) label.text = one_line(label.text);
  switch (format) {
    case SheetFormat::dxf:
      return to_dxf(sheet);
    case SheetFormat::pdf:
      return pdf_module().to_pdf(sheet);
    case SheetFormat::svg:
      break;
  }
  return to_svg(sheet);
}

void check_sheet(SheetFormat format) {
  if (format == SheetFormat::pdf) pdf_module();
}

}  // namespace bsp2::io
