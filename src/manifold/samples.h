#pragma once

#include <string>

#include <Eigen/Dense>

#include "laban/base/error.h"

namespace laban::manifold {

/// @throws Error{kData} naming `who` unless there is a sample and all are finite.
inline void check_samples(const char* who, const Eigen::Ref<const Eigen::MatrixXd>& x) {
  if (x.rows() >= 1 && x.cols() >= 1 && x.allFinite()) return;
  throw base::Error(base::ErrorKind::kData, std::string(who) + ": " + std::to_string(x.rows()) +
                                                " x " + std::to_string(x.cols()) +
                                                " samples (must be at least 1 x 1 and finite)");
}

/// Repeats `step`, which tells whether it found all at rest, until then or `most` times; counts in
/// the result of an iterative method.
template <typename Result, typename Step>
void iterate(Result& result, int most, const Step& step) {
  while (result.iterations < most && !result.converged) {
    result.converged = step();
    ++result.iterations;
  }
}

}  // namespace laban::manifold
