#include "laban/effort/style_regressor.h"

#include <algorithm>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/learn/kernel_ridge.h"
#include "laban/learn/linear_ridge.h"
#include "laban/learn/support_vector_regression.h"

#include "style_samples.h"

namespace laban::effort {
namespace {

/// A small grid: these tests are about the machinery.
RegressorGrid small_grid() {
  return {.relative_widths = {0.5, 1.0},
          .loss_weights = {0.1, 1.0, 10.0},
          .linear_loss_weights = {0.01, 1.0},
          .svr_relative_widths = {1.0},
          .svr_loss_weights = {1.0, 10.0},
          .svr_epsilons = {0.1}};
}

StyleSamples some_blends(int count, std::uint64_t seed = 1) {
  base::Rng rng(seed);
  return invent_blends({.count = count, .beyond_interpolation = bulge}, rng);
}

double mean_squared_error(const StyleRegressor& model, const StyleSamples& samples) {
  return (model.predict(samples.features) - samples.labels).squaredNorm() /
         static_cast<double>(samples.labels.size());
}

TEST(StyleFeatures, LieInThePapersOrder) {
  const Eigen::Vector2d c_i(1, 2), c_j(3, 4);
  const Eigen::VectorXd z =
      style_features(c_i, c_j, Eigen::Vector3d(5, 6, 7), Eigen::Vector3d(8, 9, 10), 0.25);
  Eigen::VectorXd expected(11);
  expected << 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0.25;
  EXPECT_EQ(z, expected);
  Eigen::VectorXd swapped(11);
  swapped << 3, 4, 1, 2, 8, 9, 10, 5, 6, 7, 0.75;
  EXPECT_EQ(swap_order(z), swapped);
  EXPECT_EQ(swap_order(swap_order(z)), z);
  // (1 - 0.25) * 5 + 0.25 * 8 = 5.75, ..
  EXPECT_EQ(linear_interpolation(z).col(0), Eigen::Vector3d(5.75, 6.75, 7.75));
  EXPECT_THROW((void)swap_order(Eigen::MatrixXd::Zero(10, 1)), base::Error);
  const Eigen::Vector3d e = Eigen::Vector3d::Zero();
  EXPECT_THROW((void)style_features(c_i, Eigen::Vector3d::Zero(), e, e, 0.0), base::Error);
  EXPECT_THROW((void)style_features(c_i, c_j, e, Eigen::Vector4d::Zero(), 0.0), base::Error);
}

TEST(StyleFeatures, HoldSpaceWhereItIsLabelled) {
  const Eigen::Vector2d c_i(1, 2), c_j(3, 4);
  const Eigen::VectorXd z =
      style_features(c_i, c_j, Eigen::Vector4d(5, 6, 7, 8), Eigen::Vector4d(9, 10, 11, 12), 0.25);
  ASSERT_EQ(z.size(), feature_count(2, 4));
  EXPECT_EQ(linear_interpolation(z, 4).col(0), Eigen::Vector4d(6, 7, 8, 9));
  const Eigen::VectorXd swapped = swap_order(z, 4);
  EXPECT_EQ(swapped.segment(4, 4), Eigen::Vector4d(9, 10, 11, 12));
  EXPECT_EQ(linear_interpolation(swapped, 4), linear_interpolation(z, 4));
  EXPECT_THROW((void)linear_interpolation(z, 5), base::Error);
}

TEST(StyleFeatures, InterpolationIsTheSeedAtBothEndsAndTheSameFromEither) {
  const StyleSamples samples = some_blends(20);
  Eigen::MatrixXd z = samples.features;
  const Eigen::MatrixXd from_i = linear_interpolation(z);
  EXPECT_LT((linear_interpolation(swap_order(z)) - from_i).norm(), 1e-12);
  z.bottomRows(1).setZero();
  EXPECT_EQ(linear_interpolation(z), z.middleRows(6, 3));
  z.bottomRows(1).setOnes();
  EXPECT_EQ(linear_interpolation(z), z.middleRows(9, 3));
}

TEST(RegressorKind, NamesGoBothWays) {
  for (const RegressorKind kind : kRegressors) EXPECT_EQ(regressor_named(name_of(kind)), kind);
  EXPECT_EQ(regressor_named("krr"), std::nullopt);
}

TEST(StyleRegressor, LinearInterpolationLearnsNothing) {
  const StyleSamples samples = some_blends(20);
  const StyleRegressor model =
      fit_style_regressor(samples, RegressorKind::kLinearInterpolation, {.grid = small_grid()});
  const StyleSamples other = some_blends(30, 2);
  EXPECT_LT((model.predict(other.features) - linear_interpolation(other.features)).norm(), 1e-12);
}

// Oracle: the learners of `learn`, on standardized features, with the parameters that were chosen.
TEST(StyleRegressor, IsTheLearnersPredictionInThePapersProtocol) {
  const StyleSamples samples = some_blends(105);
  const StyleSamples other = some_blends(25, 2);
  const auto models =
      fit_style_regressors(samples, kRegressors, {.symmetric = false, .grid = small_grid()});
  const learn::Standardizer scale = learn::fit_standardizer(samples.features);
  const Eigen::MatrixXd x = scale.apply(samples.features), q = scale.apply(other.features);
  const auto expect_near = [&](int model, int f, const Eigen::VectorXd& expected, double bar) {
    const Eigen::VectorXd ours =
        models[static_cast<std::size_t>(model)].predict(other.features).row(f).transpose();
    EXPECT_LT((ours - expected).cwiseAbs().maxCoeff(), bar) << model << " " << f;
  };
  for (int f = 0; f < kFactorCount; ++f) {
    const auto fit = [&](int model) {
      return models[static_cast<std::size_t>(model)].fits()[static_cast<std::size_t>(f)];
    };
    const Eigen::VectorXd y = samples.labels.row(f).transpose();
    expect_near(1, f, learn::fit_linear_ridge(x, y, {.loss_weight = fit(1).loss_weight}).predict(q),
                1e-10);
    expect_near(
        2, f,
        learn::fit_kernel_ridge(x, y, {.width = fit(2).width, .loss_weight = fit(2).loss_weight})
            .predict(q),
        1e-10);
    const double deviation = std::sqrt((y.array() - y.mean()).square().mean());
    expect_near(3, f,
                learn::fit_support_vector_regression(x, y,
                                                     {.width = fit(3).width,
                                                      .loss_weight = fit(3).loss_weight,
                                                      .epsilon = fit(3).epsilon,
                                                      .tolerance = 1e-3 * deviation})
                    .predict(q),
                1e-9);
  }
}

TEST(StyleSamples, SubsetsKeepTheirWeightsAndWeightsAreChecked) {
  StyleSamples samples = some_blends(5);
  samples.weights = Eigen::VectorXd::LinSpaced(5, 0.1, 0.5);
  const std::vector<int> chosen = {4, 1};
  EXPECT_EQ(samples.subset(chosen).weights, samples.weights(chosen));
  EXPECT_NO_THROW(samples.check());
  samples.weights[2] = 0.0;
  EXPECT_THROW(samples.check(), base::Error);
  samples.weights[2] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(samples.check(), base::Error);
  samples.weights = Eigen::VectorXd::Ones(4);
  EXPECT_THROW(samples.check(), base::Error);
}

// Oracle: the weighted learners of `learn` with the parameters that were chosen.
TEST(StyleRegressor, WeighsTheLossesOfItsSamples) {
  StyleSamples samples = some_blends(60);
  base::Rng rng(2);
  samples.weights.resize(60);
  for (double& weight : samples.weights) weight = rng.uniform(0.05, 1.0);
  const StyleSamples other = some_blends(10, 2);
  const StyleRegressorOptions options{.symmetric = false, .grid = small_grid()};
  const auto linear = fit_style_regressor(samples, RegressorKind::kLinearRidge, options);
  const auto kernel = fit_style_regressor(samples, RegressorKind::kKernelRidge, options);
  const learn::Standardizer scale = learn::fit_standardizer(samples.features);
  const Eigen::MatrixXd x = scale.apply(samples.features), q = scale.apply(other.features);
  for (int f = 0; f < kFactorCount; ++f) {
    const Eigen::VectorXd y = samples.labels.row(f).transpose();
    const FactorFit& fit = kernel.fits()[static_cast<std::size_t>(f)];
    const Eigen::VectorXd expected_kernel =
        learn::fit_kernel_ridge(x, y, {.width = fit.width, .loss_weight = fit.loss_weight},
                                samples.weights)
            .predict(q);
    const Eigen::VectorXd expected_linear =
        learn::fit_linear_ridge(
            x, y, {.loss_weight = linear.fits()[static_cast<std::size_t>(f)].loss_weight},
            samples.weights)
            .predict(q);
    EXPECT_LT((kernel.predict(other.features).row(f).transpose() - expected_kernel).norm(), 1e-9);
    EXPECT_LT((linear.predict(other.features).row(f).transpose() - expected_linear).norm(), 1e-9);
  }
}

TEST(StyleRegressor, EqualWeightsOfOneChangeNothing) {
  StyleSamples samples = some_blends(40);
  const Eigen::MatrixXd z = some_blends(10, 2).features;
  const auto plain = fit_style_regressors(samples, kRegressors, {.grid = small_grid()});
  samples.weights = Eigen::VectorXd::Ones(40);
  const auto weighted = fit_style_regressors(samples, kRegressors, {.grid = small_grid()});
  for (std::size_t m = 0; m < plain.size(); ++m) {
    EXPECT_EQ(plain[m].predict(z), weighted[m].predict(z)) << name_of(plain[m].kind());
  }
}

TEST(StyleRegressor, SupportVectorRegressionRefusesDifferentWeightsAndScalesByEqualOnes) {
  StyleSamples samples = some_blends(20);
  const Eigen::MatrixXd z = some_blends(10, 2).features;
  samples.weights = Eigen::VectorXd::Constant(20, 0.5);
  RegressorGrid grid = small_grid();
  grid.svr_loss_weights = {2.0};
  const auto halves = fit_style_regressor(samples, RegressorKind::kSupportVector, {.grid = grid});
  samples.weights.resize(0);
  grid.svr_loss_weights = {1.0};
  const auto plain = fit_style_regressor(samples, RegressorKind::kSupportVector, {.grid = grid});
  EXPECT_EQ(halves.predict(z), plain.predict(z));
  samples.weights = Eigen::VectorXd::LinSpaced(20, 0.1, 1.0);
  try {
    (void)fit_style_regressor(samples, RegressorKind::kSupportVector, {.grid = grid});
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr("svr with label weights from 0.1"));
  }
}

TEST(StyleRegressor, SymmetricModelsDoNotDependOnTheOrder) {
  const StyleSamples samples = some_blends(40);
  const Eigen::MatrixXd z = some_blends(25, 2).features;
  for (const StyleRegressor& model :
       fit_style_regressors(samples, kRegressors, {.grid = small_grid()})) {
    EXPECT_LT((model.predict(z) - model.predict(swap_order(z))).cwiseAbs().maxCoeff(), 1e-10)
        << name_of(model.kind());
  }
  const StyleRegressor plain = fit_style_regressor(samples, RegressorKind::kKernelRidge,
                                                   {.symmetric = false, .grid = small_grid()});
  EXPECT_GT((plain.predict(z) - plain.predict(swap_order(z))).cwiseAbs().maxCoeff(), 1e-3);
}

// Oracle: METHODS 1.3 to the letter: every blend entered twice, in one fold; both orders averaged.
TEST(StyleRegressor, SymmetricTrainingEqualsEnteringEveryBlendInBothOrders) {
  const StyleSamples samples = some_blends(30);
  const Eigen::MatrixXd z = some_blends(25, 2).features;
  StyleSamples doubled;
  doubled.features.resize(samples.features.rows(), 60);
  doubled.features << samples.features, swap_order(samples.features);
  doubled.labels.resize(3, 60);
  doubled.labels << samples.labels, samples.labels;
  for (int copy = 0; copy < 2; ++copy) {
    for (int n = 0; n < 30; ++n) doubled.groups.push_back(n);
  }
  for (const RegressorKind kind : kRegressors) {
    // Ours is always of both orders, so that a doubled blend would count four times.
    if (kind == RegressorKind::kResidualKernelRidge) continue;
    const StyleRegressor ours = fit_style_regressor(samples, kind, {.grid = small_grid()});
    const StyleRegressor plain =
        fit_style_regressor(doubled, kind, {.symmetric = false, .grid = small_grid()});
    const Eigen::MatrixXd averaged = 0.5 * (plain.predict(z) + plain.predict(swap_order(z)));
    // SVR: both are solved to 1e-3 of the labels' deviation only.
    const double bar = kind == RegressorKind::kSupportVector ? 2e-2 : 1e-9;
    EXPECT_LT((ours.predict(z) - averaged).cwiseAbs().maxCoeff(), bar) << name_of(kind);
    for (std::size_t f = 0; f < kFactorCount; ++f) {
      EXPECT_DOUBLE_EQ(ours.fits()[f].loss_weight, plain.fits()[f].loss_weight) << name_of(kind);
      EXPECT_NEAR(ours.fits()[f].held_out_squared_error, plain.fits()[f].held_out_squared_error,
                  bar)
          << name_of(kind);
    }
  }
}

// Space is a factor like the others: what a regressor learns of labels whose fourth row repeats the
// first is, for the fourth, what it learns for the first.
TEST(StyleRegressor, LearnsSpaceAsAnyOtherFactor) {
  base::Rng rng(1);
  StyleSamples samples = invent_blends({.count = 40, .factors = kMaxFactorCount}, rng);
  for (const int row : {6, 10}) samples.features.row(row + 3) = samples.features.row(row);
  samples.labels.row(3) = samples.labels.row(0);
  for (const StyleRegressor& model :
       fit_style_regressors(samples, kRegressors, {.grid = small_grid()})) {
    ASSERT_EQ(model.factor_count(), 4);
    EXPECT_EQ(model.factors().back(), Factor::kSpace);
    const StylePrediction predicted = *model.predict_with_error(samples.features);
    EXPECT_LT((predicted.mean.row(3) - predicted.mean.row(0)).norm(), 1e-9)
        << name_of(model.kind());
    EXPECT_LT((predicted.standard_error.row(3) - predicted.standard_error.row(0)).norm(), 1e-9);
    base::Container container;
    model.save(container, "regressor");
    const StyleRegressor loaded = StyleRegressor::load(container, "regressor");
    EXPECT_EQ(loaded.predict(samples.features), predicted.mean);
    const std::vector<double> alphas = {0.0, 0.4};
    StyleScratch scratch;
    const EffortMatrix curves =
        loaded.predict_curves(samples.features.topRows(14).leftCols(1), alphas, scratch);
    EXPECT_EQ(curves.rows(), 4);
    EXPECT_EQ(loaded.typical_errors(alphas).rows(), 4);
  }
}

TEST(StyleRegressor, CurvesEqualPredictions) {
  const StyleSamples samples = some_blends(40);
  const Eigen::MatrixXd z = some_blends(6, 2).features;
  const std::vector<double> alphas = {-0.25, 0.0, 0.3, 1.0, 1.25};
  StyleScratch scratch;
  for (const bool symmetric : {false, true}) {
    for (const StyleRegressor& model : fit_style_regressors(
             samples, kRegressors, {.symmetric = symmetric, .grid = small_grid()})) {
      const Eigen::Matrix3Xd curves = model.predict_curves(z.topRows(12), alphas, scratch);
      ASSERT_EQ(curves.cols(), 30);
      for (int p = 0; p < 6; ++p) {
        for (int m = 0; m < 5; ++m) {
          Eigen::VectorXd at = z.col(p);
          at[12] = alphas[static_cast<std::size_t>(m)];
          EXPECT_LT((model.predict(at) - curves.col(5 * p + m)).norm(), 1e-10)
              << name_of(model.kind());
        }
      }
    }
  }
}

TEST(StyleRegressor, StandardErrorsCoverTwoThirdsOfUnseenLabels) {
  const StyleSamples samples = some_blends(105);
  const StyleSamples other = some_blends(400, 2);
  for (const bool symmetric : {false, true}) {
    for (const StyleRegressor& model : fit_style_regressors(
             samples, kRegressors, {.symmetric = symmetric, .grid = small_grid()})) {
      const auto predicted = model.predict_with_error(other.features);
      ASSERT_TRUE(predicted.has_value());
      EXPECT_EQ(predicted->mean, model.predict(other.features));
      for (int f = 0; f < kFactorCount; ++f) {
        const Eigen::ArrayXd residual =
            (predicted->mean.row(f) - other.labels.row(f)).array().abs().transpose();
        const Eigen::ArrayXd error = predicted->standard_error.row(f).array().transpose();
        const double covered = (residual <= error).cast<double>().mean();
        // 105 residuals calibrate to +- 4.6 % (one deviation), 400 test labels to 2.3 %.
        EXPECT_GT(covered, 0.55) << name_of(model.kind()) << " " << f;
        EXPECT_LT(covered, 0.81) << name_of(model.kind()) << " " << f;
      }
    }
  }
}

TEST(StyleRegressor, StandardErrorsGrowAwayFromSamplesAndDoNotDependOnTheOrder) {
  const StyleSamples samples = some_blends(40);
  Eigen::MatrixXd far = samples.features;
  far.topRows(6).array() += 100.0;
  for (const StyleRegressor& model :
       fit_style_regressors(samples, kRegressors, {.grid = small_grid()})) {
    const auto at = model.predict_with_error(samples.features);
    const auto twin = model.predict_with_error(swap_order(samples.features));
    const auto away = model.predict_with_error(far);
    EXPECT_LT((at->standard_error - twin->standard_error).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_TRUE((at->standard_error.array() < away->standard_error.array()).all())
        << name_of(model.kind());
  }
}

TEST(StyleRegressor, StandardErrorsAreLessAtTheSeedsWhereInterpolationIsExactThere) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.noise = 0.0, .beyond_interpolation = bulge}, rng);
  const StyleRegressor model =
      fit_style_regressor(samples, RegressorKind::kLinearInterpolation, {.grid = small_grid()});
  Eigen::MatrixXd seed = samples.features, middle = samples.features;
  seed.bottomRows(1).setZero();
  middle.bottomRows(1).setConstant(0.5);
  EXPECT_LT(model.predict_with_error(seed)->standard_error.sum(),
            0.5 * model.predict_with_error(middle)->standard_error.sum());
}

