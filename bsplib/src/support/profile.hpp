#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/bsplib/cost.hpp"
#include "bsp2/bsplib/world.hpp"

namespace bsp2::bsplib {

/// The profile of a world: what each superstep cost each rank, in a file of rank 0 (docs/bsplib.md has its
/// format).
///
/// Ranks keep their rows, and give them to rank 0 now and then: all at the same superstep, since they decide
/// by what all know.
class Profile {
 public:
  /// Collective; null unless rank 0 wants a profile and can write it.
  /// @param number of the world among those that this process made.
  static std::unique_ptr<Profile> open(MPI_Comm comm, const std::string& file, std::uint64_t number,
                                       double begin, const std::optional<Machine>& machine);

  /// The program came to the end of a superstep there.
  void ends_at(detail::Place place) { place_ = place; }
  /// All ranks have come to it.
  void all_are_here(double now) { all_here_ = now; }
  /// @param entered when this rank came. @return whether rows were exchanged, which took time.
  bool add(const SuperstepCost& cost, double entered);
  /// What is left of the rows. Collective.
  void finish();

 private:
  struct Row {
    std::uint64_t superstep;
    double begin, work, wait, sync;  ///< seconds; begin: since the world's
    std::uint64_t out, in, messages_out, messages_in;
    std::uint64_t place;  ///< number of a text
  };
  Profile(MPI_Comm comm, std::FILE* file, double begin, const std::optional<Machine>& machine);

  std::uint64_t number_of(detail::Place place);
  void exchange();
  void write(const std::vector<std::string>& of_ranks);
  void write_row(const Row& row, std::size_t rank, const std::string& place, std::uint64_t h) const;

  static constexpr std::size_t most_rows = 4096;
  static constexpr double most_seconds = 5.0;  ///< of work between two exchanges

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  MPI_Comm comm_;
  int rank_ = 0, ranks_ = 1;
  std::unique_ptr<std::FILE, Close> file_;  ///< on rank 0
  bool is_broken_ = false;                  ///< it could not be written, which has been told
  double begin_, all_here_ = 0.0, seconds_ = 0.0;
  std::optional<Machine> machine_;
  detail::Place place_;
  std::vector<Row> rows_;
  std::map<std::pair<const char*, int>, std::uint64_t> numbers_;
  std::vector<std::string> new_texts_;
  std::vector<std::vector<std::string>> texts_;  ///< on rank 0: of every rank
};

}  // namespace bsp2::bsplib
