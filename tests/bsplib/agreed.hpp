#pragma once

#include <gtest/gtest.h>

#include <boost/serialization/string.hpp>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "bsp2/bsplib/collectives.hpp"

/// What tests of agreed errors share.
namespace bsp2::bsplib {

/// Every rank must leave `program` with the same agreed error.
inline void expect_agreed(const std::function<void(World&)>& program, Errc code, int culprit,
                          const std::string& text) {
  std::optional<Error> error;
  World world;
  try {
    supervise(world, program);
  } catch (const Error& e) {
    error = e;
  }
  ASSERT_TRUE(error.has_value()) << "rank " << world.pid() << " got no error";
  EXPECT_TRUE(error->agreed());
  EXPECT_EQ(error->code(), code) << error->what();
  EXPECT_EQ(error->culprit(), culprit) << error->what();
  EXPECT_NE(std::string(error->what()).find(text), std::string::npos) << error->what();
  EXPECT_TRUE(world.failed());
  try {
    world.sync();
    ADD_FAILURE() << "a dead world says so again";
  } catch (const Error& again) {
    EXPECT_STREQ(again.what(), error->what());
  }
  World fresh;  // the ranks are in step: a new world works
  Collectives<std::string> all(fresh);
  for (const std::string& other : all.all_gather(error->what())) EXPECT_EQ(other, error->what());
}

inline int last(const World& world) { return world.nprocs() - 1; }
inline int ranks() {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

class Agreed : public testing::Test {
 protected:
  void SetUp() override {
    if (ranks() == 1) GTEST_SKIP() << "a rank alone agrees with itself";
  }
  int culprit = ranks() - 1;
};

/// What a body says that leaves its world by an exception: its own on the culprit, the world's on the others.
template <typename Body>
std::string message_of_left_world(int culprit, const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    EXPECT_EQ(error.culprit(), culprit);
    return error.what();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace bsp2::bsplib
