// Does a left-out performer (or style), restyled to a single-factor target, measure what was asked?
// The figures: asked against measured after synthesis, and how far the two factors move
// that were not asked for. Every performer is left out in turn (database, metric, regressor and
// observer know nothing of him); his takes are matched by segmentation, as apply does; targets are
// uniform between the 5th and 95th percentile of the factor's predictions over all blends of the
// content.
//
// Usage: closed_loop_study FOLDER PATTERN [TARGETS A FACTOR AND PERFORMER] [CAUTION STAY
// NEIGHBOURS]
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
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/effort/observer.h"
#include "laban/io/clip_file.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/style_corpus.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/style_search.h"

#include "name_pattern.h"

namespace {

using namespace laban;
using studies::match;

constexpr int kBlends = 105;
constexpr double kMostRateHz = 60.0;

std::vector<transfer::Fragment> read_takes(const std::filesystem::path& folder,
                                           const std::string& pattern) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (io::is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<transfer::Fragment> takes;
  for (const auto& file : files) {
    const auto fields = match(pattern, file.stem().string());
    if (fields.empty()) continue;
    const motion::Capture capture = motion::find_capture(io::read_clip(file).clip);
    const motion::PoseMatrix pose =
        motion::resample(motion::to_pose_matrix(capture.clip, capture.humanoid),
                         std::min(kMostRateHz, capture.clip.frame_rate_hz()));
    takes.push_back(
        {file.stem().string(), fields.at("content"), fields.at("performer"), pose, std::nullopt});
  }
  if (takes.empty()) throw base::Error(base::ErrorKind::kUsage, "no file fits the pattern");
  return takes;
}

/// A model of all takes but one performer's, labelled by the observer.
transfer::StyleModel model_without(const std::vector<transfer::Fragment>& takes,
                                   const std::string& performer) {
  transfer::StyleCorpus corpus;
  for (const transfer::Fragment& take : takes) {
    if (take.performer != performer) corpus.fragments.push_back(take);
  }
  corpus.blends = transfer::draw_blends(corpus.fragments, {.count = kBlends, .seed = 1});
  std::vector<effort::Descriptors> descriptors;
  std::vector<std::string> contents;
  for (const transfer::Fragment& fragment : corpus.fragments) {
    descriptors.push_back(effort::describe(fragment.pose));
    contents.push_back(fragment.content);
  }
  const auto reference = effort::fit_observer_reference(descriptors, contents);
  for (std::size_t n = 0; n < corpus.fragments.size(); ++n)
    corpus.fragments[n].effort = effort::observe(descriptors[n], reference, contents[n]).effort;
  for (transfer::CorpusBlend& blend : corpus.blends) {
    const auto made = transfer::make_blend(corpus.fragments, blend);
    blend.effort = effort::observe(effort::describe(made.pose), reference,
                                   contents[static_cast<std::size_t>(blend.fragment_i)])
                       .effort;
  }
  transfer::TrainOptions options;
  options.threads = 2;
  return transfer::train_style_model(corpus, options);
}

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
                             int targets, const transfer::SearchOptions& search) {
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
    const auto choice = transfer::search_blend(model, input.fragment, target, search);
    trial.predicted = choice.predicted;
    trial.measured = effort::observe(effort::describe(transfer::play_choice(model, choice).pose),
                                     model.observer, input.content)
                         .effort;
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
         const transfer::SearchOptions& search) {
  const std::vector<transfer::Fragment> takes = read_takes(folder, pattern);
  std::vector<std::string> performers;
  for (const auto& take : takes) {
    if (std::find(performers.begin(), performers.end(), take.performer) == performers.end())
      performers.push_back(take.performer);
  }
  std::vector<Trial> all;
  for (const std::string& performer : performers) {
    const transfer::StyleModel model = model_without(takes, performer);
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
    const std::vector<Trial> trials = trials_of(model, inputs, targets, search);
    all.insert(all.end(), trials.begin(), trials.end());
  }
  print(all);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr,
                 "usage: closed_loop_study FOLDER PATTERN [TARGETS] [CAUTION STAY NEIGHBOURS]\n");
    return 2;
  }
  try {
    transfer::SearchOptions search;
    if (argc > 4) search.caution = std::atof(argv[4]);
    if (argc > 5) search.stay = std::atof(argv[5]);
    if (argc > 6) search.neighbors = std::atoi(argv[6]);
    run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 20, search);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "closed_loop_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
