#pragma once

// LABAN_KEEPS_FREED_MEMORY: what is freed stays resident for a while and every byte has a shadow,
// as under the address and thread sanitizers. What a process holds then tells nothing of what the
// code asked for.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LABAN_KEEPS_FREED_MEMORY
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LABAN_KEEPS_FREED_MEMORY
#endif
#endif
