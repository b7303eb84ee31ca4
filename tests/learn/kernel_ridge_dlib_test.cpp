#include <dlib/svm.h>
#include <gtest/gtest.h>

#include "laban/learn/kernel_ridge.h"

#include "samples.h"

namespace laban::learn {
namespace {

using DlibSample = dlib::matrix<double, 3, 1>;
using DlibKernel = dlib::radial_basis_kernel<DlibSample>;

DlibSample to_dlib(const Eigen::Vector3d& x) {
  DlibSample sample;
  sample = x[0], x[1], x[2];
  return sample;
}

TEST(KernelRidge, MatchesDlib) {
  // dlib's krr_trainer has no centring: it appends a constant feature, which is penalised like the
  // others. So its kernel is k + 1, and for targets of mean 0 our solver on K + 1 is the same
  // problem.
  const ReferenceSamples data = reference_samples();
  const Eigen::VectorXd y = data.y.array() - data.y.mean();
  const double width = 0.6, U = 50.0;

  std::vector<DlibSample> samples;
  std::vector<double> targets;
  for (int n = 0; n < data.x.cols(); ++n) {
    samples.push_back(to_dlib(data.x.col(n)));
    targets.push_back(y[n]);
  }
  dlib::krr_trainer<DlibKernel> trainer;
  trainer.set_kernel(DlibKernel(1.0 / (2.0 * width * width)));
  trainer.set_lambda(1.0 / U);
  trainer.use_regression_loss_for_loo_cv();
  trainer.set_basis(samples);  // else it drops samples that are nearly spanned by the rest
  const auto oracle = trainer.train(samples, targets);

  const Eigen::MatrixXd K = gaussian_kernel(squared_distances(data.x, data.x), width);
  const KernelRidgeSolution ours = solve_kernel_ridge(K.array() + 1.0, y, U);
  const Eigen::MatrixXd k = gaussian_kernel(squared_distances(data.x, data.queries), width);
  for (int q = 0; q < k.cols(); ++q) {
    const double predicted = (k.col(q).array() + 1.0).matrix().dot(ours.coefficients) + ours.offset;
    // dlib drops directions of K below round-off: measured difference under 1e-9.
    EXPECT_NEAR(predicted, oracle(to_dlib(data.queries.col(q))), 1e-8);
  }
}

}  // namespace
}  // namespace laban::learn
