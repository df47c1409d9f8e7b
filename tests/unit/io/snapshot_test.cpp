// Snapshots come back as they were written, and whatever is no whole snapshot is refused.

#include "bsp2/io/outputs/snapshot.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <barrier>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <random>
#include <thread>

#include "bsp2/geometry/support/error.hpp"
#include "files/replacing.hpp"
#include "support/full_disk.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;
using geometry::CellBatch;
using samples::FullDisk;

/// Any bytes in, but with offsets that fit: io does not look into the geometry.
std::shared_ptr<const CellBatch> random_batch(std::mt19937& random, std::size_t cells, std::uint32_t region) {
  auto batch = std::make_shared<CellBatch>();
  const auto number = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  for (std::size_t cell = 0; cell < cells; ++cell) {
    for (int i = 4 + number(6); i > 0; --i)
      for (int axis = 0; axis < 3; ++axis) batch->points.push_back(static_cast<double>(random()) / 7);
    batch->point_offset.push_back(static_cast<std::uint32_t>(batch->points.size() / 3));
    for (int facet = 4 + number(4); facet > 0; --facet) {
      for (int i = 3 + number(4); i > 0; --i)
        batch->facet_vertices.push_back(static_cast<std::uint16_t>(random()));
      batch->facet_vertex_offset.push_back(static_cast<std::uint32_t>(batch->facet_vertices.size()));
      batch->facet_hyperplane.push_back(static_cast<std::int32_t>(random()));
    }
    batch->facet_offset.push_back(static_cast<std::uint32_t>(batch->facet_hyperplane.size()));
    batch->label.push_back(static_cast<geometry::Label>(number(3)));
    batch->primitive.push_back(number(100) - 1);
    batch->part.push_back(number(9) - 1);
    batch->region.push_back(region);
    batch->level.push_back(static_cast<std::uint16_t>(random()));
    batch->volume.push_back(static_cast<double>(random()));
  }
  return batch;
}