TEST(StyleRegressor, ResidualKernelRidgeBeatsInterpolationWhereThereIsABulge) {
  const StyleSamples samples = some_blends(105);
  const StyleSamples other = some_blends(300, 2);
  const auto models = fit_style_regressors(samples, kRegressors);
  EXPECT_LT(mean_squared_error(models[4], other), mean_squared_error(models[0], other));
}

TEST(StyleRegressor, FallsBackToInterpolationWhereThatIsTheTruth) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.noise = 0.5}, rng);
  const StyleSamples other = invent_blends({.count = 300, .noise = 0.5}, rng);
  const auto models = fit_style_regressors(samples, kRegressors);
  // Noise alone is 0.25; what the residual model adds to it is overfitting.
  EXPECT_LT(mean_squared_error(models[4], other), 1.05 * mean_squared_error(models[0], other));
}

TEST(StyleRegressor, DefaultLearnsWhatInterpolationMissesUnlessInterpolationMisleads) {
  EXPECT_EQ(fit_default_regressor(some_blends(60)).state().interpolation, Eigen::Vector3d::Ones());
  // One factor has nothing to do with the seeds' Efforts.
  const auto replace = [](StyleSamples samples) {
    samples.labels.row(1) = samples.features.row(0) + samples.features.row(3);
    return samples;
  };
  const StyleSamples samples = replace(some_blends(60)), other = replace(some_blends(60, 2));
  const StyleRegressor model = fit_default_regressor(samples);
  EXPECT_EQ(model.state().interpolation, Eigen::Vector3d(1.0, 0.0, 1.0));
  const auto error = [&](const Eigen::MatrixXd& predicted) {
    return (predicted.row(1) - other.labels.row(1)).squaredNorm();
  };
  EXPECT_LT(error(model.predict(other.features)),
            0.2 * error(linear_interpolation(other.features)));
}

