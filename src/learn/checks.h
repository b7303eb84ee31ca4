#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/error.h"

namespace laban::learn {

/// @throws Error{kUsage} naming the first broken rule, if any.
inline void require_valid(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
}

/// Shape and finiteness of training data; `place` begins the message.
inline void require_samples(const char* place, const Eigen::Ref<const Eigen::MatrixXd>& x) {
  const std::string at(place);
  if (x.rows() < 1 || x.cols() < 1) {
    throw base::Error(base::ErrorKind::kData, at + ": " + std::to_string(x.rows()) + " x " +
                                                  std::to_string(x.cols()) +
                                                  " samples, at least one feature of one sample");
  }
  if (!x.allFinite()) {
    throw base::Error(base::ErrorKind::kData, at + ": a sample is not finite, all must be");
  }
}

inline void require_targets(const char* place, const Eigen::Ref<const Eigen::MatrixXd>& y,
                            Eigen::Index count) {
  const std::string at(place);
  if (y.rows() != count) {
    throw base::Error(base::ErrorKind::kData, at + ": " + std::to_string(y.rows()) +
                                                  " targets for " + std::to_string(count) +
                                                  " samples, must be equal");
  }
  if (!y.allFinite()) {
    throw base::Error(base::ErrorKind::kData, at + ": a target is not finite, all must be");
  }
}

/// Weights of the samples: none (all 1), or one for each, > 0 and finite.
inline void require_weights(const char* place, const Eigen::Ref<const Eigen::VectorXd>& weights,
                            Eigen::Index count) {
  const std::string at(place);
  if (weights.size() != 0 && weights.size() != count) {
    throw base::Error(base::ErrorKind::kData, at + ": " + std::to_string(weights.size()) +
                                                  " weights for " + std::to_string(count) +
                                                  " samples, one each or none");
  }
  for (const double weight : weights) {
    if (!(weight > 0.0) || weight > 1e300) {
      throw base::Error(base::ErrorKind::kData, at + ": weight " + std::to_string(weight) +
                                                    " of a sample (must be > 0 and finite)");
    }
  }
}

/// The weights given, or 1 for each of `count` samples.
inline Eigen::VectorXd weights_or_ones(const Eigen::Ref<const Eigen::VectorXd>& weights,
                                       Eigen::Index count) {
  if (weights.size() == 0) return Eigen::VectorXd::Ones(count);
  return weights;
}

inline void require_rows(const char* place, Eigen::Index rows, Eigen::Index expected) {
  if (rows != expected) {
    throw base::Error(base::ErrorKind::kData, std::string(place) + ": samples of " +
                                                  std::to_string(rows) + " features, must be " +
                                                  std::to_string(expected));
  }
}

/// "place = value (must be > 0)" if `value` is not a positive finite number.
inline void append_unless_positive(const char* place, double value,
                                   std::vector<std::string>& problems) {
  if (!(value > 0.0) || value > 1e300) {
    problems.push_back(std::string(place) + " = " + std::to_string(value) +
                       " (must be > 0 and finite)");
  }
}

}  // namespace laban::learn