std::string random_bytes(std::mt19937& random, std::size_t count) {
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

Snapshot random_snapshot(std::mt19937& random, std::size_t cells) {
  Snapshot s;
  s.head.model = "models/tower \xc3\xa4.csg";
  s.head.source = "cube();\n";
  s.head.coincidence = 1e-7;
  if (random() % 2 == 0) s.head.level = 12;
  s.head.keep_out = random() % 2 == 0;
  s.head.hyperplanes = "123";
  s.head.steps = 7;
  s.head.complete = random() % 2 == 0;
  s.head.in_cells = cells;
  s.head.in_volume = 0.1;
  s.head.digest = "abc";
  s.head.totals = random_bytes(random, 300);
  s.head.partition_root = 0;
  s.head.partition_hyperplane = {17, 1U << 31};
  s.head.partition_children = {1, -1, -2, -3};
  s.head.superstep_name = {"compilation", "computation"};
  s.head.superstep_step = {0, 3};
  s.head.superstep_rank = {0, 0};
  s.head.superstep_seconds = s.head.superstep_work_seconds = s.head.superstep_predicted_seconds = {0.25, 2};
  s.head.superstep_bytes_sent = s.head.superstep_bytes_received = s.head.superstep_cells = {0, 1ULL << 40};
  for (std::uint32_t region = 0; region < random() % 5; ++region) {
    s.frontier_region.push_back(region);
    s.frontier_tokens.push_back(region + 3);
    s.frontier_open.push_back(region);
    s.frontier_archive.push_back(random_bytes(random, random() % 1000));
  }
  std::uint32_t number = 2;
  for (std::size_t left = cells; left > 0; ++number) {  // regions with some cells in some batches
    const std::size_t part = 1 + random() % left, first = random() % (part + 1);
    for (const std::size_t size : {first, part - first})
      if (size > 0) s.cells.push_back(random_batch(random, size, number));
    left -= part;
    const auto count = static_cast<std::uint32_t>(part);
    s.regions.push_back({number, random() % 2 == 0 ? 0 : -1, count, 2, 2});
    s.tree.nodes.insert(s.tree.nodes.end(), {{0, 1, -1}, {1, ~static_cast<std::int32_t>(count), -2}});
    s.tree.ids.insert(s.tree.ids.end(), {static_cast<std::uint32_t>(random() % 100), 12U});
    for (int i = 0; i < 8; ++i) s.tree.hyperplanes.push_back(static_cast<double>(random()));
  }
  return s;
}

/// All batches as one.
template <typename T>
std::vector<T> all(const Snapshot& s, std::vector<T> CellBatch::*member) {
  std::vector<T> values;
  for (const auto& batch : s.cells)
    values.insert(values.end(), ((*batch).*member).begin(), ((*batch).*member).end());
  return values;
}
/// Sizes of the parts of all cells, from offsets that begin anew in each batch.
std::vector<std::uint32_t> sizes(const Snapshot& s, std::vector<std::uint32_t> CellBatch::*member) {
  std::vector<std::uint32_t> values;
  for (const auto& batch : s.cells)
    for (std::size_t i = 1; i < ((*batch).*member).size(); ++i)
      values.push_back(((*batch).*member)[i] - ((*batch).*member)[i - 1]);
  return values;
}

void expect_equal(const Snapshot& a, const Snapshot& b) {
  EXPECT_EQ(a.head.model, b.head.model);
  EXPECT_EQ(a.head.source, b.head.source);
  EXPECT_EQ(a.head.dimension, b.head.dimension);
  EXPECT_EQ(a.head.coincidence, b.head.coincidence);
  EXPECT_EQ(a.head.level, b.head.level);
  EXPECT_EQ(a.head.keep_in, b.head.keep_in);
  EXPECT_EQ(a.head.keep_out, b.head.keep_out);
  EXPECT_EQ(a.head.steps, b.head.steps);
  EXPECT_EQ(a.head.complete, b.head.complete);
  EXPECT_EQ(a.head.in_volume, b.head.in_volume);
  EXPECT_EQ(a.head.totals, b.head.totals);
  EXPECT_EQ(a.head.partition_hyperplane, b.head.partition_hyperplane);
  EXPECT_EQ(a.head.partition_children, b.head.partition_children);
  EXPECT_EQ(a.head.superstep_name, b.head.superstep_name);
  EXPECT_EQ(a.head.superstep_bytes_sent, b.head.superstep_bytes_sent);
  EXPECT_EQ(a.frontier_region, b.frontier_region);
  EXPECT_EQ(a.frontier_tokens, b.frontier_tokens);
  EXPECT_EQ(a.frontier_open, b.frontier_open);
  EXPECT_EQ(a.frontier_archive, b.frontier_archive);
  EXPECT_EQ(a.tree.ids, b.tree.ids);
  EXPECT_EQ(a.tree.hyperplanes, b.tree.hyperplanes);
  ASSERT_EQ(a.tree.nodes.size(), b.tree.nodes.size());
  for (std::size_t i = 0; i < a.tree.nodes.size(); ++i) {
    EXPECT_EQ(a.tree.nodes[i].hyperplane, b.tree.nodes[i].hyperplane);
    EXPECT_EQ(a.tree.nodes[i].negative, b.tree.nodes[i].negative);
    EXPECT_EQ(a.tree.nodes[i].positive, b.tree.nodes[i].positive);
  }
  EXPECT_EQ(a.regions, b.regions);
  EXPECT_EQ(all(a, &CellBatch::points), all(b, &CellBatch::points));
  EXPECT_EQ(sizes(a, &CellBatch::point_offset), sizes(b, &CellBatch::point_offset));
  EXPECT_EQ(sizes(a, &CellBatch::facet_offset), sizes(b, &CellBatch::facet_offset));
  EXPECT_EQ(sizes(a, &CellBatch::facet_vertex_offset), sizes(b, &CellBatch::facet_vertex_offset));
  EXPECT_EQ(all(a, &CellBatch::facet_vertices), all(b, &CellBatch::facet_vertices));
  EXPECT_EQ(all(a, &CellBatch::facet_hyperplane), all(b, &CellBatch::facet_hyperplane));
  EXPECT_EQ(all(a, &CellBatch::label), all(b, &CellBatch::label));
  EXPECT_EQ(all(a, &CellBatch::primitive), all(b, &CellBatch::primitive));
  EXPECT_EQ(all(a, &CellBatch::part), all(b, &CellBatch::part));
  EXPECT_EQ(all(a, &CellBatch::region), all(b, &CellBatch::region));
  EXPECT_EQ(all(a, &CellBatch::level), all(b, &CellBatch::level));
  EXPECT_EQ(all(a, &CellBatch::volume), all(b, &CellBatch::volume));
}

/// The message of the refusal, or nothing if there was none.
template <typename Body>
std::string refusal(const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

class SnapshotFile : public ::testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "run.h5";
  std::mt19937 random_{samples::new_seed()};

  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void set_bytes(const std::string& to) const { std::ofstream(path_, std::ios::binary) << to; }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), {}));
  }
};

