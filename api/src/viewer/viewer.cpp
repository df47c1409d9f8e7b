#include "viewer/viewer.hpp"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <utility>

#include "bsp2/error.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/module.hpp"
#include "viewer/levels.hpp"
#include "viewer/message.hpp"
#include "viewer/sections.hpp"

namespace bsp2::api {
namespace {

namespace fs = std::filesystem;
using geometry::CellBatch;
using nlohmann::json;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Memory of this process in use now.
std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Colours by number, and the numbers of all primitives.
struct Palette {
  std::vector<supersteps::Rgba> colours;
  std::vector<std::uint16_t> of_primitive;
  explicit Palette(const std::vector<std::optional<supersteps::Rgba>>& colour_of_primitive) {
    std::map<supersteps::Rgba, std::uint16_t> numbers;
    for (const auto& colour : colour_of_primitive) {
      of_primitive.push_back(no_number);
      if (!colour || (numbers.size() + 1 >= no_number && !numbers.contains(*colour))) continue;
      const auto [found, is_new] = numbers.try_emplace(*colour, static_cast<std::uint16_t>(colours.size()));
      if (is_new) colours.push_back(*colour);
      of_primitive.back() = found->second;
    }
    if (colours.empty()) of_primitive.clear();
  }
};

/// A region as it is now. Two states of one differ in their cells, and so in this.
std::uint64_t state_of(const std::vector<std::shared_ptr<const CellBatch>>& batches) {
  std::uint64_t state = 0x9e3779b97f4a7c15U;
  const auto add = [&state](std::uint64_t word) {
    state = (state ^ word) * 0xd6e8feb86659fd93U + (state >> 31);
  };
  for (const auto& batch : batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      add(std::bit_cast<std::uint64_t>(batch->volume[cell]) + static_cast<std::uint64_t>(batch->label[cell]));
  return state;
}

/// How large a region looks; those that look largest go first.
double apparent_size(const CellBatch& batch, const std::vector<double>& eye) {
  const auto d = static_cast<std::size_t>(batch.dimension);
  if (batch.points.size() < d || eye.size() != d) return 0;
  double distance = 0, extent = 0;
  for (std::size_t i = 0; i < d; ++i) {
    double lower = batch.points[i], upper = lower;
    for (std::size_t at = i; at < batch.points.size(); at += d) {
      lower = std::min(lower, batch.points[at]);
      upper = std::max(upper, batch.points[at]);
    }
    const double away = std::max({0.0, lower - eye[i], eye[i] - upper});
    distance += away * away;
    extent = std::max(extent, upper - lower);
  }
  return extent / std::sqrt(distance + 1e-12 * extent * extent);
}

json part_list(const supersteps::RunReport* report, const std::vector<std::string>& names) {
  json parts = json::array();
  if (report == nullptr) {
    for (const std::string& name : names) parts.push_back({{"name", name}});
    return parts;
  }
  for (const auto& part : report->named_parts) {
    parts.push_back({{"name", part.name}, {"volume", part.volume}});
    if (part.colour) parts.back()["colour"] = *part.colour;
  }
  return parts;
}

json figures_of(const supersteps::RunReport& report) {
  json figures{{"volume", report.in_volume},
               {"fuzzyVolume", report.fuzzy_volume},
               {"inCells", report.in_cells},
               {"fuzzyCells", report.fuzzy_cells},
               {"seconds", report.seconds},
               {"memory", report.peak_rss_bytes},
               {"digest", report.digest},
               {"complete", report.complete},
               {"lower", report.lower},
               {"upper", report.upper},
               {"primitives", report.primitives},
               {"ranks", report.ranks},
               {"threads", report.threads},
               {"warnings", report.warnings},
               {"notes", report.notes}};
  if (report.boundary) {
    figures["area"] = report.boundary->area;
    figures["triangles"] = report.boundary->triangles;
  }
  for (const auto& failed : report.failed) figures["warnings"].push_back(failed.text);
  return figures;
}

}  // namespace

PageFiles load_page() {
  const fs::path folder = module_folder() / "view";
  PageFiles files;
  for (const auto& [name, file, type] :
       {std::array<const char*, 3>{"", "index.html", "text/html; charset=utf-8"},
        std::array<const char*, 3>{"view.js", "view.js", "text/javascript; charset=utf-8"},
        std::array<const char*, 3>{"view.css", "view.css", "text/css; charset=utf-8"}}) {
    std::string bytes = bytes_of(folder / file);
    if (bytes.empty())
      throw Error("the page that shows models is missing: there is no '" + (folder / file).string() +
                  "', since npm was not there when bsp2 was built, or could not fetch what the page is made "
                  "of; install "
                  "npm, then build again: cmake --build BUILD --target bsp2_page");
    files[name] = {type, std::move(bytes)};
  }
  return files;
}

Viewer::Viewer(const ViewerOptions& command, bool serves) : command_(command) {
  camera_ = command.eye;
  if (!serves) return;
  server_ = std::make_unique<Server>(
      ServerOptions{command.address, command.port}, load_page(), scene_,
      [this](const std::string& text) { hear(text); }, section_of);
  packer_ = std::thread([this] { pack_again_and_again(); });
}

Viewer::~Viewer() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (packer_.joinable()) packer_.join();
  server_.reset();
}

/// What pages say is taken for what it looks like, or for nothing.
void Viewer::hear(const std::string& text) {
  const json said = json::parse(text, nullptr, false);
  if (!said.is_object() || !said.contains("eye") || !said["eye"].is_array() || said["eye"].size() != 3)
    return;
  std::vector<double> eye;
  for (const json& x : said["eye"])
    if (x.is_number() && std::isfinite(x.get<double>())) eye.push_back(x.get<double>());
  const std::lock_guard lock(mutex_);
  if (eye.size() == 3) camera_ = std::move(eye);
}

void Viewer::begin(const std::string& model) {
  if (server_) drain();  // of a run that was given up
  ++run_;
  model_ = model;
  began_ = Clock::now();
  steered_ = {};
  last_budget_.reset();
  steps_ = 0;
  done_ = computed_ = 0;
  cells_ = 0;
  was_shown_ = false;
  superstep_ = "compilation";
  if (!server_) return;
  tell("running");
}

void Viewer::tell(const char* state) {
  if (!server_) return;
  told_ = Clock::now();
  const double seconds = seconds_since(began_);
  Message message("progress", run_);
  message["state"] = state;
  message["model"] = model_;
  message["superstep"] = superstep_;
  message["done"] = done_;
  message["cells"] = cells_;
  message["seconds"] = seconds;
  message["memory"] = resident_bytes();
  message["pages"] = server_->pages();
  scene_.put("progress", message.bytes());
}

void Viewer::superstep(const std::string& name, Phase phase) {
  superstep_ = name;
  phase_ = phase;
  tell("running");
}

void Viewer::progress(double done, std::uint64_t cells) {
  constexpr double between = 0.15;
  // A step begins with what it finds out anew, at less than the one before ended with.
  if (phase_ == Phase::computation) done = computed_ = std::max(computed_, done);
  done_ = done;
  cells_ = std::max(cells_, cells);
  if (seconds_since(told_) > between) tell("running");
}

supersteps::Steering Viewer::steer() {
  constexpr double first = 0.02, growth = 1.5, share = 4, coarse_seconds = 1.0;
  supersteps::Steering steering;
  const bool is_shown = dimension_ == 2 || dimension_ == 3;
  const double since = steps_ == 0 ? 0 : seconds_since(steered_);
  if (command_.budget) {
    steering.budget_seconds = command_.budget;
  } else if (is_shown) {
    // What a picture costs is a small part of what there is between two.
    const double cost = last_budget_ ? std::max(0.0, since - *last_budget_) : 0;
    steering.budget_seconds = last_budget_ ? std::max(growth * *last_budget_, share * cost) : first;
  }
  if (steps_ == 0) seconds_of_steps_ = 0;
  seconds_of_steps_ += since;
  const bool coarse_first = !command_.order && seconds_of_steps_ < coarse_seconds;
  steering.order = coarse_first ? Order::priority : command_.order.value_or(Order::depth);
  if (!command_.order || command_.follows_eye) {
    const std::lock_guard lock(mutex_);
    steering.eye = camera_;
  }
  ++steps_;
  steered_ = Clock::now();
  last_budget_ = steering.budget_seconds;
  return steering;
}

Viewer::Picture Viewer::picture_of(const supersteps::RunResult& result) const {
  Picture picture{
      .run = run_, .step = steps_, .dimension = result.report.dimension, .batches = result.mesh.batches};
  picture.rank_of_region = result.rank_of_region;
  picture.colour_of_primitive = result.colour_of_primitive;
  picture.part_names = result.part_names;
  picture.bounds = result.bounds;
  return picture;
}

void Viewer::add(const std::shared_ptr<const CellBatch>& cells) {
  constexpr std::size_t most_waiting = 2000;  // batches; the next picture has them all
  if (!server_ || !was_shown_) return;
  const std::lock_guard lock(mutex_);
  if (fresh_.size() >= most_waiting) return;
  fresh_.push_back(cells);
  fresh_step_ = steps_;
  if (fresh_.size() == 1) changed_.notify_all();
}

void Viewer::show(const supersteps::RunResult& now, supersteps::Ranks& ranks) {
  dimension_ = now.report.dimension;
  was_shown_ = true;
  if (dimension_ != 2 && dimension_ != 3) return;
  Picture picture = picture_of(now);
  if (ranks.count() == 1) {
    hand_over(newest_, std::move(picture));
    return;
  }
  std::vector<std::string> messages;  // a key, a line feed, the bytes
  ranks.agree([&] {
    pack(
        picture,
        [&](const std::string& key, std::string bytes) { messages.push_back(key + '\n' + std::move(bytes)); },
        static_cast<unsigned>(ranks.count()), ranks.rank(), false);
  });
  for (const std::string& message : messages) ranks.send(0, message);
  ranks.sync();
  if (!ranks.is_master()) return;
  pack_model(picture);
  for (const auto& message : ranks.received()) {
    const auto end = message.bytes.find('\n');
    put_detailed(scene_, std::string(message.bytes.substr(0, end)),
                 std::string(message.bytes.substr(end + 1)));
  }
  pack_end(picture);
}

void Viewer::finish(const supersteps::RunResult& result) {
  dimension_ = result.report.dimension;
  if (server_ && (dimension_ == 2 || dimension_ == 3)) {
    Picture picture = picture_of(result);
    if (was_shown_) picture.batches.clear();  // they are there already
    picture.faces = result.faces;
    picture.report = result.report;
    hand_over(finished_, std::move(picture));
    drain();
  }
  superstep_ = "";
  done_ = 1;
  cells_ = result.report.in_cells + result.report.fuzzy_cells;
  scene_.remove("error");
  if (dimension_ < 2 || dimension_ > 3) {
    Message message("error", run_);
    message["title"] = "There is no picture of this model";
    message["text"] = model_ + " has " +
                      counted(dimension_,
                              "# dimension[s], and the page shows solids of 2 and 3; a section or a "
                              "projection of it can be shown");
    scene_.put("error", message.bytes());
  }
  tell(dimension_ == 2 || dimension_ == 3 ? "finished" : "failed");
}

void Viewer::fail(const std::string& text) {
  superstep_ = "";
  if (!text.empty()) {
    Message message("error", run_);
    message["text"] = text;
    scene_.put("error", message.bytes());
  }
  tell(text.empty() ? "stopped" : "failed");
}

void Viewer::hand_over(std::optional<Picture>& place, Picture picture) {
  if (!server_) return;
  const std::lock_guard lock(mutex_);
  if (failed_) std::rethrow_exception(std::exchange(failed_, {}));
  place = std::move(picture);
  fresh_.clear();  // it has them
  changed_.notify_all();
}

void Viewer::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return (!newest_ && !finished_ && !is_busy_) || failed_ || !server_; });
  if (failed_) std::rethrow_exception(std::exchange(failed_, {}));
}

