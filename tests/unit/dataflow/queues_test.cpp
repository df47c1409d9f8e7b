// The two queues between threads. Few tests, but hard ones: every item arrives exactly once.

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <numeric>
#include <thread>
#include <vector>

#include "evaluate/bounded_queue.hpp"
#include "evaluate/work_deque.hpp"

namespace bsp2::dataflow {
namespace {

using namespace std::chrono_literals;

TEST(WorkDeque, IsAStackForItsOwnerAndAQueueForThieves) {
  WorkDeque<int> deque;
  std::vector<int> items(5000);  // more than it has room for at first
  for (int& item : items) deque.push(&item);
  EXPECT_EQ(deque.steal(), &items.front());
  EXPECT_EQ(deque.pop(), &items.back());
  EXPECT_EQ(deque.steal(), &items[1]);
  for (std::size_t i = items.size() - 1; i-- > 2;) ASSERT_EQ(deque.pop(), &items[i]);
  EXPECT_EQ(deque.pop(), nullptr);
  EXPECT_EQ(deque.steal(), nullptr);
  deque.push(&items[7]);
  EXPECT_EQ(deque.pop(), &items[7]);
}

TEST(WorkDeque, GivesEveryItemToExactlyOneThread) {
  constexpr int rounds = 20, count = 20000, thieves = 3;
  for (int round = 0; round < rounds; ++round) {
    WorkDeque<int> deque;
    std::vector<int> items(count);
    std::vector<std::atomic<int>> taken(count);
    std::atomic<bool> done{false};
    const auto take = [&](const int* item) {
      taken[static_cast<std::size_t>(item - items.data())].fetch_add(1, std::memory_order_relaxed);
    };
    std::vector<std::thread> crew;
    for (int t = 0; t < thieves; ++t)
      crew.emplace_back([&] {
        while (!done.load(std::memory_order_acquire))
          if (const int* item = deque.steal()) take(item);
      });
    // Bursts of pushes, and pops down to the last item, over which owner and thieves fight.
    int next = 0;
    while (next < count) {
      const int burst = 1 + (next * 7 + round) % 5;
      for (int i = 0; i < burst && next < count; ++i) deque.push(&items[static_cast<std::size_t>(next++)]);
      for (int i = 0; i < burst; ++i)
        if (const int* item = deque.pop()) take(item);
    }
    while (const int* item = deque.pop()) take(item);
    // A thief may still be between its look and its catch; nothing is left for it, so it gets nothing.
    done.store(true, std::memory_order_release);
    for (std::thread& thread : crew) thread.join();
    for (const auto& times : taken) ASSERT_EQ(times.load(), 1);
  }
}

TEST(BoundedQueue, PassesEveryItemOnInTheOrderOfItsProducer) {
  constexpr int producers = 3, count = 3000;
  for (const std::size_t capacity : {1U, 4U, 40U}) {
    BoundedQueue<std::unique_ptr<std::pair<int, int>>> queue(capacity);
    std::vector<std::thread> crew;
    for (int p = 0; p < producers; ++p)
      crew.emplace_back([&queue, p] {
        for (int i = 0; i < count; ++i) queue.push(std::make_unique<std::pair<int, int>>(p, i));
      });
    std::vector<int> next(producers, 0);
    for (int i = 0; i < producers * count;) {
      const auto items = queue.pop_all(20ms);
      ASSERT_LE(items.size(), capacity);
      for (const auto& item : items) ASSERT_EQ(item->second, next[static_cast<std::size_t>(item->first)]++);
      i += static_cast<int>(items.size());
    }
    for (std::thread& thread : crew) thread.join();
    EXPECT_TRUE(queue.pop_all(0ms).empty());
  }
}

TEST(BoundedQueue, WakesItsConsumerForManyOnly) {
  BoundedQueue<int> queue(16);  // for two
  queue.push(1);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(queue.pop_all(20ms), std::vector<int>{1});
  EXPECT_GE(std::chrono::steady_clock::now() - start, 15ms);
  std::thread producer([&] {
    std::this_thread::sleep_for(10ms);
    queue.push(2);
    queue.push(3);
  });
  EXPECT_EQ(queue.pop_all(60s), (std::vector<int>{2, 3}));
  EXPECT_LT(std::chrono::steady_clock::now() - start, 30s);
  producer.join();
}

TEST(BoundedQueue, HoldsItsProducersBackWhenFull) {
  BoundedQueue<int> queue(2);
  std::atomic<int> pushed{0};
  std::thread producer([&] {
    for (int i = 0; i < 5; ++i) {
      queue.push(i);
      ++pushed;
    }
  });
  std::this_thread::sleep_for(30ms);
  EXPECT_LE(pushed.load(), 2);
  for (int next = 0; next < 5;)
    for (const int item : queue.pop_all(10s)) EXPECT_EQ(item, next++);
  producer.join();
}

TEST(BoundedQueue, LetsGoOfEverybodyWhenClosed) {
  BoundedQueue<std::shared_ptr<int>> queue(1);
  const auto item = std::make_shared<int>(1);
  queue.push(item);
  std::vector<std::thread> crew;
  for (int i = 0; i < 3; ++i) crew.emplace_back([&] { queue.push(item); });
  std::this_thread::sleep_for(10ms);
  queue.close();
  for (std::thread& thread : crew) thread.join();
  queue.push(item);  // dropped
  EXPECT_EQ(item.use_count(), 1);
}

TEST(BoundedQueue, ANudgeEndsAWait) {
  BoundedQueue<int> queue(1);
  std::thread nudger([&] {
    std::this_thread::sleep_for(10ms);
    queue.nudge();
  });
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(queue.pop_all(60s).empty());
  EXPECT_LT(std::chrono::steady_clock::now() - start, 30s);
  nudger.join();
  const auto late = std::chrono::steady_clock::now();
  EXPECT_TRUE(queue.pop_all(20ms).empty());  // each nudge ends one wait
  EXPECT_GE(std::chrono::steady_clock::now() - late, 15ms);
}

}  // namespace
}  // namespace bsp2::dataflow