TEST_F(SnapshotFile, RoundTrips) {
  for (const std::size_t cells : {0U, 1U, 50U, 9000U}) {
    const Snapshot written = random_snapshot(random_, cells);
    write_snapshot(path_, written);
    expect_equal(read_snapshot(path_), written);
    const Snapshot head = read_snapshot(path_, SnapshotPart::head);
    EXPECT_EQ(head.frontier_tokens, written.frontier_tokens);
    EXPECT_TRUE(head.cells.empty());
    EXPECT_EQ(files(), 1U);
  }
}

/// Which of 0 and -0 a coordinate is, is nothing to tell of.
TEST_F(SnapshotFile, HasNoNegativeZeros) {
  Snapshot written = random_snapshot(random_, 5);
  auto batch = std::make_shared<CellBatch>(*written.cells.front());
  batch->points.front() = batch->points.back() = -0.0;
  written.cells.front() = batch;
  write_snapshot(path_, written);
  const std::vector<double> points = all(read_snapshot(path_), &CellBatch::points);
  EXPECT_EQ(points.front(), 0);
  for (const double x : points) EXPECT_FALSE(std::signbit(x));  // the others are positive
}

/// What follows belongs to it, too: as if one writer had both.
void append(Snapshot& to, const Snapshot& more) {
  const auto add = [](auto& all, const auto& part) { all.insert(all.end(), part.begin(), part.end()); };
  add(to.frontier_region, more.frontier_region);
  add(to.frontier_tokens, more.frontier_tokens);
  add(to.frontier_open, more.frontier_open);
  add(to.frontier_archive, more.frontier_archive);
  add(to.regions, more.regions);
  add(to.cells, more.cells);
  add(to.tree.nodes, more.tree.nodes);
  add(to.tree.ids, more.tree.ids);
  add(to.tree.hyperplanes, more.tree.hyperplanes);
}

/// Threads in the place of ranks.
class Writers {
 public:
  explicit Writers(int count) : lists_(static_cast<std::size_t>(count)), barrier_(count) {}
  SnapshotWriters writer(int rank) {
    return {rank, static_cast<int>(lists_.size()), [this, rank](const std::vector<std::uint64_t>& numbers) {
              lists_[static_cast<std::size_t>(rank)] = numbers;
              barrier_.arrive_and_wait();
              auto all = lists_;
              barrier_.arrive_and_wait();
              return all;
            }};
  }

 private:
  std::vector<std::vector<std::uint64_t>> lists_;
  std::barrier<> barrier_;
};

/// Some of them have nothing, and chunks are divided anywhere, also in the middle of a checksum's words.
TEST_F(SnapshotFile, OfSeveralWritersHoldsWhatOneWouldWrite) {
  for (const int count : {2, 3, 5}) {
    const auto seed = random_();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::vector<Snapshot> parts;
    for (int rank = 0; rank < count; ++rank)
      parts.push_back(random_snapshot(random, random() % 3 == 0 ? 0 : random() % 8000));
    Snapshot whole = parts.front();
    for (int rank = 1; rank < count; ++rank) {
      parts[static_cast<std::size_t>(rank)].head = whole.head;
      append(whole, parts[static_cast<std::size_t>(rank)]);
    }
    Writers writers(count);
    {
      std::vector<std::jthread> ranks;
      for (int rank = 0; rank < count; ++rank)
        ranks.emplace_back([&, rank] {
          write_snapshot(path_, parts[static_cast<std::size_t>(rank)], writers.writer(rank));
        });
    }
    expect_equal(read_snapshot(path_), whole);
    EXPECT_EQ(files(), 1U);
    const auto bytes = fs::file_size(path_);
    write_snapshot(path_, whole);
    EXPECT_EQ(fs::file_size(path_), bytes);
  }
}

/// Whoever fails, all are told the reason, and the old file stays.
TEST_F(SnapshotFile, OfSeveralWritersIsRefusedTogether) {
  const Snapshot old = random_snapshot(random_, 10);
  write_snapshot(path_, old);
  fs::create_directory(folder_.path() / ".run.h5.part");
  Writers writers(3);
  std::vector<std::string> told(3);
  {
    std::vector<std::jthread> ranks;
    for (int rank = 0; rank < 3; ++rank)
      ranks.emplace_back([&, rank] {
        told[static_cast<std::size_t>(rank)] =
            refusal([&] { write_snapshot(path_, old, writers.writer(rank)); });
      });
  }
  for (const std::string& message : told)
    EXPECT_NE(message.find("Is a directory; the one before it, if any, is as it was"), std::string::npos)
        << message;
  expect_equal(read_snapshot(path_), old);
}