TEST(StyleRegressor, DefaultIsInterpolationWhereThatMissesNothing) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.noise = 0.0}, rng);
  const StyleRegressor model = fit_default_regressor(samples);
  // Seeds' Efforts reach 3 and blends go beyond them: those are cut.
  const Eigen::MatrixXd expected =
      linear_interpolation(samples.features).cwiseMax(-3.0).cwiseMin(3.0);
  EXPECT_LT((model.predict(samples.features) - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(StyleRegressor, DefaultIsTheSeedsLabelAtTheSeeds) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.noise = 0.0, .beyond_interpolation = bulge}, rng);
  const StyleRegressor model = fit_default_regressor(samples);
  Eigen::MatrixXd z = some_blends(50, 2).features;
  z.bottomRows(1).setZero();
  EXPECT_EQ((model.predict(z) - z.middleRows(6, 3)).cwiseAbs().maxCoeff(), 0.0);
  z.bottomRows(1).setConstant(0.5);
  EXPECT_GT((model.predict(z) - linear_interpolation(z)).cwiseAbs().mean(), 0.1);
}

TEST(StyleRegressor, DefaultStaysInTheScaleOfLabels) {
  StyleSamples samples = some_blends(60);
  samples.labels = samples.labels.cwiseMax(-3.0).cwiseMin(3.0);
  Eigen::MatrixXd z = some_blends(50, 2).features;
  z.bottomRows(1).setConstant(1.25);
  EXPECT_GT(linear_interpolation(z).cwiseAbs().maxCoeff(), 3.0);
  const StyleRegressor model = fit_default_regressor(samples);
  EXPECT_EQ(model.predict(z).cwiseAbs().maxCoeff(), 3.0);
}

