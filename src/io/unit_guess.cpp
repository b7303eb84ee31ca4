#include "io/unit_guess.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace laban::io {
namespace {

// Reach of an adult from the hips to the fingertips by way of the chest, metres. Right for every
// file at hand: a reach of 0.70 to 1.78 m is read in the right one of centimetre and inch, the
// closest pair of units.
constexpr double kReachM = 1.12;
constexpr std::array<double, 5> kUnitsM = {1.0, 0.01, 0.001, 0.0254, 0.05644};

/// The longest sum of offset lengths from the first joint with two children or more (else the root)
/// down to a leaf, end sites included; file units.
double reach(const std::vector<motion::Joint>& joints) {
  std::vector<int> child_counts(joints.size(), 0);
  std::vector<double> below(joints.size(), 0.0);  // longest way from a joint down
  for (std::size_t i = joints.size(); i-- > 0;) {
    const motion::Joint& joint = joints[i];
    if (joint.end_site) below[i] = std::max(below[i], joint.end_site->norm());
    if (joint.parent < 0) continue;
    const auto parent = static_cast<std::size_t>(joint.parent);
    ++child_counts[parent];
    below[parent] = std::max(below[parent], joint.rest_offset.norm() + below[i]);
  }
  const auto branching =
      std::find_if(child_counts.begin(), child_counts.end(), [](int n) { return n >= 2; });
  return below[branching == child_counts.end()
                   ? 0
                   : static_cast<std::size_t>(branching - child_counts.begin())];
}

}  // namespace

double guess_unit_m(const std::vector<motion::Joint>& joints, Warnings& warnings) {
  const double units = reach(joints);
  if (!(units > 1e-9)) {
    warnings.add_once("unit", 0,
                      "the skeleton has no size to guess its unit from; centimetres are "
                      "taken (--unit says otherwise)");
    return 0.01;
  }
  const auto error = [&](double unit_m) { return std::abs(std::log(units * unit_m / kReachM)); };
  return *std::min_element(kUnitsM.begin(), kUnitsM.end(),
                           [&](double a, double b) { return error(a) < error(b); });
}

}  // namespace laban::io
