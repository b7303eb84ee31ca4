#include "corpus.h"

#include <cstdint>
#include <utility>

#include "perform.h"
#include "performer.h"

namespace laban::phrase {

std::vector<Fragment> make_corpus() {
  constexpr std::uint64_t kEffortSeed = 2006;  // any; kept, or every fragment changes
  constexpr std::uint64_t kLifeSeed = 60;
  const std::vector<Performer> performers = make_performers();
  const auto efforts = draw_efforts(static_cast<int>(kActions.size()),
                                    static_cast<int>(performers.size()), kEffortSeed);
  std::vector<Fragment> corpus;
  for (std::size_t a = 0; a < kActions.size(); ++a) {
    for (std::size_t p = 0; p < performers.size(); ++p) {
      const Manner manner = manner_of(efforts[a][p]);
      const Score score = write_score(kActions[a], performers[p], manner);
      corpus.push_back(Fragment{
          "phrase_" + std::string(name_of(kActions[a])) + "_" + performers[p].name + ".bvh",
          kActions[a], static_cast<int>(p), efforts[a][p],
          perform(performers[p], manner, score, kLifeSeed + 100 * a + p)});
    }
  }
  return corpus;
}

}  // namespace laban::phrase
