#include "support/profile.hpp"

#include <errno.h>

#include <algorithm>
#include <cinttypes>
#include <cstring>
#include <utility>

namespace bsp2::bsplib {

namespace {

std::FILE* open_for_writing(const std::string& name) {
  std::FILE* file = std::fopen(name.c_str(), "w");
  if (!file)
    std::fprintf(stderr, "bsp2::bsplib: BSP2_PROFILE: '%s' cannot be written (%s); there is no profile\n",
                 name.c_str(), std::strerror(errno));
  return file;
}

/// Every rank's bytes, on rank 0. Collective.
std::vector<std::string> gather(MPI_Comm comm, int rank, int ranks, const std::string& mine) {
  int length = static_cast<int>(mine.size());
  std::vector<int> lengths(static_cast<std::size_t>(ranks)), begins(lengths.size());
  MPI_Gather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, 0, comm);
  std::size_t total = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    begins[i] = static_cast<int>(total);
    total += static_cast<std::size_t>(lengths[i]);
  }
  std::string all(total, '\0');
  MPI_Gatherv(mine.data(), length, MPI_BYTE, all.data(), lengths.data(), begins.data(), MPI_BYTE, 0, comm);
  std::vector<std::string> of_ranks;
  for (std::size_t i = 0; rank == 0 && i < lengths.size(); ++i)
    of_ranks.push_back(all.substr(static_cast<std::size_t>(begins[i]), static_cast<std::size_t>(lengths[i])));
  return of_ranks;
}

}  // namespace

std::unique_ptr<Profile> Profile::open(MPI_Comm comm, const std::string& name, std::uint64_t number,
                                       double begin, const std::optional<Machine>& machine) {
  int rank = 0, process = 0;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_rank(MPI_COMM_WORLD, &process);
  std::FILE* file = nullptr;
  if (rank == 0 && !name.empty())
    file = open_for_writing(
        number == 1 ? name : name + "." + std::to_string(number) + "." + std::to_string(process));
  int wanted = file ? 1 : 0;
  MPI_Bcast(&wanted, 1, MPI_INT, 0, comm);
  return std::unique_ptr<Profile>(wanted ? new Profile(comm, file, begin, machine) : nullptr);
}

Profile::Profile(MPI_Comm comm, std::FILE* file, double begin, const std::optional<Machine>& machine)
    : comm_(comm), file_(file), begin_(begin), machine_(machine) {
  MPI_Comm_rank(comm, &rank_);
  MPI_Comm_size(comm, &ranks_);
  texts_.resize(static_cast<std::size_t>(rank_ == 0 ? ranks_ : 0));
  if (!file_) return;
  std::fprintf(file, "# bsp2 profile 1\n# program %s\n# ranks %d\n", program_invocation_short_name, ranks_);
  if (machine_) std::fprintf(file, "# g_seconds_per_byte %.9g\n# l_seconds %.9g\n", machine_->g, machine_->l);
  std::fputs(
      "superstep\trank\tbegin_s\tw_s\twait_s\tsync_s\th_out_bytes\th_in_bytes\tmessages_out\tmessages_in\tgh_"
      "s\tl_s\tplace\n",
      file);
}

std::uint64_t Profile::number_of(detail::Place place) {
  const auto [found, is_new] = numbers_.try_emplace({place.file, place.line}, numbers_.size());
  if (is_new)
    new_texts_.push_back(place.file ? place.file + (place.line > 0 ? ":" + std::to_string(place.line) : "")
                                    : "?");
  return found->second;
}

bool Profile::add(const SuperstepCost& cost, double entered) {
  rows_.push_back({cost.superstep, entered - cost.work_seconds - begin_, cost.work_seconds,
                   std::max(all_here_ - entered, 0.0), cost.sync_seconds, cost.bytes_out, cost.bytes_in,
                   cost.messages_out, cost.messages_in, number_of(place_)});
  place_ = {};
  seconds_ += cost.max_work_seconds;
  if (rows_.size() < most_rows && seconds_ < most_seconds) return false;
  exchange();
  return true;
}

void Profile::finish() {
  exchange();
  file_.reset();
}

/// Rows, and then the texts that are new.
void Profile::exchange() {
  std::string mine(reinterpret_cast<const char*>(rows_.data()), rows_.size() * sizeof(Row));
  for (const std::string& text : new_texts_) mine += text + '\n';
  const auto of_ranks = gather(comm_, rank_, ranks_, mine);
  if (rank_ == 0) write(of_ranks);
  rows_.clear();
  new_texts_.clear();
  seconds_ = 0.0;
}

void Profile::write(const std::vector<std::string>& of_ranks) {
  const std::size_t count = rows_.size();
  std::vector<std::vector<Row>> rows(of_ranks.size(), std::vector<Row>(count));
  for (std::size_t rank = 0; rank < of_ranks.size(); ++rank) {
    std::memcpy(rows[rank].data(), of_ranks[rank].data(), count * sizeof(Row));
    for (std::size_t at = count * sizeof(Row), end; at < of_ranks[rank].size(); at = end + 1) {
      end = of_ranks[rank].find('\n', at);
      texts_[rank].push_back(of_ranks[rank].substr(at, end - at));
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t h = 0;
    for (const auto& of_rank : rows) h = std::max({h, of_rank[i].out, of_rank[i].in});
    for (std::size_t rank = 0; rank < rows.size(); ++rank)
      write_row(rows[rank][i], rank, texts_[rank][rows[rank][i].place], h);
  }
  const bool is_written = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  if (!is_written && !std::exchange(is_broken_, true))
    std::fprintf(stderr, "bsp2::bsplib: BSP2_PROFILE: the profile cannot be written on (%s)\n",
                 std::strerror(errno));
}

void Profile::write_row(const Row& row, std::size_t rank, const std::string& place, std::uint64_t h) const {
  std::fprintf(file_.get(),
               "%" PRIu64 "\t%zu\t%.9f\t%.9f\t%.9f\t%.9f\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64 "\t%" PRIu64
               "\t",
               row.superstep, rank, row.begin, row.work, row.wait, row.sync, row.out, row.in,
               row.messages_out, row.messages_in);
  if (machine_)
    std::fprintf(file_.get(), "%.9f\t%.9f", machine_->g * static_cast<double>(h), machine_->l);
  else
    std::fputs("-\t-", file_.get());
  std::fprintf(file_.get(), "\t%s\n", place.c_str());
}

}  // namespace bsp2::bsplib