/// What a file holds of some regions: all that belongs to them, and nothing of the others.
Snapshot some_regions(const Snapshot& whole, const std::function<bool(std::uint32_t)>& wanted) {
  Snapshot some = whole;
  some.frontier_region.clear();
  some.frontier_tokens.clear();
  some.frontier_open.clear();
  some.frontier_archive.clear();
  for (std::size_t i = 0; i < whole.frontier_region.size(); ++i) {
    if (!wanted(whole.frontier_region[i])) continue;
    some.frontier_region.push_back(whole.frontier_region[i]);
    some.frontier_tokens.push_back(whole.frontier_tokens[i]);
    some.frontier_open.push_back(whole.frontier_open[i]);
    some.frontier_archive.push_back(whole.frontier_archive[i]);
  }
  some.regions.clear();
  some.tree = {};
  for (std::size_t i = 0; i < whole.regions.size(); ++i) {
    if (!wanted(whole.regions[i].number)) continue;
    some.regions.push_back(whole.regions[i]);
    for (const std::size_t k : {2 * i, 2 * i + 1}) {
      some.tree.nodes.push_back(whole.tree.nodes[k]);
      some.tree.ids.push_back(whole.tree.ids[k]);
    }
    some.tree.hyperplanes.insert(some.tree.hyperplanes.end(), &whole.tree.hyperplanes[8 * i],
                                 &whole.tree.hyperplanes[8 * i] + 8);
  }
  std::erase_if(some.cells, [&](const auto& batch) { return !wanted(batch->region[0]); });
  return some;
}

TEST_F(SnapshotFile, GivesTheRegionsThatAreWanted) {
  for (int i = 0; i < 10; ++i) {
    const Snapshot written = random_snapshot(random_, random_() % 6000);
    write_snapshot(path_, written);
    const unsigned which = 1 + random_() % 14;
    const auto wanted = [&](std::uint32_t region) { return (which >> region % 4 & 1U) != 0; };
    expect_equal(read_snapshot(path_, SnapshotPart::all, wanted), some_regions(written, wanted));
  }
}

TEST_F(SnapshotFile, MakesItsFolder) {
  path_ = folder_.path() / "new" / "deep" / "run.h5";
  write_snapshot(path_, random_snapshot(random_, 3));
  EXPECT_EQ(read_snapshot(path_).head.in_cells, 3U);
}

TEST_F(SnapshotFile, RefusesDamage) {
  write_snapshot(path_, random_snapshot(random_, 200));
  const std::string good = bytes();
  for (int i = 0; i < 25; ++i) {  // truncated anywhere
    set_bytes(good.substr(0, random_() % good.size()));
    EXPECT_NE(refusal([&] { read_snapshot(path_); }), "");
  }
  int refused = 0;
  for (int i = 0; i < 150; ++i) {  // one byte changed: refused, or somewhere that means nothing
    std::string bad = good;
    bad[random_() % bad.size()] ^= static_cast<char>(1U << random_() % 8U);
    set_bytes(bad);
    if (!refusal([&] { read_snapshot(path_); }).empty()) ++refused;
  }
  EXPECT_GT(refused, 100);
  set_bytes(good);
  EXPECT_EQ(read_snapshot(path_).head.in_cells, 200U);
}

TEST_F(SnapshotFile, RefusesWhatIsNoSnapshot) {
  EXPECT_NE(refusal([&] { read_snapshot(path_); }).find("No such file"), std::string::npos);
  EXPECT_NE(refusal([&] { read_snapshot(folder_.path()); }), "");
  for (const std::string& text : {std::string(), std::string("cube();"), std::string("\x89HDF\r\n\x1a\n")}) {
    set_bytes(text);
    EXPECT_NE(refusal([&] { read_snapshot(path_); }), "") << text;
  }
  H5Fclose(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  EXPECT_NE(refusal([&] { read_snapshot(path_); }).find("no snapshot of bsp2"), std::string::npos);
}

void set_version(const fs::path& path, std::int32_t version) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
              attribute = H5Aopen(file, "version", H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_INT32, &version);
  H5Aclose(attribute);
  H5Fclose(file);
}

TEST_F(SnapshotFile, IsReadOfTheVersionBeforeAndRefusedOfOthers) {
  const Snapshot snapshot = random_snapshot(random_, 2);
  write_snapshot(path_, snapshot);
  for (const std::int32_t other : {4, 7, 99}) {
    set_version(path_, other);
    EXPECT_NE(refusal([&] { read_snapshot(path_); }).find("version " + std::to_string(other) + " "),
              std::string::npos);
  }
  for (const std::int32_t version : {5, 6}) {
    set_version(path_, version);
    EXPECT_EQ(read_snapshot(path_).head.in_cells, snapshot.head.in_cells);
  }
}

