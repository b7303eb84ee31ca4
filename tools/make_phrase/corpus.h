#pragma once

#include <string>
#include <vector>

#include "laban/motion/clip.h"

#include "actions.h"
#include "manner.h"

namespace laban::phrase {

/// One fragment of the corpus.
struct Fragment {
  std::string file_name;  ///< phrase_{content}_{performer}.bvh
  Action action = Action::kWalk;
  int performer = 0;
  Effort effort;  ///< asked of the performer; what came out is for the observer to measure
  motion::Clip clip;
};

/// The 60 fragments, action by action. Always the same.
[[nodiscard]] std::vector<Fragment> make_corpus();

}  // namespace laban::phrase
