#pragma once

#include <functional>

namespace laban::math {

/// Calls work(0) .. work(count - 1), each once, on up to `threads` threads (0: all cores), taking
/// the next index as a thread falls free. Each call must write only what belongs to its index; then
/// the result does not depend on the number of threads. The first exception (by index) is rethrown
/// after all running calls have ended.
void parallel_for(int count, int threads, const std::function<void(int)>& work);

}  // namespace laban::math