TEST_F(SnapshotFile, ReadsAFileThatDoesNotTellWhatHasEnded) {
  Snapshot snapshot = random_snapshot(random_, 2);
  snapshot.frontier_region = {4};
  snapshot.frontier_tokens = {3};
  snapshot.frontier_open = {1};
  snapshot.frontier_archive = {"archive"};
  write_snapshot(path_, snapshot);
  EXPECT_EQ(read_snapshot(path_, SnapshotPart::head).frontier_open, snapshot.frontier_open);
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "frontier/open", H5P_DEFAULT);
  H5Fclose(file);
  EXPECT_EQ(read_snapshot(path_, SnapshotPart::head).frontier_open, snapshot.frontier_tokens);
}

TEST_F(SnapshotFile, AFailedWriteLeavesTheOldOne) {
  const Snapshot old = random_snapshot(random_, 100);
  write_snapshot(path_, old);
  const Snapshot large = random_snapshot(random_, 2000);
  for (const rlim_t bytes : {0U, 100U, 5000U, 40000U, 200000U}) {
    std::string message;
    {
      const FullDisk disk(bytes);
      message = refusal([&] { write_snapshot(path_, large); });
    }
    EXPECT_NE(message.find("cannot write the snapshot"), std::string::npos) << bytes << " " << message;
    EXPECT_EQ(files(), 1U);
    expect_equal(read_snapshot(path_), old);
  }
  write_snapshot(path_, large);  // and HDF5 is as good as before
  expect_equal(read_snapshot(path_), large);
}

TEST_F(SnapshotFile, IsCopiedAsAWhole) {
  const fs::path copy = folder_.path() / "copy.h5";
  const Snapshot old = random_snapshot(random_, 100), large = random_snapshot(random_, 2000);
  write_snapshot(copy, old);
  write_snapshot(path_, large);
  for (const rlim_t bytes : {0U, 40000U}) {
    const FullDisk disk(bytes);
    const std::string message = refusal([&] { copy_snapshot(path_, copy); });
    EXPECT_NE(message.find("cannot write the snapshot '" + copy.string() + "'"), std::string::npos)
        << bytes << " " << message;
    EXPECT_EQ(files(), 2U);
    expect_equal(read_snapshot(copy), old);
  }
  copy_snapshot(path_, copy);
  expect_equal(read_snapshot(copy), large);
  copy_snapshot(copy, folder_.path() / "." / "copy.h5");  // onto itself
  expect_equal(read_snapshot(copy), large);
  EXPECT_EQ(files(), 2U);
}

/// What is larger than the disk is refused before any of it is written. It has no bytes itself.
TEST_F(SnapshotFile, IsCopiedOnlyWhereThereIsRoom) {
  const fs::path copy = folder_.path() / "copy.h5";
  set_bytes("");
  std::error_code too_large;
  fs::resize_file(path_, 2 * fs::space(folder_.path()).available, too_large);
  if (too_large) GTEST_SKIP() << "no file can be that large here";
  const FullDisk disk(100000);  // whoever copies it nevertheless shall not fill the disk
  const std::string message = refusal([&] { copy_snapshot(path_, copy); });
  EXPECT_NE(message.find("cannot write the snapshot '" + copy.string() + "': No space left on device: "),
            std::string::npos)
      << message;
  EXPECT_EQ(files(), 1U);
}

/// Linux has nothing to sync in a device that keeps nothing, and says so as a file system does that cannot
/// sync.
TEST(Replacing, IsContentWhereNothingCanBeSynced) {
  const int descriptor = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  EXPECT_EQ(::fsync(descriptor), -1);
  EXPECT_EQ(errno, EINVAL);
  ::close(descriptor);
  EXPECT_FALSE(sync_to_disk("/dev/null", O_RDWR));
  EXPECT_EQ(sync_to_disk("/dev/null/none", O_RDWR), std::errc::not_a_directory);
}

TEST_F(SnapshotFile, RefusesPathsThatCannotBeWritten) {
  const Snapshot s = random_snapshot(random_, 1);
  for (const fs::path& bad : {folder_.path(), fs::path("/dev/null"), fs::path("/dev/null/run.h5")}) {
    EXPECT_NE(refusal([&] { check_snapshot_path(bad); }), "") << bad;
  }
  EXPECT_NE(refusal([&] { write_snapshot("/proc/none/run.h5", s); }), "");
}

}  // namespace
}  // namespace bsp2::io
