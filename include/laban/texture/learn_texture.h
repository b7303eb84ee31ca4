#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/base/progress.h"
#include "laban/motion/humanoid.h"
#include "laban/texture/motion_texture.h"
#include "laban/texture/texton_fit.h"

namespace laban::texture {

struct TextureLearning {
  /// Rate of the texture; nullopt: the first capture's.
  std::optional<double> frame_rate_hz;
  /// Shortest segment, T_min, >= 3: about a second ([Li02]: 60 frames at 60 Hz).
  int min_frames = 60;
  /// Greedy start: root mean square one-step error of an observation row (radians) up to which a
  /// texton is extended and used again; nullopt: chosen by BIC.
  std::optional<double> threshold;
  /// So many textons to begin with (learning may leave some without a segment); the threshold is
  /// then found. Not together with `threshold`.
  std::optional<int> textons;
  TextonFit fit;
  int max_rounds = 200;
  int threads = 0;  ///< 0: all cores

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// One round of hard EM: search, then fit.
struct LearningRound {
  double log_likelihood = 0.0;  ///< of observations, labels and cuts after the round
  int changed_frames = 0;       ///< frames that went to another texton
  int changed_cuts = 0;         ///< cuts where there was none before
  int refits = 0;               ///< textons fitted anew
  int refused_refits = 0;       ///< that would have lowered the likelihood of their own segments
  int textons = 0;              ///< left with a segment
};

/// A start that was compared.
struct LearningCandidate {
  double threshold = 0.0;
  int textons = 0;
  double log_likelihood = 0.0;
  double bic = 0.0;  ///< less is better
};

enum class LearningEnd { kConverged, kMaxRounds };

struct LearningReport {
  LearningEnd end = LearningEnd::kMaxRounds;
  double threshold = 0.0;                     ///< of the start, as given or found
  std::vector<LearningCandidate> candidates;  ///< compared for it; empty if it was given
  double start_log_likelihood = 0.0;          ///< before the first round
  int start_textons = 0;
  std::vector<LearningRound> rounds;
  double bic = 0.0;
};

/// What is learnt of plain observations.
struct LearntTextons {
  std::vector<Texton> textons;
  std::vector<Segment> segments;  ///< of all takes in order
  Eigen::MatrixXd transition_counts;
  LearningReport report;
};

/// Told after each round; to keep the state of long learning.
using RoundListener = std::function<void(const LearntTextons&)>;

/// log P(Y, L, H | textons, M): every segment's start and steps, and every label's log M after the
/// one before it in its take. Exact, in double.
[[nodiscard]] double log_likelihood(const Eigen::MatrixXd& observations,
                                    const std::vector<Take>& takes,
                                    const std::vector<Segment>& segments,
                                    const std::vector<Texton>& textons,
                                    const Eigen::Ref<const Eigen::MatrixXd>& transition_counts);

/// Bayesian information criterion of a state: -2 log-likelihood plus log(N) for each parameter of
/// its textons and each transition seen, N the frames of the corpus. (Charged by the log of a
/// texton's own frames alone, as mixtures may be, a texton for every second of motion would win.)
[[nodiscard]] double bayesian_information(const LearntTextons& learnt, double log_likelihood);

/// Hard EM over labels, cuts and textons (METHODS 2.2): greedy start, then rounds of exact search
/// and closed-form fit until no label or cut changes, or the relative gain is below 1e-6. The
/// log-likelihood never falls from round to round.
///
/// @param observations  d x N, finite. @param takes  cover its columns without gap, each at least
///                      three frames; nothing is learnt across two.
/// @param go_on         state of an earlier run on the same observations to go on from; null: none.
/// @throws Error{kUsage} if options have problems or `progress` says stop; Error{kData} for takes
///         that are too short or do not fit.
[[nodiscard]] LearntTextons learn_textons(const Eigen::MatrixXd& observations,
                                          const std::vector<Take>& takes,
                                          const TextureLearning& options,
                                          base::Progress* progress = nullptr,
                                          const RoundListener& listener = {},
                                          const LearntTextons* go_on = nullptr);

/// A capture to learn from.
struct TextureSource {
  std::string name;          ///< file as it was given
  motion::Capture capture;   ///< without T-pose frame, as motion::find_capture gives it
  int first_file_frame = 0;  ///< frame of the file that is the capture's first
};

struct LearntTexture {
  MotionTexture texture;
  LearningReport report;
};

using TextureListener = std::function<void(const LearntTexture&)>;

/// Learns a motion texture from captures [Li02]. Captures at another rate than the first's (or the
/// one asked for) are resampled; those on other rigs are seen as poses of the standard body.
/// @param go_on  an earlier state of the same captures and options; null: none.
/// @throws as learn_textons; Error{kUsage} if there is no capture; Error{kData} if `go_on` is not
///         of these captures.
[[nodiscard]] LearntTexture learn_texture(std::span<const TextureSource> sources,
                                          const TextureLearning& options = {},
                                          base::Progress* progress = nullptr,
                                          const TextureListener& listener = {},
                                          const LearntTexture* go_on = nullptr);

}  // namespace laban::texture
