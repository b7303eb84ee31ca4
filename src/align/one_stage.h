#pragma once

#include <memory>
#include <optional>
#include <span>

#include <Eigen/Dense>

#include "laban/align/one_stage_dp.h"
#include "laban/base/progress.h"

namespace laban::align {

/// The fragments of `segment`, prepared once for several inputs. They must outlive this.
class OneStage {
 public:
  /// @param like  an input of about the size of those to come, for the scale of single precision.
  /// @throws Error as `segment`.
  OneStage(const Eigen::Ref<const Eigen::MatrixXd>& like,
           std::span<const Eigen::MatrixXd> fragments, const SegmentOptions& options);
  ~OneStage();

  /// As the free function. @param progress  may be null; told once a few frames.
  [[nodiscard]] std::optional<Segmentation> segment(const Eigen::Ref<const Eigen::MatrixXd>& input,
                                                    base::Progress* progress = nullptr) const;

 private:
  class Steps;
  class FreeSteps;
  class LimitedSteps;
  std::unique_ptr<const Steps> steps_;
};

}  // namespace laban::align
