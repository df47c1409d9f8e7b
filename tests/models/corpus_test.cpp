// Real models, with what mesh kernels found out about them.

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <optional>
#include <sstream>

#include "bsp2/model/expression/csg.hpp"
#include "models.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

struct Entry {
  std::string file, status, kernels, histogram;
  int level = 0, dimension = 3;
  double content = 0, reach = 0;      // volume or area; the largest coordinate
  std::array<double, 2> by_kernel{};  // the same by CGAL and by Manifold
  std::vector<double> bounds;         // xmin ymin zmin xmax ymax zmax
  [[nodiscard]] bool is_hard() const { return status == "ok" && kernels == "agree"; }
  /// Whether curves are made of chords in ways that kernels differ about, or coordinates come in six digits.
  [[nodiscard]] bool is_rounded() const {
    for (const char* node : {"text:", "offset:", "@twist:", "minkowski:", "import:"})
      if (histogram.find(node) != std::string::npos) return true;
    return false;
  }
};

std::vector<Entry> entries() {
  std::vector<Entry> all;
  std::ifstream manifest(shared() / "corpus" / "csg" / "manifest.tsv");
  std::string line;
  std::map<std::string, std::size_t> column;
  while (std::getline(manifest, line)) {
    std::vector<std::string> words;
    std::istringstream stream(line);
    for (std::string word; std::getline(stream, word, '\t');) words.push_back(word);
    words.resize(40);
    if (column.empty()) {
      for (std::size_t i = 0; i < words.size(); ++i)
        if (!words[i].empty()) column[words[i]] = i;
      continue;
    }
    const auto number = [&](const char* name) { return std::strtod(words[column[name]].c_str(), nullptr); };
    Entry entry{words[column["file"]], words[column["status"]], words[column["kernels"]],
                words[column["histogram"]]};
    entry.level = static_cast<int>(number("level"));
    entry.dimension = static_cast<int>(number("dim"));
    entry.content = number(entry.dimension == 2 ? "area" : "volume");
    const std::string content = entry.dimension == 2 ? "area" : "volume";
    entry.by_kernel = {number(("cgal_" + content).c_str()), number(("manifold_" + content).c_str())};
    for (const char* name : {"xmin", "ymin", "zmin", "xmax", "ymax", "zmax"}) {
      entry.bounds.push_back(number(name));
      entry.reach = std::max(entry.reach, std::fabs(entry.bounds.back()));
    }
    all.push_back(entry);
  }
  return all;
}

/// A coordinate as the files have it from which the references were measured: single precision, six digits.
double as_stl_text(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", static_cast<double>(static_cast<float>(x)));
  return std::strtod(text.data(), nullptr);
}

/// The volume (D = 2: area) of the boundary if its coordinates are rounded like that. A plane model is given
/// the height 1.
std::optional<double> content_as_text(const Entry& entry) {
  const auto source = shared() / "corpus" / "csg" / entry.file;
  const samples::TemporaryFolder folder;
  supersteps::RunOptions options;
  options.model = source;
  options.boundary = true;
  if (entry.dimension == 2) {
    options.model = folder.path() / "model.csg";
    std::ofstream(options.model) << "linear_extrude(height = 1) {" << std::ifstream(source).rdbuf() << "}";
  }
  auto boundary = supersteps::run(options).boundary;
  if (!boundary || !boundary->is_closed()) return std::nullopt;
  for (auto& point : boundary->points)
    for (double& x : point) x = as_stl_text(x);
  return boundary->volume();
}

/// Where the last digits of the coordinates in which the references were written tell two solids apart, ours
/// is compared as it would have been written: with the reference of one of the two kernels, which may be
/// further from each other.
void expect_content(const Entry& entry, double content) {
  const double limit = entry.is_rounded() ? 1e-4 : 1e-6;
  if (std::fabs(content - entry.content) <= limit * entry.content) return;
  const auto as_text = content_as_text(entry);
  ASSERT_TRUE(as_text.has_value()) << "there is no closed boundary";
  const auto error = [&](double reference) { return std::fabs(*as_text - reference) / entry.content; };
  EXPECT_LE(std::min(error(entry.by_kernel[0]), error(entry.by_kernel[1])), limit)
      << content << ", as text " << *as_text;
}

TEST(Corpus, VolumesOfFilesWithoutTwoDimensionalNodes) {
  if (shared().empty()) GTEST_SKIP() << "no corpus at hand";
  const auto all = entries();
  if (all.empty()) GTEST_SKIP() << "no manifest at hand";
  std::size_t checked = 0;
  for (const Entry& entry : all) {
    if (entry.level != 0) continue;
    SCOPED_TRACE(entry.file);
    const auto report = run_file(shared() / "corpus" / "csg" / entry.file);
    EXPECT_EQ(report.fuzzy_cells, 0U);
    EXPECT_TRUE(entry.status != "empty" || report.in_cells == 0);
    if (entry.status != "ok" || entry.kernels != "agree") continue;
    if (entry.file.starts_with("dotscad__seashell")) continue;  // below
    expect_content(entry, report.in_volume);
    ++checked;
  }
  EXPECT_GT(checked, 50U);
}

