#include "map_making.h"

#include "laban/base/error.h"

namespace laban::cli {
namespace {

manifold::MapPath make_path(const manifold::PoseManifold& manifold, const MapChoices& choices,
                            base::Progress* progress) {
  if (choices.points.cols() == 0)
    throw base::Error(base::ErrorKind::kUsage, "there is no point on the map to go from");
  if (!choices.walks) return manifold::path_through(manifold, choices.points, choices.frames);
  base::Rng rng(choices.seed);
  return manifold::markov_path(manifold, choices.points.col(0), choices.walk, rng, progress);
}

manifold::PlayOptions play_options(const MapChoices& choices) {
  manifold::PlayOptions options;
  options.travel = choices.travel == "none"         ? manifold::Travel::kNone
                   : choices.travel == "primitives" ? manifold::Travel::kPrimitives
                                                    : manifold::Travel::kContacts;
  options.lock_feet = !choices.no_foot_fix;
  return options;
}

}  // namespace

MadeMapMotion make_map_motion(const manifold::PoseManifold& manifold, const MapChoices& choices,
                              base::Progress* progress) {
  base::ProgressPart walking(progress, 0.0, 0.4);
  manifold::MapPath path = make_path(manifold, choices, &walking);
  base::ProgressPart playing(progress, 0.4, 1.0);
  motion::Clip clip = manifold::play(manifold, path, play_options(choices), &playing);
  return {std::move(path), std::move(clip)};
}

}  // namespace laban::cli
