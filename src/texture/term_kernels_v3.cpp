// The inner loops for x86-64-v3 (AVX2, FMA), compiled with -march=x86-64-v3: see CMakeLists.txt.

#define LABAN_TERM_LANES 8
#define LABAN_TERM_KERNELS kV3TermKernels
#define LABAN_TERM_KERNELS_NAME "x86-64-v3"
#include "texture/term_kernels.inc"
