#include "bsp2/bsplib/world.hpp"

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "engine/engine.hpp"

namespace bsp2::bsplib {

using detail::Engine;

namespace {

MPI_Comm duplicate(MPI_Comm comm) {
  Engine::announce_world(comm);
  MPI_Comm copy = MPI_COMM_NULL;
  MPI_Comm_dup(comm, &copy);
  return copy;
}

/// Ends a world at the end of its scope, where nothing may be thrown.
void leave(const std::shared_ptr<Engine>& engine) noexcept {
  if (!engine || engine->closed() || engine->failed()) return;
  try {
    if (std::uncaught_exceptions() > 0) {
      engine->abandon();
    } else {
      engine->close();
    }
  } catch (const std::exception& error) {
    if (std::uncaught_exceptions() == 0) std::fprintf(stderr, "bsp2::bsplib: %s\n", error.what());
  }
}

}  // namespace

WorldOptions WorldOptions::from_environment() {
  WorldOptions options;
  if (const char* bytes = std::getenv("BSP2_STAGING_BYTES")) {
    const char* end = bytes + std::strlen(bytes);
    const auto [rest, problem] = std::from_chars(bytes, end, options.staging_bytes);
    if (problem != std::errc() || rest != end || options.staging_bytes > most_staging_bytes)
      options.unreadable = bytes;
  }
  if (const char* profile = std::getenv("BSP2_PROFILE")) options.profile = profile;
  return options;
}

World::World(MPI_Comm comm, WorldOptions options)
    : World(std::make_shared<Engine>(duplicate(comm), std::move(options))) {}

World::World(std::shared_ptr<Engine> engine)
    : runs_(engine->runs(), engine->nprocs()), engine_(std::move(engine)), last_pid_(engine_->pid()) {}

World::~World() {
  if (owns_) leave(engine_);
}

World::World(World&& other) noexcept
    : runs_(std::exchange(other.runs_, {})),
      engine_(std::move(other.engine_)),
      owns_(other.owns_),
      last_pid_(other.last_pid_) {}

World& World::operator=(World&& other) noexcept {
  if (this == &other) return *this;
  if (owns_) leave(engine_);
  engine_ = std::move(other.engine_);
  runs_ = std::exchange(other.runs_, {});
  owns_ = other.owns_;
  last_pid_ = other.last_pid_;
  return *this;
}

Engine& World::engine() const {
  if (!engine_) throw Error(Errc::misuse, last_pid_, 0, "World", "The world was moved to another object");
  return *engine_;
}

int World::pid() const { return engine().pid(); }
int World::nprocs() const { return engine().nprocs(); }
double World::time() const { return engine().time(); }
std::uint64_t World::superstep() const { return engine().superstep(); }
void World::sync(const detail::Call& call, detail::Place place) { engine().sync(call, place); }

OpenSuperstep World::open(std::source_location place) {
  engine().open_sync(place);
  return OpenSuperstep(engine_);
}

void World::close() { engine().close(); }
void World::fail(const std::string& why) { engine().fail(why); }
void World::relay(const Error& error) { engine().relay(error); }
bool World::failed() const { return engine().failed(); }
World World::split(int color, int key) { return World(engine().split(color, key)); }

World::Slot World::push_reg(const void* address, std::size_t bytes) {
  return engine().push_reg(address, bytes);
}
void World::pop_reg(const void* address) { engine().pop_reg(address); }
void World::pop_slot(Slot slot) { engine().pop_slot(slot); }
void World::give_back_slot(Slot slot) noexcept {
  if (engine_) engine_->give_back_slot(slot);
}
void World::give_back_queue(std::uint32_t queue) noexcept {
  if (engine_) engine_->give_back_queue(queue);
}
std::pair<World::Slot, std::byte*> World::allocate(std::size_t bytes) { return engine().allocate(bytes); }
std::size_t World::size_of(Slot slot, int pid) const { return engine().size_of(slot, pid); }
World::Slot World::slot_of(const void* address, const char* caller) const {
  return engine().slot_of(address, caller);
}

void World::start_put(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes) {
  engine().put(pid, source, target, offset, bytes);
}
void World::start_get(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes) {
  engine().get(pid, source, offset, target, bytes, false);
}
void World::start_hpput(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes) {
  engine().hpput(pid, source, target, offset, bytes);
}
void World::start_hpget(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes) {
  engine().get(pid, source, offset, target, bytes, true);
}

std::size_t World::set_tagsize(std::size_t bytes) { return engine().set_tagsize(bytes); }
std::size_t World::tagsize() const { return engine().tagsize(); }
std::size_t World::received_tagsize() const { return engine().received_tagsize(); }
void World::reject_index(int pid, std::size_t index, std::size_t size) const {
  std::string number = std::to_string(index);
  if (const auto negative = static_cast<std::ptrdiff_t>(index); negative < 0)
    number += " (or " + std::to_string(negative) + ")";
  engine().reject(Errc::out_of_range, "index",
                  "Element " + number + " is beyond registered range of " + detail::amount(size, "element") +
                      " at rank " + std::to_string(pid));
}
void World::declare_type(std::uint64_t hash) { engine().declare_type(hash); }
std::uint32_t World::new_queue() { return engine().new_queue(); }
void World::close_queue(std::uint32_t queue) { engine().close_queue(queue); }
void World::send(std::uint32_t queue, int pid, std::span<const std::byte> tag,
                 std::span<const std::byte> payload) {
  engine().send(queue, pid, tag, payload);
}
std::span<const Message> World::messages(std::uint32_t queue) const { return engine().messages(queue); }

const CostReport& World::costs() const { return engine().costs; }
void World::set_machine(const Machine& machine) { engine().machine = machine; }
const std::optional<Machine>& World::machine() const { return engine().machine; }

OpenSuperstep::~OpenSuperstep() {
  if (!engine_) return;
  try {
    if (std::uncaught_exceptions() > 0) std::exchange(engine_, nullptr)->complete_open_as_failed();
    close();
  } catch (const std::exception&) {
    // The world is dead now and says so at its next call.
  }
}

bool OpenSuperstep::poll() { return !engine_ || engine_->advance(false); }

void OpenSuperstep::close() {
  if (!engine_) return;
  const std::shared_ptr<Engine> engine = std::exchange(engine_, nullptr);
  engine->advance(true);
  engine->finish_sync();
}

}  // namespace bsp2::bsplib
