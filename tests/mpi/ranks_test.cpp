// Ranks: messages, agreement on failures, records.
#include "bsp2/supersteps/ranks/ranks.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::supersteps {
namespace {

TEST(Ranks, MessagesArriveInTheOrderOfTheRanksAndOnlyOnce) {
  Ranks ranks = Ranks::launched();
  for (int round = 0; round < 3; ++round) {
    for (int to = 0; to < ranks.count(); ++to)
      for (int i = 0; i <= ranks.rank(); ++i)
        ranks.send(to, std::to_string(100 * ranks.rank() + i) +
                           std::string(static_cast<std::size_t>(round) * 3000, '.'));
    ranks.sync();
    std::vector<int> seen;
    for (const auto& message : ranks.received()) {
      EXPECT_EQ(message.source, std::stoi(std::string(message.bytes)) / 100);
      seen.push_back(std::stoi(std::string(message.bytes)));
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(ranks.count() * (ranks.count() + 1) / 2));
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    ranks.sync();
    EXPECT_TRUE(ranks.received().empty());
  }
}

TEST(Ranks, ASyncThatWasBegunMeetsOneThatWaits) {
  Ranks ranks = Ranks::launched();
  for (int to = 0; to < ranks.count(); ++to) ranks.send(to, "x");
  if (ranks.rank() % 2 == 0) {
    ranks.begin_sync();
    EXPECT_TRUE(ranks.is_syncing());
    while (!ranks.try_sync()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } else {
    ranks.sync();
  }
  EXPECT_FALSE(ranks.is_syncing());
  EXPECT_EQ(ranks.received().size(), static_cast<std::size_t>(ranks.count()));
}

/// What `together` throws, as text: "user: ...", "ours: ...", or "" for nothing.
std::string thrown(Ranks& ranks, const std::function<void()>& program) {
  try {
    ranks.together(program);
    return "";
  } catch (const Error& error) {
    return std::string("user: ") + error.what();
  } catch (const std::exception& error) {
    return std::string("ours: ") + error.what();
  }
}

TEST(Ranks, AllThrowWhatOneThrew) {
  for (int culprit = 0; culprit < Ranks::launched().count(); ++culprit) {
    for (const bool is_user : {true, false}) {
      Ranks ranks = Ranks::launched();
      const std::string text = thrown(ranks, [&] {
        ranks.begin("distribution");
        ranks.sync();
        if (ranks.rank() != culprit) return ranks.sync();
        if (is_user) throw Error("bad plan");
        throw std::logic_error("no plan");
      });
      const std::string place = " (distribution, rank " + std::to_string(culprit) + ")";
      if (ranks.count() == 1)
        EXPECT_EQ(text, is_user ? "user: bad plan" : "ours: no plan");
      else
        EXPECT_EQ(text, (is_user ? "user: bad plan" : "ours: internal error: no plan") + place);
    }
  }
}

TEST(Ranks, AFailureEndsASyncThatWasBegun) {
  Ranks ranks = Ranks::launched();
  if (ranks.count() == 1) GTEST_SKIP() << "needs somebody to fail for";
  const std::string text = thrown(ranks, [&] {
    ranks.begin("computation");
    ranks.begin_sync();
    if (ranks.rank() == ranks.count() - 1) throw std::bad_alloc();
    ranks.wait();
    for (;;) ranks.sync();
  });
  EXPECT_EQ(text, "ours: out of memory (computation, rank " + std::to_string(ranks.count() - 1) + ")");
}

TEST(Ranks, RecordsHaveOneValueARank) {
  Ranks ranks = Ranks::launched();
  const auto count = static_cast<std::size_t>(ranks.count());
  ranks.begin("first");
  std::this_thread::sleep_for(std::chrono::milliseconds(ranks.is_master() ? 30 : 1));
  ranks.count_cells(static_cast<std::uint64_t>(ranks.rank()) + 7);
  ranks.sync();
  ranks.begin("second", 3);
  if (ranks.rank() == 0 && count > 1) ranks.send(1, std::string(1000, 'a'));
  ranks.sync();
  ranks.begin("first");
  ranks.count_cells(1);
  const auto records = ranks.records();
  EXPECT_EQ(records.empty(), !ranks.is_master());
  if (!ranks.is_master()) return;
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(records[0].name, "first");
  EXPECT_EQ(records[1].name, "second");
  EXPECT_EQ(records[1].step, 3U);
  for (const auto& record : records) {
    EXPECT_EQ(record.seconds.size(), count);
    EXPECT_EQ(record.work_seconds.size(), count);
    EXPECT_EQ(record.bytes_sent.size(), count);
    EXPECT_EQ(std::accumulate(record.bytes_sent.begin(), record.bytes_sent.end(), std::uint64_t{0}),
              std::accumulate(record.bytes_received.begin(), record.bytes_received.end(), std::uint64_t{0}));
    for (std::size_t i = 0; i < count; ++i) EXPECT_LE(record.work_seconds[i], record.predicted_seconds);
  }
  for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(records[0].cells[i], i + 8);
  EXPECT_GE(records[0].work_seconds[0], 0.03);
  for (std::size_t i = 1; i < count; ++i) EXPECT_LT(records[0].work_seconds[i], records[0].seconds[i]);
  if (count > 1) {
    EXPECT_EQ(records[1].bytes_sent[0], 1000U);
    EXPECT_EQ(records[1].bytes_received[1], 1000U);
  }
}

}  // namespace
}  // namespace bsp2::supersteps