// Oracle: the average spelled out with plain solves.
TEST(StyleRegressor, DefaultIsTheAverageOfProcessesByTheirTemperedEvidence) {
  StyleSamples samples = some_blends(40);
  samples.weights = Eigen::VectorXd::LinSpaced(40, 0.3, 1.0);
  RegressorGrid grid = small_grid();
  grid.averaged_relative_widths = {1.0};
  grid.averaged_noise_ratios = {0.5};
  const StyleRegressor model =
      fit_style_regressor(samples, RegressorKind::kResidualKernelRidge, {.grid = grid});
  const auto& state = model.state();
  const Eigen::MatrixXd x = state.centers;
  const int N = 40;
  const Eigen::MatrixXd k =
      learn::gaussian_kernel(learn::squared_distances(x.leftCols(N), x), state.fits[0].width);
  const Eigen::ArrayXXd K = 0.5 * (k.leftCols(N) + k.rightCols(N));
  const Eigen::ArrayXd alpha = samples.features.row(12).transpose();
  Eigen::ArrayXd b = alpha * (1.0 - alpha);
  const double unit = 1.0 / std::sqrt(b.square().mean());
  b *= unit;
  for (int f = 0; f < kFactorCount; ++f) {
    if (state.interpolation[f] != 1.0) continue;
    Eigen::ArrayXd r =
        (samples.labels.row(f) - linear_interpolation(samples.features).row(f)).transpose();
    Eigen::ArrayXd sizes = r.abs();
    std::sort(sizes.begin(), sizes.end());
    const double bound = 2.5 * 1.4826 * sizes[20];
    r = r.max(-bound).min(bound);
    const Eigen::ArrayXd noise = 0.5 / samples.weights.array();
    const auto evidence = [&](const Eigen::MatrixXd& C) {
      const Eigen::VectorXd solved = C.llt().solve(r.matrix());
      return std::exp(
          0.05 * (-20.0 * std::log(r.matrix().dot(solved) / N) - 0.5 * std::log(C.determinant())));
    };
    const auto covariance = [&](double constant) -> Eigen::MatrixXd {
      Eigen::MatrixXd C =
          b.matrix().asDiagonal() * (K + constant).matrix() * b.matrix().asDiagonal();
      C.diagonal().array() += noise;
      return C;
    };
    const Eigen::MatrixXd local = covariance(0.0), common = covariance(1.0);
    const Eigen::MatrixXd nothing = (1.0 / samples.weights.array()).matrix().asDiagonal();
    const double sum = 2.0 * evidence(nothing) + evidence(local) + evidence(common);
    const auto coefficients = [&](const Eigen::MatrixXd& C) -> Eigen::VectorXd {
      return evidence(C) / sum * unit * b.matrix().cwiseProduct(C.llt().solve(r.matrix()));
    };
    const Eigen::VectorXd everywhere = coefficients(common);
    const Eigen::VectorXd a = coefficients(local) + everywhere;
    EXPECT_LT((state.bulge.row(f).tail(N).transpose() - 0.5 * a).norm(), 1e-9);
    EXPECT_NEAR(state.bulge_offset[f], everywhere.sum(), 1e-9);
    EXPECT_TRUE(state.coefficients.row(f).isZero(0.0));
  }
}

