#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/texture/texton_fit.h"

namespace laban::texture::test {

inline Eigen::MatrixXd normal_matrix(Eigen::Index rows, Eigen::Index cols, base::Rng& rng) {
  Eigen::MatrixXd x(rows, cols);
  for (double& value : x.reshaped()) value = rng.normal();
  return x;
}

/// m states that swing about their offsets, each with its own period and damping, driven by noise
/// of deviation `noise`.
inline LinearDynamics swinging(int m, double noise, base::Rng& rng) {
  LinearDynamics dynamics;
  dynamics.a1 = Eigen::MatrixXd::Zero(m, m);
  dynamics.a2 = Eigen::MatrixXd::Zero(m, m);
  for (int k = 0; k < m; ++k) {
    const double radius = rng.uniform(0.97, 0.99);
    const double angle = 2.0 * M_PI / rng.uniform(25.0, 60.0);
    dynamics.a1(k, k) = 2.0 * radius * std::cos(angle);
    dynamics.a2(k, k) = -radius * radius;
  }
  dynamics.offset = 0.02 * normal_matrix(m, 1, rng);
  const Eigen::MatrixXd b =
      noise * (Eigen::MatrixXd::Identity(m, m) + 0.3 * normal_matrix(m, m, rng));
  dynamics.covariance = b * b.transpose();
  return dynamics;
}

/// States drawn from a system, the first hundred thrown away.
inline Eigen::MatrixXd draw_states(const LinearDynamics& dynamics, int frames, base::Rng& rng) {
  constexpr int kBefore = 100;
  const Eigen::Index m = dynamics.dimension();
  const Eigen::MatrixXd b = dynamics.covariance.llt().matrixL();
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(m, frames + kBefore);
  for (Eigen::Index t = 2; t < x.cols(); ++t) {
    x.col(t) = dynamics.a1 * x.col(t - 1) + dynamics.a2 * x.col(t - 2) + dynamics.offset +
               b * normal_matrix(m, 1, rng);
  }
  return x.rightCols(frames);
}

/// A texton of d rows and m states that is known in all its parts but the start.
inline Texton known_texton(int d, int m, base::Rng& rng) {
  Texton texton;
  texton.mean = normal_matrix(d, 1, rng);
  texton.basis = Eigen::HouseholderQR<Eigen::MatrixXd>(normal_matrix(d, m, rng)).householderQ() *
                 Eigen::MatrixXd::Identity(d, m);
  texton.dynamics = swinging(m, 0.05, rng);
  texton.residual_variance = 0.02 * 0.02;
  return texton;
}

inline Eigen::MatrixXd draw_observations(const Texton& texton, int frames, base::Rng& rng) {
  const Eigen::MatrixXd x = draw_states(texton.dynamics, frames, rng);
  const Eigen::MatrixXd noise =
      std::sqrt(texton.residual_variance) * normal_matrix(texton.mean.size(), frames, rng);
  const Eigen::MatrixXd outside = noise - texton.basis * (texton.basis.transpose() * noise);
  return ((texton.basis * x).colwise() + texton.mean) + outside;
}

/// Takes of segments drawn from known textons, and which frame is whose.
struct KnownCorpus {
  std::vector<Texton> textons;
  Eigen::MatrixXd observations;
  std::vector<Take> takes;
  std::vector<Segment> segments;
};

inline KnownCorpus known_corpus(int textons, int takes, int segments_a_take, std::uint64_t seed) {
  constexpr int kRows = 20;
  constexpr int kStates = 4;
  base::Rng rng(seed);
  KnownCorpus corpus;
  for (int i = 0; i < textons; ++i) corpus.textons.push_back(known_texton(kRows, kStates, rng));
  std::vector<Eigen::MatrixXd> parts;
  int frames = 0;
  for (int n = 0; n < takes; ++n) {
    const int begin = frames;
    int last = -1;
    for (int s = 0; s < segments_a_take; ++s) {
      int texton = rng.index(textons);
      while (texton == last) texton = rng.index(textons);
      last = texton;
      const int length = 60 + rng.index(60);
      parts.push_back(
          draw_observations(corpus.textons[static_cast<std::size_t>(texton)], length, rng));
      corpus.segments.push_back({frames, length, texton});
      frames += length;
    }
    corpus.takes.push_back({"take " + std::to_string(n), begin, frames - begin, 0, 1.0});
  }
  corpus.observations.resize(kRows, frames);
  for (std::size_t s = 0; s < parts.size(); ++s)
    corpus.observations.middleCols(corpus.segments[s].begin, corpus.segments[s].length) = parts[s];
  return corpus;
}

/// The texton of each frame.
inline std::vector<int> labels_of(const std::vector<Segment>& segments) {
  std::vector<int> labels;
  for (const Segment& segment : segments)
    labels.insert(labels.end(), static_cast<std::size_t>(segment.length), segment.texton);
  return labels;
}

}  // namespace laban::texture::test
