// The inner loops for what every machine of the architecture has.

#define LABAN_TERM_LANES 4
#define LABAN_TERM_KERNELS kBaselineTermKernels
#define LABAN_TERM_KERNELS_NAME "baseline"
#include "texture/term_kernels.inc"
