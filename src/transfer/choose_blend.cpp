#include "laban/transfer/choose_blend.h"

#include "transfer/blend_tries.h"

namespace laban::transfer {

ChosenBlend choose_blend(PlayMemory& memory, int fragment, const EffortTarget& target,
                         const SearchOptions& options, int tries, double fastest_play) {
  BlendTries blends(memory, fragment, target, options, fastest_play);
  while (blends.count() < tries && blends.try_next()) {
  }
  return blends.best();
}

ChosenBlend blend_by_hand(PlayMemory& memory, int fragment, int fragment_i, int fragment_j,
                          double alpha, const EffortTarget& target, const SearchOptions& options,
                          double fastest_play) {
  const BlendSearch& search = memory.search(fragment, options);
  return played(memory, fragment, search.of_pair(fragment_i, fragment_j, alpha, target),
                fastest_play);
}

}  // namespace laban::transfer
