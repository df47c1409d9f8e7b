#include "bsp2/model/msh/size_field.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/msh/msh_file.hpp"
#include "import/reader_process.hpp"

namespace bsp2::model {
namespace {

using Row = std::array<double, 4>;

/// Four numbers and nothing else.
std::optional<Row> row_of(const std::string& line) {
  std::istringstream words(line);
  Row row;
  for (double& x : row)
    if (!(words >> x) || !std::isfinite(x)) return std::nullopt;
  std::string more;
  return words >> more ? std::nullopt : std::optional(row);
}

std::vector<Row> read_lines(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error("cannot read '" + path.string() + "'");
  std::vector<Row> rows;
  std::size_t number = 0, filled = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line.resize(std::min(line.find('#'), line.size()));
    std::replace(line.begin(), line.end(), ',', ' ');
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos) continue;
    constexpr std::string_view of_numbers = "+-.0123456789";
    const bool may_be_heading = ++filled == 1 && of_numbers.find(line[first]) == std::string_view::npos;
    const auto row = row_of(line);
    if (row && row->back() > 0)
      rows.push_back(*row);
    else if (row || !may_be_heading)
      throw Error(path.string() + ":" + std::to_string(number) +
                  ": a line is x y z and a length above 0, not '" + line + "'");
  }
  if (rows.empty()) throw Error(path.string() + ": no line has x y z and a length");
  return rows;
}

std::vector<Row> read_mesh(const std::filesystem::path& path, bool is_vtu) {
  auto rows = is_vtu ? parts_by_program("bsp2-read-vtk", "VTK", path, {}).sizes : read_msh(path, true).data;
  if (rows.empty())
    throw Error(path.string() +
                (is_vtu ? ": there are no sizes in it"
                        : ": there are no sizes in it: $NodeData or $ElementData of one number each"));
  for (const Row& row : rows)
    if (!std::isfinite(row[0] + row[1] + row[2]) || !std::isfinite(row[3]) || !(row[3] > 0)) {
      std::ostringstream text;
      text << path.string() << ": at (" << row[0] << ", " << row[1] << ", " << row[2] << ") the size is "
           << row[3] << "; it must be a length above 0";
      throw Error(text.str());
    }
  return rows;
}

}  // namespace

std::vector<Row> read_size_field(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".vtu" || ending == ".msh" ? read_mesh(path, ending == ".vtu") : read_lines(path);
}

}  // namespace bsp2::model
