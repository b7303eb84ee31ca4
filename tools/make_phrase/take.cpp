#include "take.h"

#include <cstdint>

#include "laban/motion/humanoid.h"
#include "laban/motion/join.h"
#include "laban/motion/retarget.h"

#include "actions.h"
#include "manner.h"
#include "perform.h"
#include "performer.h"

namespace laban::phrase {

motion::Clip make_take() {
  constexpr std::uint64_t kLifeSeed = 1300;  // any that no fragment of the corpus uses
  Performer performer;
  performer.name = "take";
  const Manner manner = manner_of(Effort{});
  std::vector<motion::Clip> clips;
  std::vector<motion::PoseMatrix> parts;
  for (std::size_t a = 0; a < kActions.size(); ++a) {
    clips.push_back(
        perform(performer, manner, write_score(kActions[a], performer, manner), kLifeSeed + a));
    parts.push_back(motion::to_pose_matrix(clips.back(), motion::find_humanoid(clips.back())));
  }
  return motion::from_pose_matrix(motion::concatenate(parts), motion::find_humanoid(clips.front()),
                                  clips.front());
}

}  // namespace laban::phrase