TEST(StyleRegressor, SurvivesItsModelFileToTheBit) {
  const StyleSamples samples = some_blends(40);
  const Eigen::MatrixXd z = some_blends(10, 2).features;
  for (const StyleRegressor& model :
       fit_style_regressors(samples, kRegressors, {.grid = small_grid()})) {
    base::Container container;
    model.save(container, "regressor");
    const StyleRegressor loaded = StyleRegressor::load(container, "regressor");
    EXPECT_EQ(loaded.kind(), model.kind());
    EXPECT_EQ(loaded.symmetric(), model.symmetric());
    EXPECT_EQ(loaded.predict(z), model.predict(z));
    EXPECT_EQ(loaded.predict_with_error(z)->standard_error,
              model.predict_with_error(z)->standard_error);
    EXPECT_EQ(loaded.fits()[1].loss_weight, model.fits()[1].loss_weight);
  }
}

TEST(StyleRegressor, ReadsAModelFileFromBeforeStandardErrors) {
  const StyleSamples samples = some_blends(40);
  const StyleRegressor model =
      fit_style_regressor(samples, RegressorKind::kKernelRidge, {.grid = small_grid()});
  base::Container container;
  model.save(container, "r");
  for (const char* name : {"r.bulge", "r.bulge_offset", "r.spread", "r.spread_mean",
                           "r.spread_inverse_scale", "r.spread_centers"}) {
    ASSERT_EQ(container.arrays.erase(name), 1U) << name;
  }
  base::Array& form = container.arrays.at("r.form");
  form.rows = 2;
  form.values.resize(2);
  const StyleRegressor old = StyleRegressor::load(container, "r");
  EXPECT_EQ(old.predict(samples.features), model.predict(samples.features));
  const auto predicted = old.predict_with_error(samples.features);
  for (int f = 0; f < kFactorCount; ++f) {
    EXPECT_DOUBLE_EQ(predicted->standard_error(f, 7),
                     std::sqrt(model.fits()[static_cast<std::size_t>(f)].held_out_squared_error));
  }
}

