#include "bsp2/io/files/file.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;

class File : public ::testing::Test {
 protected:
  static std::string content(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator());
  }
  samples::TemporaryFolder folder;
};

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST_F(File, IsReplacedAsAWhole) {
  const fs::path path = folder.path() / "a.txt";
  write_file(path, "first");
  write_file(path, "2");
  EXPECT_EQ(content(path), "2");
  EXPECT_EQ(entries(), 1);
}

TEST_F(File, FollowsLinksAndKeepsDevices) {
  const fs::path real = folder.path() / "real", link = folder.path() / "link",
                 device = folder.path() / "device";
  write_file(real, "old");
  fs::create_symlink("real", link);
  write_file(link, "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(content(real), "new");
  fs::create_symlink("/dev/null", device);
  write_file(device, "lost");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(File, IsMadeWhereALinkLeads) {
  const fs::path link = folder.path() / "link";
  fs::create_directory(folder.path() / "deep");
  fs::create_symlink("deep/middle", link);
  fs::create_symlink("real", folder.path() / "deep" / "middle");
  write_file(link, "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_TRUE(fs::is_symlink(folder.path() / "deep" / "middle"));
  EXPECT_EQ(content(folder.path() / "deep" / "real"), "new");
}

TEST_F(File, KeepsItsPermissions) {
  const fs::path path = folder.path() / "private";
  write_file(path, "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  write_file(path, "new");
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(File, FailsWithThePathAndLeavesNothing) {
  const auto full = message_of([] { write_file("/dev/full", "x"); });
  EXPECT_NE(full.find("'/dev/full': No space left"), std::string::npos) << full;
  const auto missing = message_of([&] { write_file(folder.path() / "no" / "a", "x"); });
  EXPECT_NE(missing.find("/no/a': No such file"), std::string::npos) << missing;
  const auto directory = message_of([&] { write_file(folder.path(), "x"); });
  EXPECT_NE(directory.find("it is a directory"), std::string::npos) << directory;
  EXPECT_EQ(entries(), 0);
}

TEST_F(File, DirectoriesAreMadeButNotOverFiles) {
  const fs::path deep = folder.path() / "a" / "b";
  check_folder(deep);
  EXPECT_EQ(entries(), 0);
  make_folder(deep);
  make_folder(deep);
  EXPECT_TRUE(fs::is_directory(deep));
  write_file(deep / "file", "x");
  for (const fs::path& bad : {deep / "file", deep / "file" / "below"}) {
    EXPECT_NE(message_of([&] { check_folder(bad); }).find("is a file"), std::string::npos);
    EXPECT_NE(message_of([&] { make_folder(bad); }), "");
  }
}

/// Rights alone would allow it, at least to root.
TEST_F(File, ChecksAFolderByWritingThere) {
  const auto message = message_of([] { check_folder("/proc/bsp2_output"); });
  EXPECT_TRUE(message.starts_with("cannot make the folder '/proc/bsp2_output': ")) << message;
  check_folder(folder.path());
  EXPECT_EQ(entries(), 0);
}

TEST_F(File, TemporaryDirectoryVanishesWithItsContent) {
  {
    const TemporaryDirectory scratch(folder.path());
    write_file(scratch.path() / "x", "y");
    EXPECT_EQ(entries(), 1);
  }
  EXPECT_EQ(entries(), 0);
  EXPECT_THROW(TemporaryDirectory(folder.path() / "missing"), Error);
}

/// What a process left that was killed goes with the next one; what belongs to a living one, or is not ours,
/// stays.
TEST_F(File, TemporaryDirectoriesOfTheDeadAreRemoved) {
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
  const TemporaryDirectory alive(folder.path());
  fs::last_write_time(alive.path(), long_ago);
  fs::create_directory(folder.path() / ".bsp2-stranger");
  fs::last_write_time(folder.path() / ".bsp2-stranger", long_ago);
  const pid_t child = fork();
  if (child == 0) {
    const TemporaryDirectory scratch(folder.path());
    write_file(scratch.path() / "x", "y");
    fs::last_write_time(scratch.path(), long_ago);
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  ASSERT_EQ(entries(), 3);
  { const TemporaryDirectory next(folder.path()); }
  EXPECT_EQ(entries(), 2);
  EXPECT_TRUE(fs::exists(alive.path()));
}

}  // namespace
}  // namespace bsp2::io
