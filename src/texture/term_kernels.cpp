#include "texture/term_kernels.h"

namespace laban::texture {

extern const TermKernels kBaselineTermKernels;
#ifdef LABAN_V3_TERM_KERNELS
extern const TermKernels kV3TermKernels;
#endif

const TermKernels& baseline_term_kernels() {
  return kBaselineTermKernels;
}

const TermKernels& term_kernels() {
#ifdef LABAN_V3_TERM_KERNELS
  static const bool has_v3 = __builtin_cpu_supports("avx2") != 0 &&
                             __builtin_cpu_supports("fma") != 0 &&
                             __builtin_cpu_supports("bmi2") != 0;
  if (has_v3) return kV3TermKernels;
#endif
  return kBaselineTermKernels;
}

}  // namespace laban::texture