TEST(StyleRegressor, RefusesABrokenModelFile) {
  base::Container container;
  fit_style_regressor(some_blends(20), RegressorKind::kKernelRidge, {.grid = small_grid()})
      .save(container, "r");
  const auto kind_after = [&](const std::string& name, int rows, double value) {
    base::Container broken = container;
    base::Array& array = broken.arrays.at(name);
    if (rows >= 0) {
      array.rows = rows;
      array.values.assign(static_cast<std::size_t>(rows * array.cols), 0.5);
    } else {
      array.values.front() = value;
    }
    try {
      (void)StyleRegressor::load(broken, "r");
    } catch (const base::Error& error) {
      return error.kind();
    }
    return base::ErrorKind::kInternal;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(kind_after("r.form", -1, 7.0), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.form", -1, nan), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.mean", 12, 0.0), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.centers", 4, 0.0), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.coefficients", -1, nan), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.fits", -1, 0.0), base::ErrorKind::kFormat);  // a width of 0
  EXPECT_EQ(kind_after("r.bulge", -1, nan), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.spread", -1, -1.0), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.spread_centers", 4, 0.0), base::ErrorKind::kFormat);
  EXPECT_EQ(kind_after("r.mean", -1, 0.25), base::ErrorKind::kInternal);  // nothing wrong
}

