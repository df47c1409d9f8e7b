#include "answers/point_query.hpp"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "bsp2/error.hpp"
#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

/// Beyond, squares of distances are no doubles any more; models end at 1e40.
constexpr double farthest = 1e150;

constexpr const char* label_names[] = {"OUT", "IN", "FUZZY"};

std::string column(const char* name, int axis, int dimension) {
  return dimension <= 3 ? fmt::format("{}{}", name, "xyz"[axis]) : fmt::format("{}x{}", name, axis + 1);
}

/// Empty where it has none.
std::string name_of(std::int32_t part, const std::vector<std::string>& part_names) {
  return part >= 0 && static_cast<std::size_t>(part) < part_names.size()
             ? part_names[static_cast<std::size_t>(part)]
             : "";
}

void print_table(std::ostream& out, std::span<const double> points, const Locations& answers, std::size_t d,
                 const std::vector<std::string>& part_names) {
  const int dimension = static_cast<int>(d);
  std::string text;
  for (int axis = 0; axis < dimension; ++axis) text += column("", axis, dimension) + "\t";
  text += "label\tprimitive\tpart\tdistance";
  for (int axis = 0; axis < dimension; ++axis) text += "\t" + column("nearest_", axis, dimension);
  if (!part_names.empty()) text += "\tname";
  out << text << '\n';
  for (std::size_t i = 0; i < answers.labels.size(); ++i) {
    text.clear();
    for (std::size_t axis = 0; axis < d; ++axis) text += fmt::format("{}\t", points[i * d + axis]);
    text += fmt::format("{}\t{}\t{}\t{}", label_names[answers.labels[i]], answers.primitives[i],
                        answers.parts[i], answers.distances[i]);
    for (const double x : std::span(answers.nearest).subspan(i * d, d)) text += fmt::format("\t{}", x);
    if (!part_names.empty()) text += "\t" + name_of(answers.parts[i], part_names);
    out << text << '\n';
  }
}

void print_json(std::ostream& out, std::span<const double> points, const Locations& answers, std::size_t d,
                const std::vector<std::string>& part_names) {
  auto all = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < answers.labels.size(); ++i) {
    const auto point = points.subspan(i * d, d), nearest = std::span(answers.nearest).subspan(i * d, d);
    all.push_back({{"point", std::vector<double>(point.begin(), point.end())},
                   {"label", label_names[answers.labels[i]]},
                   {"primitive", answers.primitives[i]},
                   {"part", answers.parts[i]},
                   {"distance", answers.distances[i]},
                   {"nearest", std::vector<double>(nearest.begin(), nearest.end())}});
    if (!part_names.empty()) all.back()["name"] = name_of(answers.parts[i], part_names);
  }
  out << all.dump(1, ' ') << '\n';
}

}  // namespace

std::vector<double> read_points(std::istream& text, const std::string& name, int dimension) {
  std::vector<double> points;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    line.resize(std::min(line.find('#'), line.size()));
    const std::string whole = line;
    for (char& c : line)
      if (c == ',') c = ' ';
    std::istringstream words(line);
    int count = 0;
    bool good = true, near = true;
    for (std::string word; words >> word; ++count) {
      char* end = nullptr;
      points.push_back(std::strtod(word.c_str(), &end));
      good = good && end == word.c_str() + word.size() && std::isfinite(points.back());
      near = near && std::abs(points.back()) <= farthest;
    }
    if (count == 0 && whole.find(',') == std::string::npos) continue;
    if (!good || count != dimension)
      throw Error(fmt::format("{}:{}: '{}' is no point of dimension {}: {} needed", name, number,
                              whole.substr(0, 60), dimension, counted(dimension, "# number[s] [is|are]")));
    if (!near)
      throw Error(fmt::format("{}:{}: '{}' is too far away: coordinates have to be between {:g} and {:g}",
                              name, number, whole.substr(0, 60), -farthest, farthest));
  }
  return points;
}

std::vector<double> read_points(const std::filesystem::path& path, int dimension) {
  if (path == "-") return read_points(std::cin, "standard input", dimension);
  errno = 0;
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw Error("cannot read '" + path.string() +
                "': " + (errno != 0 ? std::generic_category().message(errno) : "it is a directory"));
  return read_points(file, path.string(), dimension);
}

void print_answers(std::ostream& out, std::span<const double> points, const Locations& answers, int dimension,
                   bool json, const std::vector<std::string>& part_names) {
  if (json)
    print_json(out, points, answers, static_cast<std::size_t>(dimension), part_names);
  else
    print_table(out, points, answers, static_cast<std::size_t>(dimension), part_names);
}

}  // namespace bsp2::jobs
