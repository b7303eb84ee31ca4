#include "laban/texture/learn_texture.h"

#include <utility>

#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/pose_matrix.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

struct Corpus {
  ObservationSpace space;
  MatrixXd observations;
  std::vector<Take> takes;
};

/// All captures as observations in one space, at one rate, on one floor.
Corpus observe_all(std::span<const TextureSource> sources, const TextureRig& rig, double rate_hz,
                   int threads) {
  std::vector<motion::PoseMatrix> poses(sources.size());
  math::parallel_for(static_cast<int>(sources.size()), threads, [&](int n) {
    const auto cell = static_cast<std::size_t>(n);
    const motion::Capture& capture = sources[cell].capture;
    poses[cell] = motion::to_pose_matrix(motion::resample(capture.clip, rate_hz), capture.humanoid);
    if (n > 0)
      poses[cell] = standing_on_floor(rig, std::move(poses[cell]));  // the first is the rig's
  });
  Corpus corpus{learn_observation_space(poses), {}, {}};
  int frames = 0;
  for (std::size_t n = 0; n < sources.size(); ++n) {
    const int length = poses[n].frame_count();
    corpus.takes.push_back({sources[n].name, frames, length, sources[n].first_file_frame,
                            sources[n].capture.clip.frame_rate_hz() / rate_hz});
    frames += length;
  }
  corpus.observations.resize(kObservationRows, frames);
  for (std::size_t n = 0; n < sources.size(); ++n) {
    corpus.observations.middleCols(corpus.takes[n].begin, corpus.takes[n].length) =
        observe(corpus.space, poses[n]);
  }
  return corpus;
}

TextureRig make_rig(const motion::Capture& first, double rate_hz) {
  const motion::Clip clip = motion::resample(first.clip, rate_hz);
  return {clip.slice(0, 1), first.humanoid, motion::find_foot_contacts(clip, first.humanoid).floor};
}

LearntTexture assemble(const Corpus& corpus, const TextureRig& rig, double rate_hz,
                       const TextureLearning& options, LearntTextons learnt) {
  return {MotionTexture{corpus.space, rate_hz, rig.humanoid.leg_length_m(), options.min_frames,
                        corpus.observations, corpus.takes, std::move(learnt.segments),
                        std::move(learnt.textons), std::move(learnt.transition_counts), rig, "{}"},
          std::move(learnt.report)};
}

LearntTextons state_of(const LearntTexture& before, const Corpus& corpus,
                       const TextureLearning& options) {
  const MotionTexture& texture = before.texture;
  if (texture.observations.cols() != corpus.observations.cols() ||
      texture.min_frames != options.min_frames || texture.takes.size() != corpus.takes.size()) {
    throw Error(ErrorKind::kData,
                "learn_texture: the state to go on from is of other captures or options");
  }
  return {texture.textons, texture.segments, texture.transition_counts, before.report};
}

}  // namespace

LearntTexture learn_texture(std::span<const TextureSource> sources, const TextureLearning& options,
                            base::Progress* progress, const TextureListener& listener,
                            const LearntTexture* go_on) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (sources.empty()) throw Error(ErrorKind::kUsage, "learn_texture: there is no capture");
  const motion::Capture& first = sources.front().capture;
  const double rate_hz = options.frame_rate_hz.value_or(first.clip.frame_rate_hz());
  const TextureRig rig = make_rig(first, rate_hz);
  const Corpus corpus = observe_all(sources, rig, rate_hz, options.threads);
  RoundListener on_round;
  if (listener) {
    on_round = [&](const LearntTextons& state) {
      listener(assemble(corpus, rig, rate_hz, options, state));
    };
  }
  LearntTextons before;
  if (go_on != nullptr) before = state_of(*go_on, corpus, options);
  return assemble(corpus, rig, rate_hz, options,
                  learn_textons(corpus.observations, corpus.takes, options, progress, on_round,
                                go_on != nullptr ? &before : nullptr));
}

}  // namespace laban::texture
