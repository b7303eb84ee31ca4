#include "laban/base/progress.h"

#include "laban/base/error.h"

namespace laban::base {

void tell(Progress* progress, double fraction) {
  if (progress != nullptr && !progress->update(fraction))
    throw Error(ErrorKind::kUsage, "interrupted");
}

bool ProgressPart::update(double fraction) {
  return whole_ == nullptr || whole_->update(begin_ + (end_ - begin_) * fraction);
}

}  // namespace laban::base
