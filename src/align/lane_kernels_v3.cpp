// The inner loops for x86-64-v3 (AVX2, FMA), compiled with -march=x86-64-v3: see CMakeLists.txt.

#define LABAN_LANES 8
#define LABAN_LANE_KERNELS kV3LaneKernels
#define LABAN_LANE_KERNELS_NAME "x86-64-v3"
#include "align/lane_kernels.inc"
