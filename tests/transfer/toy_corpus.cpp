#include "toy_corpus.h"

#include <cmath>
#include <numbers>

namespace laban::test {
namespace {

constexpr double kRateHz = 60.0;

effort::Effort label(double size, double tempo) {
  return {1.5 * (size - 1.0) * (tempo - 1.0) * 4.0, 3.0 * (size - 1.0), 3.0 * (tempo - 1.0)};
}

transfer::StyleCorpus measured_toy_corpus() {
  transfer::StyleCorpus corpus = toy_corpus();
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
    const motion::PoseMatrix pose = transfer::make_blend(corpus.fragments, blend).pose;
    blend.effort = effort::observe(effort::describe(pose), reference,
                                   contents[static_cast<std::size_t>(blend.fragment_i)])
                       .effort;
  }
  return corpus;
}

}  // namespace

motion::PoseMatrix toy_clip(bool circle, double size, double tempo, double stoop_rad) {
  const int frames = static_cast<int>(std::lround(60.0 / tempo));
  motion::PoseMatrix pose{kRateHz, 0.8, Eigen::MatrixXd::Zero(motion::kAngleRowCount, frames),
                          Eigen::RowVectorXd::Constant(frames, 1.15),
                          Eigen::Matrix3Xd::Zero(3, frames)};
  const auto row = [](motion::StandardJoint joint, int axis) {
    return 3 * motion::index_of(joint) + axis;
  };
  for (int f = 0; f < frames; ++f) {
    const double phase = 2.0 * std::numbers::pi * f / (frames - 1);
    pose.angles(row(motion::StandardJoint::kSpine, 0), f) = stoop_rad;
    if (circle) {
      pose.angles(row(motion::StandardJoint::kLeftUpperArm, 1), f) = size * std::sin(phase);
      pose.angles(row(motion::StandardJoint::kLeftUpperArm, 2), f) =
          size * (1.0 - std::cos(phase)) / 2.0;
    } else {
      pose.angles(row(motion::StandardJoint::kRightThigh, 0), f) = -0.8 * size * std::sin(phase);
      pose.angles(row(motion::StandardJoint::kRightShin, 0), f) =
          0.5 * size * (1.0 - std::cos(phase));
      pose.steps(1, f) = 0.01 * size;
    }
  }
  return pose;
}

transfer::StyleCorpus toy_corpus(int blends) {
  transfer::StyleCorpus corpus;
  const double sizes[] = {0.6, 0.8, 1.0, 1.2, 1.4, 0.9};
  const double tempos[] = {1.3, 0.7, 1.0, 1.2, 0.8, 1.4};
  for (const bool circle : {false, true}) {
    for (std::size_t p = 0; p < std::size(sizes); ++p) {
      const std::string content = circle ? "circle" : "swing";
      const std::string performer = "p" + std::to_string(p);
      corpus.fragments.push_back(
          {content + "_" + performer, content, performer,
           toy_clip(circle, sizes[p], tempos[p], 0.1 * (static_cast<double>(p) - 2.5)),
           label(sizes[p], tempos[p])});
    }
  }
  corpus.blends = transfer::draw_blends(corpus.fragments, {.count = blends, .seed = 3});
  for (transfer::CorpusBlend& blend : corpus.blends) {
    const auto i = static_cast<std::size_t>(blend.fragment_i) % std::size(sizes);
    const auto j = static_cast<std::size_t>(blend.fragment_j) % std::size(sizes);
    blend.effort = label((1.0 - blend.alpha) * sizes[i] + blend.alpha * sizes[j],
                         (1.0 - blend.alpha) * tempos[i] + blend.alpha * tempos[j]);
  }
  return corpus;
}

const transfer::StyleModel& toy_model() {
  static const transfer::StyleModel model = transfer::train_style_model(toy_corpus());
  return model;
}

const transfer::StyleModel& measured_toy_model() {
  static const transfer::StyleModel model = transfer::train_style_model(measured_toy_corpus());
  return model;
}

}  // namespace laban::test
