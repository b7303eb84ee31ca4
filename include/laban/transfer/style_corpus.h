#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/blend/space_time_interpolation.h"
#include "laban/effort/effort.h"
#include "laban/effort/style_regressor.h"
#include "laban/motion/pose_matrix.h"

namespace laban::transfer {

/// One piece of motion capture that shows one action, and what is known of it.
struct Fragment {
  std::string name;       ///< unique in its corpus
  std::string content;    ///< what is done: "walk"; fragments of one name may be blended
  std::string performer;  ///< who does it
  motion::PoseMatrix pose;
  std::optional<effort::Effort> effort;  ///< its label, if it has one
};

/// A space-time interpolation of two fragments, and its label, if it has one. A blend stands once
/// for each label that it is to be learnt from: the same name, parents and alpha, another label.
struct CorpusBlend {
  std::string name;
  int fragment_i = 0;
  int fragment_j = 0;
  double alpha = 0.0;  ///< in [-0.25, 1.25]; 0 is fragment i
  std::optional<effort::Effort> effort;
  /// How much the label counts beside those of other blends, > 0: the confidence behind it. Only
  /// ratios of weights matter.
  double weight = 1.0;
};

/// The examples that style transfer works by: fragments, and blends of them that were labelled.
///
/// All fragments have one frame rate.
struct StyleCorpus {
  std::vector<Fragment> fragments;
  std::vector<CorpusBlend> blends;
  /// Factors that every label gives: flow, weight, time, or those and space.
  int factor_count = effort::kFactorCount;

  /// @throws Error{kData} naming the first fragment or blend that breaks a rule: no fragments,
  ///         different frame rates, parents out of range or of different content, alpha or weight
  ///         out of range.
  void check() const;
};

/// Names as numbers 0, 1, .. in order of first appearance.
struct Numbering {
  std::vector<int> numbers;        ///< one an item
  std::vector<std::string> names;  ///< of number 0, 1, ..
};

/// Content groups of the fragments.
[[nodiscard]] Numbering number_contents(std::span<const Fragment> fragments);
/// Performers of the fragments; fragments without a name are each their own performer's.
[[nodiscard]] Numbering number_performers(std::span<const Fragment> fragments);
/// The pose matrices of the fragments.
[[nodiscard]] std::vector<motion::PoseMatrix> poses_of(std::span<const Fragment> fragments);

/// Which frames of two clips of one content show the same moment: DTW of the joint angles, each
/// relative to its own clip's mean pose (ours: a stoop would outweigh a wave, DESIGN 5). It depends
/// on the two clips alone, so a blend is the same whatever database it stands in.
/// @throws Error{kData} if their lengths are not align::blendable.
[[nodiscard]] std::vector<align::FramePair> path_between(const motion::PoseMatrix& clip_i,
                                                         const motion::PoseMatrix& clip_j);

/// Aligns two clips of one content for blending, by the time warp of the path between them.
/// @throws as path_between; Error{kData} if their rates differ.
[[nodiscard]] blend::BlendPair align_pair(const motion::PoseMatrix& clip_i,
                                          const motion::PoseMatrix& clip_j,
                                          const align::TimeWarpOptions& warp = {});

/// The blend of two fragments of the corpus, made into motion.
[[nodiscard]] blend::Blend make_blend(std::span<const Fragment> fragments,
                                      const CorpusBlend& blend);

struct DrawBlendsOptions {
  int count = 105;  ///< blends to draw [Torresani06, 6]
  std::uint64_t seed = 1;
};

/// Draws blends to be labelled: random pairs of fragments with one content whose lengths are
/// blendable, no pair twice until all have been drawn, in random order, at uniform random alpha in
/// [-0.25, 1.25] (METHODS 1.4). Their names are blend_001, blend_002, ..
/// @throws Error{kUsage} if count < 0; Error{kData} if there is no such pair.
[[nodiscard]] std::vector<CorpusBlend> draw_blends(std::span<const Fragment> fragments,
                                                   const DrawBlendsOptions& options = {});

/// Content coordinates of a corpus's fragments: what the regressors know of what is done.
/// The angles of all fragments are put on the branches of their common mean pose first.
[[nodiscard]] std::vector<Eigen::VectorXd> content_coordinates(std::span<const Fragment> fragments,
                                                               const effort::ContentMap& map);
/// The mean pose of all frames of all fragments, 63 angles, radians: whose branches angles are put
/// on before they are compared.
[[nodiscard]] Eigen::VectorXd mean_pose(std::span<const Fragment> fragments);
/// Content coordinates of a motion beside a corpus with that mean pose, as of its own fragments.
[[nodiscard]] Eigen::VectorXd content_coordinates(const motion::PoseMatrix& pose,
                                                  const Eigen::VectorXd& mean_pose,
                                                  const effort::ContentMap& map);
/// The content map of a corpus: PCA of its stretched fragments (METHODS 1.3).
[[nodiscard]] effort::ContentMap fit_corpus_content_map(
    std::span<const Fragment> fragments, const effort::ContentMapOptions& options = {});

/// Coordinates of all fragments by the map that some of them would give: principal components and
/// branches are those of the fragments `known` alone, as if the others were met later.
/// @param known  indices of fragments, at least one.
[[nodiscard]] std::vector<Eigen::VectorXd> coordinates_known_to(
    std::span<const Fragment> fragments, std::span<const int> known,
    const effort::ContentMapOptions& options = {});

/// The rows that regressors learn from: one a labelled blend; several labels of one blend are one
/// group, with the factors of the corpus. Weights are scaled to a mean of 1, so that equal ones are
/// the same as none and the loss weights of the regressors' grids keep their meaning.
/// @param coordinates  of each fragment, from content_coordinates.
/// @throws Error{kData} naming a blend or a parent of one that has no label.
[[nodiscard]] effort::StyleSamples style_samples(const StyleCorpus& corpus,
                                                 std::span<const Eigen::VectorXd> coordinates);

}  // namespace laban::transfer