bool Viewer::has_newer() const {
  const std::lock_guard lock(mutex_);
  return newest_.has_value() || ends_;
}

void Viewer::pack_again_and_again() {
  constexpr auto gathering = std::chrono::milliseconds(150);
  const auto has_picture = [&] { return newest_ || finished_ || ends_; };
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return has_picture() || !fresh_.empty(); });
    if (!has_picture() && changed_.wait_for(lock, gathering, has_picture)) continue;
    if (ends_) return;
    std::optional<Picture> picture;
    Batches fresh;
    if (newest_ || finished_)
      picture = std::exchange(newest_ ? newest_ : finished_, {});
    else
      fresh = std::exchange(fresh_, {});
    const unsigned step = fresh_step_;
    is_busy_ = true;
    lock.unlock();
    std::exception_ptr failed;
    try {
      if (picture) {
        pack_model(*picture);
        pack(
            *picture,
            [this](const std::string& key, std::string bytes) {
              put_detailed(scene_, key, std::move(bytes));
            },
            1, 0, true);
        pack_end(*picture);
      } else {
        pack_fresh(fresh, step);
      }
    } catch (...) {
      failed = std::current_exception();
    }
    lock.lock();
    if (failed) failed_ = failed;
    is_busy_ = false;
    changed_.notify_all();
  }
}

