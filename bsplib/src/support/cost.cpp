#include "bsp2/bsplib/cost.hpp"

#include <unistd.h>

#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

namespace bsp2::bsplib {

namespace fs = std::filesystem;
namespace pt = boost::property_tree;

double predict(const SuperstepCost& cost, const Machine& machine) {
  return cost.max_work_seconds + machine.g * static_cast<double>(cost.h_bytes) + machine.l;
}

fs::path machine_file() {
  if (const char* file = std::getenv("BSP2_MACHINE")) return file;
  if (const char* config = std::getenv("XDG_CONFIG_HOME")) return fs::path(config) / "bsp2" / "machine.json";
  const char* home = std::getenv("HOME");
  return fs::path(home ? home : ".") / ".config" / "bsp2" / "machine.json";
}

std::vector<Machine> load_machines(const fs::path& file) {
  std::vector<Machine> machines;
  std::error_code none;
  if (!fs::exists(file, none)) return machines;
  try {
    pt::ptree tree;
    pt::read_json(file.string(), tree);
    for (const auto& [key, entry] : tree.get_child("machines"))
      machines.push_back({entry.get<int>("nprocs"), entry.get<double>("r_flops_per_second"),
                          entry.get<double>("g_seconds_per_byte"), entry.get<double>("l_seconds")});
  } catch (const std::exception& e) {
    throw std::runtime_error(file.string() + ": not a machine file of bsp2-probe: " + e.what());
  }
  return machines;
}

std::optional<Machine> find_machine(const std::vector<Machine>& machines, int nprocs) {
  std::optional<Machine> best;
  int best_distance = std::numeric_limits<int>::max();
  for (const auto& machine : machines) {
    const int distance = std::abs(machine.nprocs - nprocs);
    if (distance < best_distance) best = machine, best_distance = distance;
  }
  return best;
}

void store_machine(const fs::path& file, const Machine& machine) {
  auto machines = load_machines(file);
  std::erase_if(machines, [&](const Machine& m) { return m.nprocs == machine.nprocs; });
  machines.push_back(machine);
  pt::ptree list;
  for (const auto& m : machines) {
    pt::ptree entry;
    entry.put("nprocs", m.nprocs);
    entry.put("r_flops_per_second", m.r);
    entry.put("g_seconds_per_byte", m.g);
    entry.put("l_seconds", m.l);
    list.push_back({"", entry});
  }
  pt::ptree tree;
  tree.add_child("machines", list);
  if (file.has_parent_path()) fs::create_directories(file.parent_path());
  const fs::path fresh = file.string() + "." + std::to_string(getpid());
  pt::write_json(fresh.string(), tree);
  fs::rename(fresh, file);
}

}  // namespace bsp2::bsplib
