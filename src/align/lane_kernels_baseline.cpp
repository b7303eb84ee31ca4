// The inner loops for what every machine of the architecture has: 16 bytes a vector (SSE2, NEON).

#define LABAN_LANES 4
#define LABAN_LANE_KERNELS kBaselineLaneKernels
#define LABAN_LANE_KERNELS_NAME "baseline"
#include "align/lane_kernels.inc"
