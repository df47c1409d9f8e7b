#include "answers/film.hpp"

#include <algorithm>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "bsp2/io/outputs/animation.hpp"

namespace bsp2::jobs {
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

}  // namespace

bool draw_film(const FilmCommand& film, const supersteps::PictureOptions& view,
               const supersteps::RunResult& result, unsigned threads,
               const std::function<bool()>& interrupted, const std::filesystem::path& path) {
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

}  // namespace bsp2::jobs
