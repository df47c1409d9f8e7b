// Queues of typed messages, and the tagged messages below them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/serialization/map.hpp>
#include <boost/serialization/string.hpp>
#include <boost/serialization/vector.hpp>
#include <map>
#include <string>
#include <vector>

#include "bsp2/bsplib/queue.hpp"

namespace {

using namespace bsp2::bsplib;

struct Cell {
  std::vector<double> points;
  std::map<int, std::string> names;
  bool operator==(const Cell&) const = default;
};

template <class Archive>
void serialize(Archive& archive, Cell& cell, unsigned) {
  archive& cell.points& cell.names;
}

Cell cell(int from, int to) {
  return {std::vector<double>(static_cast<std::size_t>(from) * 1000, to), {{from, "cell"}}};
}

TEST(QueueTest, CarriesWhatBoostArchives) {
  World world;
  Queue<Cell> queue(world);
  for (int pid = 0; pid < world.nprocs(); ++pid) queue.send(pid, cell(world.pid(), pid));
  EXPECT_EQ(queue.size(), 0U);
  world.sync();
  const auto received = queue.receive();
  ASSERT_EQ(received.size(), static_cast<std::size_t>(world.nprocs()));
  for (int pid = 0; pid < world.nprocs(); ++pid) {
    EXPECT_EQ(received[static_cast<std::size_t>(pid)].source, pid);
    EXPECT_EQ(received[static_cast<std::size_t>(pid)].value, cell(pid, world.pid()));
  }
  world.sync();
  EXPECT_EQ(queue.size(), 0U) << "messages last one superstep";
}

/// Trivially copyable, but its bytes mean nothing elsewhere.
struct Name {
  const char* text = nullptr;
  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    static constexpr std::array<const char*, 3> names{"tower", "piece", "sponge"};
    int index = 0;
    if constexpr (Archive::is_saving::value)
      index = static_cast<int>(std::find(names.begin(), names.end(), std::string(text)) - names.begin());
    archive& index;
    if constexpr (Archive::is_loading::value) text = names.at(static_cast<std::size_t>(index));
  }
};

TEST(QueueTest, ArchivesWhatSaysHow) {
  static_assert(std::is_trivially_copyable_v<Name>);
  World world;
  Queue<Name> queue(world);
  const std::string own = world.pid() % 2 == 0 ? "piece" : "sponge";  // another address on each rank
  for (int pid = 0; pid < world.nprocs(); ++pid) queue.send(pid, Name{own.c_str()});
  world.sync();
  for (const auto& [source, value] : queue.receive())
    EXPECT_STREQ(value.text, source % 2 == 0 ? "piece" : "sponge");
}

TEST(QueueTest, QueuesDoNotMix) {
  World world;
  Queue<int> numbers(world);
  Queue<std::string> words(world);
  for (int i = 0; i < 10; ++i) {
    numbers.send(0, 100 * world.pid() + i);
    if (i % 3 == 0) words.send(0, std::string(static_cast<std::size_t>(i), 'x'));
  }
  world.sync();
  if (world.pid() != 0) return;
  const auto n = numbers.receive();
  ASSERT_EQ(n.size(), static_cast<std::size_t>(10 * world.nprocs()));
  for (std::size_t i = 0; i < n.size(); ++i) {
    EXPECT_EQ(n[i].source, static_cast<int>(i / 10));
    EXPECT_EQ(n[i].value, static_cast<int>(100 * (i / 10) + i % 10)) << "in the order sent";
  }
  EXPECT_EQ(words.size(), static_cast<std::size_t>(4 * world.nprocs()));
  EXPECT_EQ(words.receive()[3].value, "xxxxxxxxx");
}

TEST(QueueTest, CarriesLargeMessages) {
  World world;
  Queue<std::vector<char>> queue(world);
  const int to = (world.pid() + 1) % world.nprocs();
  queue.send(to, std::vector<char>(10000000, static_cast<char>(world.pid())));
  world.sync();
  const auto received = queue.receive();
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].value, std::vector<char>(10000000, static_cast<char>(received[0].source)));
}

TEST(QueueTest, ValuesOfAnotherSizeAreAnError) {
  World world;
  Queue<std::int64_t> queue(world);
  const std::byte byte{1};
  world.send(1, world.pid(), {}, std::span(&byte, 1));  // as a rank would whose queue 1 is of char
  world.sync();
  try {
    queue.receive();
    ADD_FAILURE() << "1 byte was taken for 8";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("A message of 1 byte is no value of 8 bytes"),
              std::string::npos);
    EXPECT_EQ(error.culprit(), world.pid());
  }
}

TEST(Tags, TakeEffectInTheNextSuperstep) {
  World world;
  EXPECT_EQ(world.set_tagsize(3), 0U);
  EXPECT_EQ(world.set_tagsize(4), 3U);
  EXPECT_EQ(world.tagsize(), 0U);
  world.send(0, world.pid(), {}, {});
  world.sync();
  EXPECT_EQ(world.tagsize(), 4U);
  EXPECT_EQ(world.received_tagsize(), 0U);
  ASSERT_EQ(world.messages(0).size(), 1U);
  EXPECT_EQ(world.messages(0)[0].tag.size(), 0U);
}

}  // namespace
