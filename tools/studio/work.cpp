#include "work.h"

namespace laban::studio {

bool Work::update(double fraction) {
  fraction_ = fraction;
  return !stopped_;
}

Work::Turn::Turn(Work& work) : work_(work) {
  work_.stopped_ = false;
  work_.fraction_ = -1.0;
  work_.begun_ = Clock::now().time_since_epoch().count();
  work_.busy_ = true;
}

Work::Turn::~Turn() {
  work_.busy_ = false;
}

Json Work::told() const {
  const bool busy = busy_;
  const double fraction = fraction_;
  const Clock::duration since = Clock::now().time_since_epoch() - Clock::duration(begun_.load());
  return {{"busy", busy},
          {"seconds", busy ? std::chrono::duration<double>(since).count() : 0.0},
          {"fraction", busy && fraction >= 0.0 ? Json(fraction) : Json()}};
}

void Work::stop() {
  stopped_ = true;
}

}  // namespace laban::studio
