// Do suggested labels teach more than random ones? The figure: choosing from a pool of 400
// measured blends, 60 labels should reach the mean error that 85 random ones do, on a fixed test
// set of 100, over 20 pools. Also printed: the error after fewer and more labels, both ways.
// Suggestions are made before the first label (they depend on no label), all at once, as
// `laban suggest` makes them.
//
// Usage: suggest_study FOLDER PATTERN [POOLS]
//   e.g. PATTERN 'dataset-1_{content}_{performer}_{take}'

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "laban/effort/style_regressor.h"
#include "laban/effort/suggestion.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/transfer/style_corpus.h"

#include "observed_corpus.h"
#include "takes.h"

namespace {

using namespace laban;

constexpr int kPool = 400;
constexpr int kTest = 100;
constexpr int kSuggested = 60;
constexpr int kRandom = 85;
constexpr std::array kLabels = {20, 40, kSuggested, kRandom, 105};
/// Pools are seeds 1, 2, ..; the test set is none of them.
constexpr std::uint64_t kTestSeed = 100000;

/// Blends of the fragments, measured, as what regressors learn from.
effort::StyleSamples measured_blends(const std::vector<transfer::Fragment>& fragments,
                                     std::span<const Eigen::VectorXd> coordinates, int count,
                                     std::uint64_t seed) {
  return transfer::style_samples(
      studies::observed_corpus(fragments, {.count = count, .seed = seed}), coordinates);
}

/// Mean squared error over factors and test blends after learning from some columns of a pool.
double error_after(const effort::StyleSamples& pool, std::span<const int> columns,
                   const effort::StyleSamples& test) {
  const auto regressor = effort::fit_default_regressor(pool.subset(columns));
  return (regressor.predict(test.features) - test.labels).array().square().mean();
}

struct Errors {
  std::array<double, kLabels.size()> random{};
  std::array<double, kLabels.size()> suggested{};
};

Errors errors_of(const effort::StyleSamples& pool, const effort::StyleSamples& test) {
  std::vector<int> suggested;
  for (const auto& suggestion :
       effort::suggest_blends(Eigen::MatrixXd(), pool.features, {.count = kLabels.back()}))
    suggested.push_back(suggestion.column);
  std::vector<int> random(static_cast<std::size_t>(kPool));  // blends are drawn in random order
  std::iota(random.begin(), random.end(), 0);
  Errors errors;
  for (std::size_t n = 0; n < kLabels.size(); ++n) {
    const auto count = static_cast<std::size_t>(kLabels[n]);
    errors.random[n] = error_after(pool, std::span(random).first(count), test);
    errors.suggested[n] = error_after(pool, std::span(suggested).first(count), test);
  }
  return errors;
}

void run(const std::string& folder, const std::string& pattern, int pools) {
  const auto fragments = studies::fragments_of(studies::read_takes(folder, pattern));
  const auto coordinates =
      transfer::content_coordinates(fragments, transfer::fit_corpus_content_map(fragments));
  const effort::StyleSamples test = measured_blends(fragments, coordinates, kTest, kTestSeed);
  std::vector<Errors> all(static_cast<std::size_t>(pools));
  math::parallel_for(pools, 2, [&](int n) {
    all[static_cast<std::size_t>(n)] = errors_of(
        measured_blends(fragments, coordinates, kPool, static_cast<std::uint64_t>(n) + 1), test);
  });
  std::printf("mean squared error of all factors, %d pools of %d, %d test blends\n", pools, kPool,
              kTest);
  std::printf("%-8s %10s %10s %24s\n", "labels", "random", "suggested", "suggested is better in");
  for (std::size_t n = 0; n < kLabels.size(); ++n) {
    std::vector<double> random, suggested;
    int better = 0;
    for (const Errors& errors : all) {
      random.push_back(errors.random[n]);
      suggested.push_back(errors.suggested[n]);
      better += suggested.back() < random.back() ? 1 : 0;
    }
    std::printf("%-8d %10.4f %10.4f %21d of %d\n", kLabels[n], math::mean(random),
                math::mean(suggested), better, pools);
  }
  const auto mean_of = [&](auto member, int labels) {
    const auto n = static_cast<std::size_t>(std::find(kLabels.begin(), kLabels.end(), labels) -
                                            kLabels.begin());
    std::vector<double> values;
    for (const Errors& errors : all) values.push_back((errors.*member)[n]);
    return math::mean(values);
  };
  const double suggested = mean_of(&Errors::suggested, kSuggested);
  const double random = mean_of(&Errors::random, kRandom);
  std::printf("%d suggested %.4f, %d random %.4f: the bar is %s\n", kSuggested, suggested, kRandom,
              random, suggested <= random ? "reached" : "missed");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: suggest_study FOLDER PATTERN [POOLS]\n");
    return 2;
  }
  try {
    run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 20);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "suggest_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