void Viewer::pack(const Picture& picture, const Send& send, unsigned ranks, int rank, bool may_stop) {
  if (packed_run_ != picture.run) {
    sent_.clear();
    rank_before_.clear();
  }
  packed_run_ = picture.run;
  std::map<std::uint32_t, Batches> regions;
  std::size_t cells = 0;
  for (const auto& batch : picture.batches) {
    if (batch->empty()) continue;
    regions[batch->region.front()].push_back(batch);
    cells += batch->size();
  }
  std::vector<double> eye;
  {
    const std::lock_guard lock(mutex_);
    eye = camera_;
  }
  std::vector<std::pair<double, std::uint32_t>> order;
  for (const auto& [region, batches] : regions)
    order.emplace_back(-apparent_size(*batches.front(), eye), region);
  std::sort(order.begin(), order.end());
  const Palette palette(picture.colour_of_primitive);
  looks_ = {picture.rank_of_region, palette.of_primitive, picture.bounds};
  for (const auto& [size, region] : order) {
    if (may_stop && has_newer()) return;
    const Batches& batches = regions.at(region);
    const std::uint64_t state = state_of(batches);
    const auto sent = sent_.find(region);
    if (sent != sent_.end() && sent->second == state) continue;
    std::size_t own = 0;
    for (const auto& batch : batches) own += batch->size();
    const std::size_t most = std::max<std::size_t>(200, command_.triangles / ranks * own / cells);
    send("region " + std::to_string(picture.run) + " " + std::to_string(region),
         region_message(picture.run, region, batches, looks_, most));
    sent_[region] = state;
  }
  if (!picture.report) pack_emptied(picture, send, rank);
}

