#include "texture/term_kernels.h"

#include <gtest/gtest.h>

#include "samples.h"
#include "texture/term_table.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Corpus of three takes, and textons of several sizes fitted to parts of it.
struct Sample {
  test::KnownCorpus corpus = test::known_corpus(3, 3, 4, 5);
  std::vector<Texton> textons;

  Sample() {
    for (const int states : {1, 4, 5, 11}) {
      const Segment part{0, 150 + 20 * states, 0};
      textons.push_back(fit_texton(corpus.observations, {&part, 1},
                                   {.min_dimension = states, .max_dimension = states}));
    }
  }
};

// Oracle: TextonLikelihood, in double. Floats keep 7 digits of sums of some hundred terms.
TEST(TermTable, GivesTheLikelihoodTermsOfEveryTake) {
  const Sample sample;
  const FloatObservations y(sample.corpus.observations);
  TermTable table(y, sample.corpus.takes, 2);
  table.set_textons(sample.textons, std::vector<int>(sample.textons.size(), -1));
  for (const Take& take : sample.corpus.takes) {
    TermBlock block;
    const int half = take.length / 2;
    for (const auto& [begin, end] : {std::pair(0, half), std::pair(half, take.length)}) {
      table.source(take)(begin, end, block);
      for (std::size_t i = 0; i < sample.textons.size(); ++i) {
        const TextonLikelihood exact(sample.textons[i]);
        const auto frames = sample.corpus.observations.middleCols(take.begin, take.length);
        const VectorXd step = exact.step_terms(frames);
        const VectorXd start = exact.start_terms(frames);
        for (int t = begin; t < end; ++t) {
          const auto row = static_cast<Index>(i);
          EXPECT_NEAR(block.step(row, t - begin), step[t], 2e-5 * std::abs(step[t]) + 2e-2);
          EXPECT_NEAR(block.start(row, t - begin), start[t], 2e-5 * std::abs(start[t]) + 4e-2);
        }
      }
    }
  }
}

TEST(TermTable, KeptTextonsHaveTheTermsTheyHad) {
  const Sample sample;
  const FloatObservations y(sample.corpus.observations);
  const Take& take = sample.corpus.takes[1];
  TermTable table(y, sample.corpus.takes, 1);
  table.set_textons(sample.textons, std::vector<int>(sample.textons.size(), -1));
  TermBlock before;
  table.source(take)(0, take.length, before);
  table.set_textons({sample.textons[3], sample.textons[1]}, {3, -1});
  TermBlock after;
  table.source(take)(0, take.length, after);
  EXPECT_EQ(after.step.row(0), before.step.row(3));
  EXPECT_EQ(after.start.row(1), before.start.row(1));
}

TEST(TextonPack, PredictionErrorsAreThoseOfTheObservations) {
  const Sample sample;
  const MatrixXd& observations = sample.corpus.observations;
  const FloatObservations y(observations);
  for (const Texton& texton : sample.textons) {
    const TextonPack pack(texton, y.mean, false);
    std::vector<double> errors(300);
    pack.squared_errors(y, 2, 302, errors.data());
    const MatrixXd frames = observations.leftCols(302);
    const VectorXd exact = (frames - one_step_predictions(texton, frames)).colwise().squaredNorm();
    for (int t = 0; t < 300; ++t)
      EXPECT_NEAR(errors[static_cast<std::size_t>(t)], exact[t + 2], 1e-4 * exact[t + 2] + 1e-4);
  }
}

// Both builds of the loops add in the same order; only fused rounding differs.
TEST(TermKernels, TheNewerMachinesSayWhatTheBaselineSays) {
  const Sample sample;
  const Texton& texton = sample.textons[3];
  constexpr int kRows = 20;
  std::vector<float> tile(kRows * kTileColumns);
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kTileColumns; ++c)
      tile[static_cast<std::size_t>(r * kTileColumns + c)] =
          static_cast<float>(sample.corpus.observations(r, c));
  }
  const MatrixXd basis = texton.basis.transpose();
  // One group of rows, as the kernels take them: the first five states.
  std::vector<float> values;
  for (int k = 0; k < kRows; ++k)
    for (int r = 0; r < kGroupRows; ++r) values.push_back(static_cast<float>(basis(r, k)));
  const std::vector<float> bias(kGroupRows, 0.25F);
  const int columns = kRows;
  const PackedRows rows{values.data(), bias.data(), &columns, kGroupRows, kRows};
  std::vector<float> step(3 * kGroupRows * kGroupRows, 0.125F);
  const int step_columns = 3 * kGroupRows;
  const std::vector<float> mean(kRows, 0.5F);
  PackedTexton packed;
  packed.rows = kRows;
  packed.states = kGroupRows;
  packed.mean = mean.data();
  packed.basis = rows;
  packed.step = {step.data(), bias.data(), &step_columns, kGroupRows, step_columns};
  const auto run = [&](const TermKernels& kernels) {
    std::vector<float> out(3 * kTileColumns, 0.0F);
    kernels.energies(packed, tile.data(), kTileColumns,
                     {out.data(), out.data() + kTileColumns, out.data() + 2 * kTileColumns});
    return out;
  };
  const std::vector<float> baseline = run(baseline_term_kernels());
  const std::vector<float> best = run(term_kernels());
  for (std::size_t n = 0; n < baseline.size(); ++n)
    EXPECT_NEAR(best[n], baseline[n], 1e-4F * std::abs(baseline[n]) + 1e-4F);
}

}  // namespace
}  // namespace laban::texture
