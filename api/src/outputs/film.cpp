#include "outputs/film.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "bsp2/io/outputs/animation.hpp"

namespace bsp2::api {
namespace {

unsigned most_level_of(const supersteps::SolidMesh& mesh) {
  unsigned most = 0;
  for (const auto& batch : mesh.batches)
    for (const auto level : batch->level) most = std::max<unsigned>(most, level);
  return most;
}

struct Frame {
  std::string picture;
  supersteps::PictureMemory memory;
};

std::array<double, 3> between(const std::array<double, 3>& a, const std::array<double, 3>& b, double t) {
  std::array<double, 3> point;
  for (std::size_t k = 0; k < 3; ++k) point[k] = a[k] + t * (b[k] - a[k]);
  return point;
}

/// Goes from one to the next at the same pace; where only one of two says what it looks at, that counts for
/// both.
void stand(supersteps::PictureOptions& view, const std::vector<Film::Camera>& path, double t) {
  const double place = t * static_cast<double>(path.size() - 1);
  const auto before = static_cast<std::size_t>(place), after = std::min(before + 1, path.size() - 1);
  const Film::Camera &from = path[before], &to = path[after];
  const double rest = place - static_cast<double>(before);
  view.eye = between(from.eye, to.eye, rest);
  if (!from.look && !to.look) return;
  view.look = between(from.look ? *from.look : *to.look, to.look ? *to.look : *from.look, rest);
}

}  // namespace

void check(const Film& film) {
  if (film.count < 1 || !(film.rate >= 0.01 && film.rate <= 1000))
    throw Error("an animation has pictures: count is 1 or more, rate from 0.01 to 1000 a second");
  if (film.sweep && (film.sweep->axis < 0 || film.sweep->axis > 2))
    throw Error("sweep: axis is 0, 1 or 2, not " + std::to_string(film.sweep->axis));
}

supersteps::PictureOptions view_of(const Film& film, supersteps::PictureOptions view, unsigned i,
                                   unsigned most_level) {
  const double t = film.count > 1 ? static_cast<double>(i) / (film.count - 1) : 1;
  view.format = supersteps::PictureFormat::png;
  view.ball = 1 + (film.explode ? std::max((*film.explode)[0], (*film.explode)[1]) : view.explode);
  if (film.turns) view.turn = 360.0 * i / film.count;
  if (!film.path.empty()) stand(view, film.path, t);
  if (film.explode) view.explode = (*film.explode)[0] + t * ((*film.explode)[1] - (*film.explode)[0]);
  if (film.sweep)
    view.section = {film.sweep->axis, film.sweep->from + t * (film.sweep->to - film.sweep->from),
                    film.sweep->from < film.sweep->to};
  if (film.grows) view.most_level = static_cast<unsigned>(std::lround(t * most_level));
  return view;
}

bool draw_film(const Film& film, const supersteps::PictureOptions& view, const supersteps::RunResult& result,
               unsigned threads, const std::function<bool()>& interrupted,
               const std::filesystem::path& path) {
  if (result.mesh.dimension != 3)
    throw Error("an animation is of solids of dimension 3, not " + std::to_string(result.mesh.dimension));
  const unsigned most_level = most_level_of(result.mesh);
  const auto animation = io::Animation::begin(path, film.rate);
  unsigned done = 0;
  const auto check = [&] {
    if (interrupted && interrupted()) throw geometry::Interrupted();
  };
  try {
    check();
    geometry::OrderedPipeline<Frame>::run(
        film.count, threads,
        [&](std::size_t i, Frame& frame) {
          supersteps::Ranks alone;
          supersteps::PictureOptions of_this = view_of(film, view, static_cast<unsigned>(i), most_level);
          of_this.on_progress = nullptr;
          of_this.memory = &frame.memory;
          frame.picture = supersteps::render(alone, result, of_this);
        },
        [&](const Frame& frame) {
          check();
          animation->add(frame.picture);
          if (view.on_progress) view.on_progress(static_cast<double>(++done) / film.count);
        });
  } catch (const geometry::Interrupted&) {
    return false;
  }
  animation->end();
  return true;
}

}  // namespace bsp2::api