TEST(StyleRegressor, ConstantLabelsArePredicted) {
  StyleSamples samples = some_blends(20);
  samples.labels.row(1).setConstant(1.5);
  for (const RegressorKind kind :
       {RegressorKind::kLinearRidge, RegressorKind::kKernelRidge, RegressorKind::kSupportVector}) {
    const StyleRegressor model = fit_style_regressor(samples, kind, {.grid = small_grid()});
    EXPECT_LT((model.predict(samples.features).row(1).array() - 1.5).abs().maxCoeff(), 0.11)
        << name_of(kind);  // SVR may use its tube, 0.1
  }
}

TEST(StyleRegressor, NamesWhatItRefuses) {
  const auto message = [](const StyleSamples& samples, const StyleRegressorOptions& options) {
    try {
      (void)fit_style_regressor(samples, RegressorKind::kKernelRidge, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  StyleSamples samples = some_blends(20);
  EXPECT_THAT(message(samples, {.folds = 1}), testing::HasSubstr("folds = 1 (must be >= 2)"));
  EXPECT_THAT(message(samples, {.grid = {.relative_widths = {0.0}}}),
              testing::HasSubstr("relative_widths holds 0"));
  EXPECT_THAT(message(some_blends(2), {}), testing::HasSubstr("2 labelled blends, at least 3"));
  samples.groups.assign(19, 0);
  EXPECT_THAT(message(samples, {}), testing::HasSubstr("19 groups"));
  samples.groups.assign(20, 0);
  EXPECT_THAT(message(samples, {}), testing::HasSubstr("1 labelled blends, at least 3"));
  const StyleRegressor model =
      fit_style_regressor(some_blends(10), RegressorKind::kKernelRidge, {.grid = small_grid()});
  EXPECT_THROW((void)model.predict(Eigen::MatrixXd::Zero(11, 1)), base::Error);
}

}  // namespace
}  // namespace laban::effort
