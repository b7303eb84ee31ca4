#include "laban/transfer/style_corpus.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <tuple>

#include "laban/align/content_metric.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

void require(bool holds, const std::string& what) {
  if (!holds) throw Error(ErrorKind::kData, what);
}

template <typename NameOf>
Numbering number(std::span<const Fragment> fragments, const NameOf& name_of) {
  Numbering numbering;
  std::map<std::string, int> known;
  for (const Fragment& fragment : fragments) {
    const std::string name = name_of(fragment);
    const auto [entry, is_new] = known.try_emplace(name, static_cast<int>(known.size()));
    if (is_new) numbering.names.push_back(name);
    numbering.numbers.push_back(entry->second);
  }
  return numbering;
}

std::vector<int> all_of(std::span<const Fragment> fragments) {
  std::vector<int> indices(fragments.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

/// The mean of all frames of some fragments' angles.
Eigen::VectorXd mean_angles(std::span<const Fragment> fragments, std::span<const int> known) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(motion::kAngleRowCount);
  int frames = 0;
  for (const int n : known) {
    const motion::PoseMatrix& pose = fragments[static_cast<std::size_t>(n)].pose;
    sum += pose.angles.rowwise().sum();
    frames += pose.frame_count();
  }
  return sum / frames;
}

/// Angles of every fragment on the branches of the mean pose of some of them.
std::vector<Eigen::MatrixXd> angles_on_one_branch(std::span<const Fragment> fragments,
                                                  std::span<const int> known) {
  const Eigen::VectorXd mean = mean_angles(fragments, known);
  std::vector<Eigen::MatrixXd> angles;
  for (const Fragment& fragment : fragments)
    angles.push_back(align::on_branch_of(fragment.pose.angles, mean));
  return angles;
}

std::string blend_name(int index) {
  char name[32];
  std::snprintf(name, sizeof name, "blend_%03d", index);
  return name;
}

/// Number of each blend; labels of one blend share it. Empty if every blend has one label.
std::vector<int> groups_of(std::span<const CorpusBlend> blends) {
  std::map<std::tuple<std::string, int, int, double>, int> known;
  std::vector<int> groups;
  for (const CorpusBlend& blend : blends) {
    const auto at = known.try_emplace({blend.name, blend.fragment_i, blend.fragment_j, blend.alpha},
                                      static_cast<int>(known.size()));
    groups.push_back(at.first->second);
  }
  if (known.size() == blends.size()) groups.clear();
  return groups;
}

/// Weights of mean 1; empty if all are equal.
Eigen::VectorXd weights_of(std::span<const CorpusBlend> blends) {
  Eigen::VectorXd weights(static_cast<Eigen::Index>(blends.size()));
  for (Eigen::Index n = 0; n < weights.size(); ++n) {
    weights[n] = blends[static_cast<std::size_t>(n)].weight;
  }
  if ((weights.array() == weights[0]).all()) return {};
  return weights / weights.mean();
}

}  // namespace

void StyleCorpus::check() const {
  require(!fragments.empty(), "corpus: it has no fragments");
  for (const Fragment& fragment : fragments) {
    require(fragment.pose.frame_rate_hz == fragments.front().pose.frame_rate_hz,
            "corpus: fragment '" + fragment.name + "' has another frame rate than the first one");
  }
  const int count = static_cast<int>(fragments.size());
  for (const CorpusBlend& blend : blends) {
    const std::string place = "corpus: blend '" + blend.name + "': ";
    require(blend.fragment_i >= 0 && blend.fragment_i < count && blend.fragment_j >= 0 &&
                blend.fragment_j < count,
            place + "a parent is out of range");
    require(fragments[static_cast<std::size_t>(blend.fragment_i)].content ==
                fragments[static_cast<std::size_t>(blend.fragment_j)].content,
            place + "its parents differ in content");
    require(blend.alpha >= blend::kMinAlpha && blend.alpha <= blend::kMaxAlpha,
            place + "alpha must be in [-0.25, 1.25]");
    require(blend.weight > 0.0 && std::isfinite(blend.weight), place + "weight must be > 0");
  }
}

Numbering number_contents(std::span<const Fragment> fragments) {
  return number(fragments, [](const Fragment& fragment) { return fragment.content; });
}

Numbering number_performers(std::span<const Fragment> fragments) {
  return number(fragments, [](const Fragment& fragment) {
    return fragment.performer.empty() ? "(" + fragment.name + ")" : fragment.performer;
  });
}

std::vector<motion::PoseMatrix> poses_of(std::span<const Fragment> fragments) {
  std::vector<motion::PoseMatrix> poses;
  for (const Fragment& fragment : fragments) poses.push_back(fragment.pose);
  return poses;
}

std::vector<align::FramePair> path_between(const motion::PoseMatrix& clip_i,
                                           const motion::PoseMatrix& clip_j) {
  require(align::blendable(clip_i.frame_count(), clip_j.frame_count()),
          "clips of " + std::to_string(clip_i.frame_count()) + " and " +
              std::to_string(clip_j.frame_count()) +
              " frames cannot be blended: one may be at most 4 times as long as the other");
  const Eigen::VectorXd mean_i = clip_i.angles.rowwise().mean();
  const Eigen::MatrixXd angles_j = align::on_branch_of(clip_j.angles, mean_i);
  const Eigen::VectorXd mean_j = angles_j.rowwise().mean();
  return align::dtw(clip_i.angles.colwise() - mean_i, angles_j.colwise() - mean_j).path;
}

