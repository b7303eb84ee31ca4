#include "laban/effort/content_map.h"

#include "laban/math/cubic_interpolation.h"

#include "effort/container_arrays.h"

namespace laban::effort {
namespace {

void require_fragment(const Eigen::Ref<const Eigen::MatrixXd>& features, Eigen::Index rows) {
  if (features.rows() != rows || rows < 1 || features.cols() < 1) {
    throw base::Error(base::ErrorKind::kData,
                      "content map: fragment of " + std::to_string(features.rows()) + " x " +
                          std::to_string(features.cols()) + " features, must have " +
                          std::to_string(rows) + " rows and at least one frame");
  }
  if (!features.allFinite()) {
    throw base::Error(base::ErrorKind::kData,
                      "content map: a fragment's feature is not finite, all must be");
  }
}

}  // namespace

std::vector<std::string> ContentMapOptions::problems() const {
  std::vector<std::string> problems;
  if (frames < 2) {
    problems.push_back("ContentMapOptions::frames = " + std::to_string(frames) + " (must be >= 2)");
  }
  if (components < 1) {
    problems.push_back("ContentMapOptions::components = " + std::to_string(components) +
                       " (must be >= 1)");
  }
  return problems;
}

Eigen::MatrixXd stretch(const Eigen::Ref<const Eigen::MatrixXd>& features, int frames) {
  const double last = static_cast<double>(features.cols() - 1);
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(frames));
  for (int k = 0; k < frames; ++k) times.push_back(last * k / (frames - 1));
  return math::interpolate(features, times);
}

Eigen::VectorXd ContentMap::coordinates(const Eigen::Ref<const Eigen::MatrixXd>& features) const {
  require_fragment(features, pca.mean.size() / frames);
  return pca.transform(stretch(features, frames).reshaped());
}

ContentMap fit_content_map(std::span<const Eigen::MatrixXd> fragments,
                           const ContentMapOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw base::Error(base::ErrorKind::kUsage, problems.front());
  }
  if (fragments.empty()) {
    throw base::Error(base::ErrorKind::kData, "content map: no fragment, at least one");
  }
  const Eigen::Index rows = fragments.front().rows();
  Eigen::MatrixXd flat(rows * options.frames, static_cast<Eigen::Index>(fragments.size()));
  for (std::size_t n = 0; n < fragments.size(); ++n) {
    require_fragment(fragments[n], rows);
    flat.col(static_cast<Eigen::Index>(n)) = stretch(fragments[n], options.frames).reshaped();
  }
  return {options.frames, math::fit_pca(flat, options.components)};
}

void ContentMap::save(base::Container& container, const std::string& prefix) const {
  put_array(container, prefix + ".mean", pca.mean);
  put_array(container, prefix + ".basis", pca.basis);
  put_array(container, prefix + ".variance", pca.variance);
  put_array(container, prefix + ".shape", Eigen::Vector2d(frames, pca.total_variance));
}

ContentMap ContentMap::load(const base::Container& container, const std::string& prefix) {
  const Eigen::MatrixXd shape = take_array(container, prefix + ".shape", 2, 1);
  ContentMap result;
  result.pca.mean = take_array(container, prefix + ".mean", -1, 1);
  const Eigen::Index size = result.pca.mean.size();
  const double frames = shape(0, 0);
  if (!(frames >= 2.0 && frames <= static_cast<double>(size)) ||
      size % static_cast<Eigen::Index>(frames) != 0) {
    throw base::Error(base::ErrorKind::kFormat,
                      "model array " + prefix + ".shape: " + std::to_string(frames) +
                          " frames, must divide the " + std::to_string(size) +
                          " numbers of a fragment");
  }
  result.frames = static_cast<int>(frames);
  result.pca.total_variance = shape(1, 0);
  result.pca.basis = take_array(container, prefix + ".basis", size, -1);
  result.pca.variance = take_array(container, prefix + ".variance", result.pca.basis.cols(), 1);
  return result;
}

}  // namespace laban::effort