/// Those whose reference two mesh kernels agree on; tests/models/corpus_table prints all others, too.
TEST(Corpus, ContentAndBoundsOfFilesWithAllNodes) {
  if (shared().empty()) GTEST_SKIP() << "no corpus at hand";
  std::size_t checked = 0;
  for (const Entry& entry : entries()) {
    if (entry.level == 0 || !entry.is_hard()) continue;
    SCOPED_TRACE(entry.file);
    const auto report = run_file(shared() / "corpus" / "csg" / entry.file);
    EXPECT_EQ(report.dimension, entry.dimension);
    EXPECT_EQ(report.fuzzy_cells, 0U);
    expect_content(entry, report.in_volume);
    ASSERT_EQ(report.lower.size(), static_cast<std::size_t>(entry.dimension));
    for (std::size_t i = 0; i < report.lower.size(); ++i) {
      EXPECT_NEAR(report.lower[i], entry.bounds[i], 1e-5 * entry.reach);
      EXPECT_NEAR(report.upper[i], entry.bounds[i + 3], 1e-5 * entry.reach);
    }
    ++checked;
  }
  EXPECT_GT(checked, 60U);
}

TEST(Corpus, TheTowerOfPisa) {
  const auto file = shared() / "corpus" / "csg" / "pyplasm__pisa.csg";
  if (shared().empty() || !std::filesystem::exists(file)) GTEST_SKIP() << "no corpus at hand";
  // The reference, 7067.46, has a tolerance. Exactly: the sum of its slabs by a mesh kernel of the last digit
  // (docs/corpus.md).
  EXPECT_NEAR(run_file(file, 2, 0).in_volume, 7067.4545447, 1e-10 * 7067);
  EXPECT_NEAR(run_file(file).in_volume, 7067.4545447, 2e-9 * 7067);  // faces that nearly coincide are moved
}

/// The seashell is one mesh that overlaps itself. The manifest has the volume that its faces sum up to, the
/// integral of the winding number; a solid is a set of points, here each counts once. With a box around it
/// that is turned inside out, as part of the same mesh, every winding number is one less, and what the solid
/// leaves out of the box is where it was 1; with two boxes, where it was 2. So volumes of solids as they are
/// evaluated here add up to the manifest's figure.
TEST(Corpus, TheSeashellCountsItsOverlapsOnce) {
  const auto file = shared() / "corpus" / "csg" / "dotscad__seashell-fab4.csg";
  if (shared().empty() || !std::filesystem::exists(file)) GTEST_SKIP() << "no corpus at hand";
  const model::Expression shell = model::read_csg(file).expression;
  const auto parts = dataflow::occurrences(shell);
  ASSERT_EQ(parts.size(), 1U);
  ASSERT_TRUE(std::holds_alternative<model::Primitive>(parts[0].node().value)) << "the file has no maps";
  const auto& mesh = std::get<model::TriangleMesh>(std::get<model::Primitive>(parts[0].node().value));
  /// The volume in which the winding number is `times`.
  const auto wound = [&mesh](int times) {
    std::vector<std::array<double, 3>> points = mesh.points;
    std::vector<std::vector<std::uint32_t>> faces;
    for (const auto& [a, b, c] : mesh.triangles) faces.push_back({c, b, a});  // clockwise seen from outside
    double half = 59;  // of the outermost box, beyond the shell
    for (int k = 0; k < std::abs(times); ++k) {
      half += 1;
      const auto first = static_cast<std::uint32_t>(points.size());
      for (int i = 0; i < 8; ++i)
        points.push_back({i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
      for (const auto& face : {std::array{0U, 1U, 3U, 2U},
                               {4U, 6U, 7U, 5U},
                               {0U, 4U, 5U, 1U},
                               {2U, 3U, 7U, 6U},
                               {0U, 2U, 6U, 4U},
                               {1U, 5U, 7U, 3U}}) {
        std::vector<std::uint32_t> corners;
        for (const std::uint32_t corner : face) corners.push_back(first + corner);
        if (times > 0) std::reverse(corners.begin(), corners.end());
        faces.push_back(corners);
      }
    }
    return 8 * half * half * half - evaluate(model::polyhedron(points, faces)).volume();
  };
  const double all = evaluate(shell).volume();
  double counted = 0, sum = 0;
  for (const int times : {1, 2, 3, 4, 5, 6, 7, 8, -1, -2, -3, -4}) {
    const double volume = wound(times);
    counted += times * volume;
    sum += volume;
  }
  EXPECT_NEAR(counted, 2565.96952, 1e-8 * 2566) << "the manifest's figure";
  const model::Model read = model::read_csg(file);
  const auto overlaps = model::overlaps_of(read, model::read_text(file), file.string()).meshes;
  ASSERT_EQ(overlaps.size(), 1U);
  EXPECT_NEAR(overlaps[0].volume_by_faces.value(), counted, 1e-9 * counted)
      << "what its faces sum up to is what was evaluated";
  EXPECT_NEAR(sum, all, 1e-9 * all);
  EXPECT_NEAR(all, 2457.3736, 1e-3);
}

}  // namespace
}  // namespace bsp2::models
