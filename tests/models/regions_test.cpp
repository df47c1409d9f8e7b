// One digest on any number of regions: of whole runs, of such that were interrupted and resumed, of queues of
// jobs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "models.hpp"
#include "support/command.hpp"
#include "support/random_text.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;

class Program {
 public:
  /// What it prints, with an exit code of 0.
  std::string operator()(const std::string& arguments) const {
    return samples::printed(std::string(BSP2_PROGRAM) + " " + arguments);
  }
  [[nodiscard]] std::string digest(const std::string& arguments) const {
    const std::string text = (*this)(arguments);
    const auto at = text.find("digest");
    return at == std::string::npos ? "none: " + text : text.substr(text.find_first_not_of(' ', at + 6), 32);
  }
};

supersteps::RunReport report_of(const fs::path& path, unsigned regions, bool keep_out = false) {
  supersteps::RunOptions options;
  options.model = path;
  options.regions = regions;
  options.threads = 1 + regions % 2;
  options.collect_cells = false;
  options.keep_out = keep_out;
  return supersteps::run(options).report;
}

/// A piece beyond a tangent of a round solid is OUT, though tangents of narrower wedges do not tell.
TEST(RunInRegions, HasTheFuzzyCellsOfOneRegion) {
  const fs::path path = cases() / "curved-regions.csg";
  const auto whole = report_of(path, 1);
  EXPECT_EQ(whole.fuzzy_cells, 13U);
  for (const unsigned regions : {2U, 20U, 200U, 1000U}) {
    SCOPED_TRACE(regions);
    const auto parts = report_of(path, regions);
    EXPECT_GT(parts.regions, 1U);
    EXPECT_EQ(parts.digest, whole.digest);
    EXPECT_EQ(parts.fuzzy_cells, whole.fuzzy_cells);
    EXPECT_EQ(parts.fuzzy_volume, whole.fuzzy_volume);
    EXPECT_EQ(parts.in_volume, whole.in_volume);
    EXPECT_EQ(parts.centroid, whole.centroid);
    EXPECT_EQ(parts.inertia, whole.inertia);
    EXPECT_EQ(parts.inertia_least, whole.inertia_least);
    EXPECT_EQ(parts.inertia_most, whole.inertia_most);
    EXPECT_EQ(report_of(path, regions, true).fuzzy_cells, whole.fuzzy_cells);
  }
}

class ProgramInRegions : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder_;
  std::string model_ = (folder_.path() / "model.csg").string();
  Program bsp2_;

  /// A model, and options that say how far.
  std::string write_model(samples::RandomText& text) const {
    const int dimension = text.pick(2, 4);
    std::ofstream(model_) << text.model(dimension, dimension < 4 ? 2 : 1, 0.6) << "\n";
    if (text.chance(0.3))
      return " --level " + std::to_string(dimension == 2 ? text.pick(5, 20) : text.pick(5, 12));
    const double thin = dimension == 2   ? text.uniform(0.005, 0.1)
                        : dimension == 3 ? text.uniform(0.1, 0.3)
                                         : text.uniform(0.5, 1);
    return " --tolerance " + std::to_string(thin) +
           (text.chance(0.2)   ? " --coincidence 0"
            : text.chance(0.2) ? " --keep in,fuzzy,out"
                               : "");
  }

  template <typename Body>
  void rounds(int count, const Body& body) {
    for (int round = 0; round < samples::rounds(count) && !HasFailure(); ++round) {
      const std::uint64_t seed = dataflow::new_seed();
      samples::RandomText text(seed);
      const std::string options = write_model(text);
      SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed << options);
      body(text, options, bsp2_.digest("run " + model_ + " --regions 1 --threads 1" + options));
    }
  }
};

TEST_F(ProgramInRegions, GoesOnFromAnyInterruption) {
  const std::string snapshot = (folder_.path() / "run.h5").string();
  rounds(4, [&](samples::RandomText& text, const std::string& options, const std::string& expected) {
    for (const int regions : {1, 20, 1000}) {
      SCOPED_TRACE(regions);
      const auto order = [&] { return std::string(" --order ") + (text.chance(0.5) ? "depth" : "priority"); };
      fs::remove(snapshot);
      bsp2_("run " + model_ + " --regions " + std::to_string(regions) + order() + options + " --snapshot " +
            snapshot +
            (text.chance(0.5) ? " --cells " + std::to_string(text.pick(3, 100)) : " --budget 1ms --steps 1"));
      if (text.chance(0.5)) bsp2_("resume " + snapshot + " --budget 1ms --steps 1" + order());
      EXPECT_EQ(bsp2_.digest("resume " + snapshot + " --threads 2"), expected);
    }
  });
}

TEST_F(ProgramInRegions, MergesJobs) {
  const std::string queue = (folder_.path() / "queue").string();
  rounds(2, [&](samples::RandomText& text, const std::string& options, const std::string& expected) {
    for (const int regions : {1, 20}) {
      SCOPED_TRACE(regions);
      fs::remove_all(queue);
      bsp2_("jobs split " + model_ + " " + queue + " --job-seconds 0 --regions " + std::to_string(regions) +
            options);
      bsp2_("jobs run " + queue + " --quiet --cells " + std::to_string(text.pick(50, 300)));
      EXPECT_EQ(bsp2_.digest("jobs merge " + queue), expected);
    }
  });
}

}  // namespace
}  // namespace bsp2::models
