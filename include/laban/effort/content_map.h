#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/container.h"
#include "laban/math/pca.h"

namespace laban::effort {

struct ContentMapOptions {
  /// Frames that a fragment is stretched to before it is flattened; >= 2. (Ours: the paper gives
  /// none. 32 keeps the shape of the actions; more frames do not move the leading components.)
  int frames = 32;
  /// Principal components kept, c_i; the paper takes 2-3; >= 1.
  int components = 3;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// What is done, as a few numbers: fragments stretched to one length, flattened and projected on
/// the principal components of the database [Torresani06, 6].
struct ContentMap {
  int frames = 0;
  math::Pca pca;  ///< of (rows * frames) numbers, frame by frame

  /// The content coordinates c (pca.component_count() values) of D x F pose features, F >= 1.
  /// @throws Error{kData} unless the features have the rows of the database.
  [[nodiscard]] Eigen::VectorXd coordinates(
      const Eigen::Ref<const Eigen::MatrixXd>& features) const;

  /// Adds the arrays "<prefix>.mean", ".basis", ".variance", ".shape" to a model file.
  void save(base::Container& container, const std::string& prefix) const;
  /// @throws Error{kFormat} if an array is missing or sizes do not agree.
  [[nodiscard]] static ContentMap load(const base::Container& container, const std::string& prefix);
};

/// Principal components of the stretched fragments of a database.
///
/// @param fragments  D x F_n pose features each (F_n may differ), e.g. PoseMatrix::angles.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if there is no fragment, one is
///         empty or not finite, or their rows differ.
[[nodiscard]] ContentMap fit_content_map(std::span<const Eigen::MatrixXd> fragments,
                                         const ContentMapOptions& options = {});

/// D x `frames`: `features` (D x F, F >= 1) read at equal steps from the first to the last frame by
/// the library's one interpolator; F = 1 repeats the frame.
[[nodiscard]] Eigen::MatrixXd stretch(const Eigen::Ref<const Eigen::MatrixXd>& features,
                                      int frames);

}  // namespace laban::effort
