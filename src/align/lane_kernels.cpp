#include "align/lane_kernels.h"

#include <atomic>

namespace laban::align {

extern const LaneKernels kBaselineLaneKernels;
#ifdef LABAN_V3_LANE_KERNELS
extern const LaneKernels kV3LaneKernels;
#endif

namespace {

std::atomic<const LaneKernels*> kernels_for_test = nullptr;

}  // namespace

const LaneKernels& baseline_lane_kernels() {
  return kBaselineLaneKernels;
}

const LaneKernels& best_lane_kernels() {
#ifdef LABAN_V3_LANE_KERNELS
  static const bool has_v3 = __builtin_cpu_supports("avx2") != 0 &&
                             __builtin_cpu_supports("fma") != 0 &&
                             __builtin_cpu_supports("bmi2") != 0;
  if (has_v3) return kV3LaneKernels;
#endif
  return kBaselineLaneKernels;
}

const LaneKernels& lane_kernels() {
  const LaneKernels* chosen = kernels_for_test;
  return chosen != nullptr ? *chosen : best_lane_kernels();
}

LaneKernelsForTest::LaneKernelsForTest(const LaneKernels& kernels)
    : before_(kernels_for_test.exchange(&kernels)) {}

LaneKernelsForTest::~LaneKernelsForTest() {
  kernels_for_test = before_;
}

}  // namespace laban::align
