#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/progress.h"

namespace laban::test {

/// Writes down what it is told, and asks the work to stop when it is told for the `stop_at`th time.
class Listener final : public base::Progress {
 public:
  explicit Listener(int stop_at = -1) : stop_at_(stop_at) {}

  bool update(double fraction) override {
    EXPECT_GE(fraction, fractions.empty() ? 0.0 : fractions.back());
    EXPECT_LE(fraction, 1.0);
    fractions.push_back(fraction);
    return static_cast<int>(fractions.size()) != stop_at_;
  }

  std::vector<double> fractions;

 private:
  int stop_at_;
};

/// Work, given a listener, tells at least `least` times how far it has come, never less than
/// before, and stops at once, whenever it is asked to.
template <typename Work>
void expect_told_and_stopped(int least, const Work& work) {
  Listener patient;
  work(&patient);
  const auto times = static_cast<int>(patient.fractions.size());
  ASSERT_GE(times, least);
  for (const int stop_at : {1, 1 + times / 2, times}) {
    Listener hasty(stop_at);
    try {
      work(&hasty);
      ADD_FAILURE() << "not stopped at " << stop_at << " of " << times;
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
      EXPECT_STREQ(error.what(), "interrupted");
    }
    EXPECT_EQ(hasty.fractions.size(), static_cast<std::size_t>(stop_at));
  }
}

}  // namespace laban::test