blend::BlendPair align_pair(const motion::PoseMatrix& clip_i, const motion::PoseMatrix& clip_j,
                            const align::TimeWarpOptions& warp) {
  return {clip_i, clip_j, align::warp_of_path(path_between(clip_i, clip_j), warp)};
}

blend::Blend make_blend(std::span<const Fragment> fragments, const CorpusBlend& blend) {
  return blend::blend(align_pair(fragments[static_cast<std::size_t>(blend.fragment_i)].pose,
                                 fragments[static_cast<std::size_t>(blend.fragment_j)].pose),
                      blend.alpha);
}

std::vector<CorpusBlend> draw_blends(std::span<const Fragment> fragments,
                                     const DrawBlendsOptions& options) {
  if (options.count < 0) throw Error(ErrorKind::kUsage, "DrawBlendsOptions::count must be >= 0");
  std::vector<CorpusBlend> pairs;
  for (int i = 0; i < static_cast<int>(fragments.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(fragments.size()); ++j) {
      const Fragment& a = fragments[static_cast<std::size_t>(i)];
      const Fragment& b = fragments[static_cast<std::size_t>(j)];
      if (a.content == b.content && align::blendable(a.pose.frame_count(), b.pose.frame_count())) {
        pairs.push_back({"", i, j, 0.0, std::nullopt});
      }
    }
  }
  require(!pairs.empty() || options.count == 0, "no two fragments of one content can be blended");
  base::Rng rng(options.seed);
  std::vector<CorpusBlend> drawn;
  std::vector<int> order;
  while (static_cast<int>(drawn.size()) < options.count) {
    if (order.empty()) order = rng.permutation(static_cast<int>(pairs.size()));
    CorpusBlend blend = pairs[static_cast<std::size_t>(order.back())];
    order.pop_back();
    if (rng.uniform() < 0.5) std::swap(blend.fragment_i, blend.fragment_j);
    // Four decimals: a label table holds alpha, and should be readable.
    blend.alpha = std::round(1e4 * rng.uniform(blend::kMinAlpha, blend::kMaxAlpha)) / 1e4;
    blend.name = blend_name(static_cast<int>(drawn.size()) + 1);
    drawn.push_back(blend);
  }
  return drawn;
}

std::vector<Eigen::VectorXd> content_coordinates(std::span<const Fragment> fragments,
                                                 const effort::ContentMap& map) {
  std::vector<Eigen::VectorXd> coordinates;
  for (const Eigen::MatrixXd& angles : angles_on_one_branch(fragments, all_of(fragments))) {
    coordinates.push_back(map.coordinates(angles));
  }
  return coordinates;
}

Eigen::VectorXd mean_pose(std::span<const Fragment> fragments) {
  return mean_angles(fragments, all_of(fragments));
}

Eigen::VectorXd content_coordinates(const motion::PoseMatrix& pose,
                                    const Eigen::VectorXd& mean_pose,
                                    const effort::ContentMap& map) {
  return map.coordinates(align::on_branch_of(pose.angles, mean_pose));
}

effort::ContentMap fit_corpus_content_map(std::span<const Fragment> fragments,
                                          const effort::ContentMapOptions& options) {
  return effort::fit_content_map(angles_on_one_branch(fragments, all_of(fragments)), options);
}

std::vector<Eigen::VectorXd> coordinates_known_to(std::span<const Fragment> fragments,
                                                  std::span<const int> known,
                                                  const effort::ContentMapOptions& options) {
  require(!known.empty(), "content coordinates: no fragment is known, at least one");
  const std::vector<Eigen::MatrixXd> angles = angles_on_one_branch(fragments, known);
  std::vector<Eigen::MatrixXd> seen;
  for (const int n : known) seen.push_back(angles[static_cast<std::size_t>(n)]);
  const effort::ContentMap map = effort::fit_content_map(seen, options);
  std::vector<Eigen::VectorXd> coordinates;
  for (const Eigen::MatrixXd& one : angles) coordinates.push_back(map.coordinates(one));
  return coordinates;
}

effort::StyleSamples style_samples(const StyleCorpus& corpus,
                                   std::span<const Eigen::VectorXd> coordinates) {
  const auto label_of = [&corpus](const auto& item) {
    require(item.effort.has_value(),
            "'" + item.name + "' has no Effort label; every blend and its parents need one");
    return effort::to_vector(*item.effort, corpus.factor_count);
  };
  effort::StyleSamples samples;
  const auto count = static_cast<Eigen::Index>(corpus.blends.size());
  require(count > 0,
          "the corpus has no blends to learn from; draw some with 'laban corpus --blends'");
  samples.features.resize(
      effort::feature_count(static_cast<int>(coordinates.front().size()), corpus.factor_count),
      count);
  samples.labels.resize(corpus.factor_count, count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const CorpusBlend& blend = corpus.blends[static_cast<std::size_t>(n)];
    const auto i = static_cast<std::size_t>(blend.fragment_i);
    const auto j = static_cast<std::size_t>(blend.fragment_j);
    samples.features.col(n) =
        effort::style_features(coordinates[i], coordinates[j], label_of(corpus.fragments[i]),
                               label_of(corpus.fragments[j]), blend.alpha);
    samples.labels.col(n) = label_of(blend);
  }
  samples.groups = groups_of(corpus.blends);
  samples.weights = weights_of(corpus.blends);
  return samples;
}

}  // namespace laban::transfer
