// Does a left-out performer (or style), restyled to a single-factor target, measure what was asked?
// The figures: asked against measured after synthesis, and how far the two factors move
// that were not asked for. Every performer is left out in turn (database, metric, regressor and
// observer know nothing of him); his takes are matched by segmentation, as apply does; targets are
// uniform between the 5th and 95th percentile of the factor's predictions over all blends of the
// content.
//
// Usage: closed_loop_study FOLDER PATTERN [TARGETS A FACTOR AND PERFORMER] [CAUTION STAY
// NEIGHBOURS TRIES]
//   e.g. PATTERN 'dataset-1_{content}_{performer}_{take}'

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "laban/align/segment_input.h"
#include "laban/base/rng.h"
#include "laban/effort/observer.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/transfer/choose_blend.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

#include "observed_corpus.h"
#include "takes.h"

namespace {

using namespace laban;

/// The fragment of the take's own content that plays most of it; nullopt if none does.
std::optional<int> matching_fragment(const transfer::StyleModel& model,
                                     const transfer::Fragment& take) {
  const auto segmentation = align::segment_input(take.pose, model.database, {});
  std::optional<int> best;
  int longest = 0;
  if (!segmentation) return best;
  for (const align::Snippet& snippet : segmentation->snippets) {
    const auto& fragment = model.fragments[static_cast<std::size_t>(snippet.fragment)];
    if (fragment.content != take.content || snippet.end - snippet.begin <= longest) continue;
    longest = snippet.end - snippet.begin;
    best = snippet.fragment;
  }
  return best;
}

using Ranges = std::array<transfer::FactorRange, effort::kFactorCount>;

/// 5th to 95th percentile of each factor's predictions over all blends of a content.
Ranges target_ranges(const transfer::StyleModel& model, const std::string& content) {
  std::vector<double> alphas;
  for (int m = 0; m <= 15; ++m) alphas.push_back(blend::kMinAlpha + 0.1 * m);
  std::array<std::vector<double>, effort::kFactorCount> values;
  const int count = static_cast<int>(model.fragments.size());
  const auto fragment = [&](int n) { return model.fragments[static_cast<std::size_t>(n)]; };
  for (int i = 0; i < count; ++i) {
    if (fragment(i).content != content) continue;
    for (int j = i + 1; j < count; ++j) {
      if (fragment(j).content != content ||
          !align::blendable(fragment(i).pose.frame_count(), fragment(j).pose.frame_count()))
        continue;
      const effort::EffortMatrix curve = transfer::effort_curve(model, i, j, alphas);
      for (std::size_t f = 0; f < values.size(); ++f) {
        for (const double value : curve.row(static_cast<Eigen::Index>(f)))
          values[f].push_back(std::clamp(value, effort::kEffortMin, effort::kEffortMax));
      }
    }
  }
  Ranges ranges;
  for (std::size_t f = 0; f < ranges.size(); ++f)
    ranges[f] = {math::percentile(values[f], 5.0), math::percentile(values[f], 95.0)};
  return ranges;
}

struct Trial {
  effort::Factor factor;
  double asked = 0.0;
  effort::Effort before;
  effort::Effort predicted;
  effort::Effort measured;
};

/// A take that has a match, and what it is as the observer sees it.
struct Input {
  int fragment = 0;
  std::string content;
  effort::Effort before;
};

std::vector<Trial> trials_of(const transfer::StyleModel& model, const std::vector<Input>& inputs,
                             int targets, const transfer::SearchOptions& search, int tries) {
  std::map<std::string, Ranges> ranges;
  for (const Input& input : inputs) {
    if (!ranges.contains(input.content))
      ranges[input.content] = target_ranges(model, input.content);
  }
  std::vector<Trial> trials(static_cast<std::size_t>(targets) * effort::kFactorCount);
  math::parallel_for(static_cast<int>(trials.size()), 2, [&](int n) {
    base::Rng rng = base::Rng::for_stream(1, static_cast<std::uint64_t>(n));
    Trial& trial = trials[static_cast<std::size_t>(n)];
    trial.factor = effort::kFactors[static_cast<std::size_t>(n % effort::kFactorCount)];
    const auto f = static_cast<std::size_t>(effort::index_of(trial.factor));
    const Input& input =
        inputs[static_cast<std::size_t>(rng.index(static_cast<int>(inputs.size())))];
    const transfer::FactorRange range = ranges.at(input.content)[f];
    trial.asked = rng.uniform(range.low, range.high);
    trial.before = input.before;
    transfer::EffortTarget target;
    target.factors[f] = trial.asked;
    target.stay_near = input.before;
    transfer::PlayMemory memory(model);
    const auto chosen = transfer::choose_blend(memory, input.fragment, target, search, tries);
    trial.predicted = chosen.choice.predicted;
    trial.measured = chosen.measured.effort;
  });
  return trials;
}

void print(const std::vector<Trial>& trials) {
  std::printf("%-7s %6s %6s %10s %10s %6s %7s %6s\n", "factor", "trials", "rank r", "asked-meas",
              "asked-pred", "moves", "others", "ratio");
  for (const effort::Factor factor : effort::kFactors) {
    std::vector<double> asked, measured;
    double missed = 0.0, mispredicted = 0.0, moves = 0.0, others = 0.0;
    for (const Trial& trial : trials) {
      if (trial.factor != factor) continue;
      asked.push_back(trial.asked);
      measured.push_back(trial.measured[factor]);
      missed += std::abs(trial.asked - trial.measured[factor]);
      mispredicted += std::abs(trial.asked - trial.predicted[factor]);
      for (const effort::Factor any : effort::kFactors) {
        const double move = std::abs(trial.measured[any] - trial.before[any]);
        (any == factor ? moves : others) += any == factor ? move : 0.5 * move;
      }
    }
    const auto count = static_cast<double>(asked.size());
    std::printf("%-7s %6zu %6.3f %10.3f %10.3f %6.2f %7.2f %6.2f\n",
                std::string(effort::name_of(factor)).c_str(), asked.size(),
                math::spearman(asked, measured), missed / count, mispredicted / count,
                moves / count, others / count, others / moves);
  }
}

void run(const std::filesystem::path& folder, const std::string& pattern, int targets,
         const transfer::SearchOptions& search, int tries) {
  const std::vector<transfer::Fragment> takes =
      studies::fragments_of(studies::read_takes(folder, pattern));
  std::vector<std::string> performers;
  for (const auto& take : takes) {
    if (std::find(performers.begin(), performers.end(), take.performer) == performers.end())
      performers.push_back(take.performer);
  }
  std::vector<Trial> all;
  for (const std::string& performer : performers) {
    const transfer::StyleModel model = studies::model_without(takes, performer);
    std::vector<Input> inputs;
    int unmatched = 0;
    for (const auto& take : takes) {
      if (take.performer != performer) continue;
      const auto fragment = matching_fragment(model, take);
      if (!fragment) {
        ++unmatched;
        continue;
      }
      inputs.push_back(
          {*fragment, take.content,
           effort::observe(effort::describe(take.pose), model.observer, take.content).effort});
    }
    std::printf("%s: %zu takes matched, %d not\n", performer.c_str(), inputs.size(), unmatched);
    std::fflush(stdout);
    if (inputs.empty()) continue;
    const std::vector<Trial> trials = trials_of(model, inputs, targets, search, tries);
    all.insert(all.end(), trials.begin(), trials.end());
  }
  print(all);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(
        stderr,
        "usage: closed_loop_study FOLDER PATTERN [TARGETS] [CAUTION STAY NEIGHBOURS TRIES]\n");
    return 2;
  }
  try {
    transfer::SearchOptions search;
    if (argc > 4) search.caution = std::atof(argv[4]);
    if (argc > 5) search.stay = std::atof(argv[5]);
    if (argc > 6) search.neighbors = std::atoi(argv[6]);
    run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 20, search,
        argc > 7 ? std::atoi(argv[7]) : transfer::kTries);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "closed_loop_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
