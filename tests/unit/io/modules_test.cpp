// VTK and HDF5 come when they are asked for; what keeps them from coming is told; exceptions come back from
// them.

#include "outputs/modules.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

class Modules : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder_;

  fs::path file(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() / name, std::ios::binary) << content;
    return folder_.path() / name;
  }
};

TEST_F(Modules, AreOneForAllThreads) {
  constexpr std::size_t count = 8;
  std::vector<const void*> found(2 * count);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < count; ++i)
    threads.emplace_back([&, i] {
      found[i] = &vtk_module();
      found[count + i] = &hdf5_module();
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(std::set(found.begin(), found.end()).size(), 2U);
}

TEST_F(Modules, AreTakenFromTheFolderThatIsNamed) {
  EXPECT_EQ(load_module("bsp2-vtk", module_folder(), module_layout), &vtk_module());
  file("bsp2-vtk.so", "no library");
  EXPECT_NE(
      refusal([&] { load_module("bsp2-vtk", folder_.path(), module_layout); }).find(folder_.path().string()),
      std::string::npos);
}

TEST_F(Modules, ThatAreMissingAreNamedWithThePlaceToLookAt) {
  const std::string message = refusal([&] { load_module("bsp2-vtk", folder_.path(), module_layout); });
  EXPECT_TRUE(
      message.starts_with("cannot load bsp2-vtk.so: it is not in '" + folder_.path().string() + "'; "))
      << message;
}

TEST_F(Modules, OfAnotherBuildAreRefused) {
  const std::string message = refusal([] { load_module("bsp2-hdf5", module_folder(), "another"); });
  EXPECT_NE(message.find("another build"), std::string::npos) << message;
  fs::create_symlink("/proc/self/exe", folder_.path() / "bsp2-hdf5.so");  // a program is no module at all
  EXPECT_NE(refusal([&] { load_module("bsp2-hdf5", folder_.path(), module_layout); }), "");
}

/// The dynamic linker would die of a bus error.
TEST_F(Modules, ThatAreCutOffAreRefused) {
  const fs::path path = folder_.path() / "bsp2-vtk.so";
  fs::copy_file(module_folder() / "bsp2-vtk.so", path);
  const auto whole = fs::file_size(path);
  for (const auto length : {whole - 1, whole / 2, std::uintmax_t{5000}, std::uintmax_t{100},
                            std::uintmax_t{10}, std::uintmax_t{0}}) {
    fs::resize_file(path, length);
    const std::string message = refusal([&] { load_module("bsp2-vtk", folder_.path(), module_layout); });
    EXPECT_TRUE(message.starts_with("cannot load '" + path.string() + "': ")) << length << ": " << message;
    if (length >= 100) {
      EXPECT_NE(message.find("cut off: " + grouped(length) + " bytes of " + grouped(whole)),
                std::string::npos)
          << message;
    }
  }
}

TEST_F(Modules, ThrowErrorsThatAreCaughtAsSuch) {
  const fs::path damaged = file("damaged.h5", "\x89HDF\r\n\x1a\n and nothing more");
  EXPECT_NE(refusal([&] { read_snapshot(damaged); }).find("damaged.h5"), std::string::npos);
  EXPECT_NE(refusal([&] { write_snapshot("/proc/none/a.h5", {}); }), "");
  // A full device is noticed by the module.
  EXPECT_NE(refusal([&] {
              vtk_module().write_piece({"/dev/full", "solid.pvtu"}, {}, false, {});
            }).find("solid.pvtu"),
            std::string::npos);
}

/// A type that no module knows.
struct OwnFailure {
  std::vector<int> numbers;
};

TEST_F(Modules, LetExceptionsOfTheirCallersThrough) {
  Snapshot snapshot;
  snapshot.frontier_region = {3};
  snapshot.frontier_tokens = {1};
  snapshot.frontier_open = {1};
  snapshot.frontier_archive = {"archive"};
  const fs::path path = folder_.path() / "a.h5";
  write_snapshot(path, snapshot);
  try {
    read_snapshot(path, SnapshotPart::all, [](std::uint32_t region) -> bool {
      throw OwnFailure{{1, 2, static_cast<int>(region)}};
    });
    FAIL() << "nothing was thrown";
  } catch (const OwnFailure& failure) {
    EXPECT_EQ(failure.numbers, (std::vector{1, 2, 3}));
  }
  EXPECT_EQ(read_snapshot(path).frontier_archive,
            snapshot.frontier_archive);  // and HDF5 is as good as before
}

}  // namespace
}  // namespace bsp2::io