/// What was FUZZY in a region and is all OUT now is in the picture no more, and must not stay in the page:
/// the rank that has the region says so, also if another one had it when it was shown.
void Viewer::pack_emptied(const Picture& picture, const Send& send, int rank) {
  std::set<std::uint32_t> here;
  for (const auto& batch : picture.batches)
    if (!batch->empty()) here.insert(batch->region.front());
  std::set<std::uint32_t> emptied;
  for (const auto& [region, state] : sent_)
    if (!here.contains(region)) emptied.insert(region);
  const auto& ranks = picture.rank_of_region;
  for (std::uint32_t region = 0; region < std::min(ranks.size(), rank_before_.size()); ++region)
    if (ranks[region] == rank && rank_before_[region] != rank && !here.contains(region))
      emptied.insert(region);
  for (const std::uint32_t region : emptied) {
    if (region >= ranks.size() || ranks[region] == rank)  // else it has moved
      send("region " + std::to_string(picture.run) + " " + std::to_string(region),
           region_message(picture.run, region, {}, looks_, 0));
    sent_.erase(region);
  }
  rank_before_ = ranks;
}

/// Not too many of them: what they add to is shown, and the next picture has them in their shares.
void Viewer::pack_fresh(const Batches& batches, unsigned step) {
  if (batches.empty() || fresh_triangles_ >= command_.triangles / 2) return;
  const std::size_t most = command_.triangles / 2 - fresh_triangles_;
  const std::string key = "fresh " + std::to_string(++fresh_messages_);
  const Fresh fresh{fresh_messages_, step};
  std::string message =
      region_message(packed_run_, batches.front()->region.front(), batches, looks_, most, fresh);
  fresh_triangles_ += message.size() / 10;  // about the bytes of a triangle
  scene_.put(key, std::move(message));
}

/// What stands before the cells, since they are seen within its bounds.
void Viewer::pack_model(const Picture& picture) {
  if (server_) scene_.put_first("model", model_message(picture));
}

/// What stands after the cells: that they are all there, and the surface in their place once there is one.
void Viewer::pack_end(const Picture& picture) {
  if (!server_) return;
  const bool is_over = picture.report.has_value();
  if (picture.faces) {
    std::size_t number = 0;
    const std::string key = "piece " + std::to_string(picture.run) + " ";
    for (std::string& piece : surface_messages(picture.run, *picture.faces, command_.triangles))
      put_detailed(scene_, key + std::to_string(number++), std::move(piece));
  }
  Message message("shown", picture.run);
  message["surface"] = picture.faces.has_value();
  message["final"] = is_over;
  message["ofStep"] = picture.step;
  if (picture.faces) {
    std::vector<float> volumes;
    for (const auto& solid : picture.faces->solids) volumes.push_back(static_cast<float>(solid.volume));
    message.add("solidVolumes", volumes);
  }
  scene_.put("shown", message.bytes());
  scene_.remove("fresh ");
  fresh_triangles_ = 0;
  for (; oldest_run_ < picture.run; ++oldest_run_)
    for (const char* kind : {"region ", "piece "}) scene_.remove(kind + std::to_string(oldest_run_) + " ");
}

std::string Viewer::model_message(const Picture& picture) const {
  Message message("model", picture.run);
  message["name"] = model_;
  message["dimension"] = picture.dimension;
  message["lower"] = picture.bounds.lower;
  message["upper"] = picture.bounds.upper;
  message["parts"] = part_list(picture.report ? &*picture.report : nullptr, picture.part_names);
  message["colours"] = Palette(picture.colour_of_primitive).colours;
  message["ranks"] =
      picture.rank_of_region.empty()
          ? 1
          : *std::max_element(picture.rank_of_region.begin(), picture.rank_of_region.end()) + 1;
  if (!command_.eye.empty()) message["eye"] = command_.eye;
  if (picture.report) message["figures"] = figures_of(*picture.report);
  return message.bytes();
}

}  // namespace bsp2::api
