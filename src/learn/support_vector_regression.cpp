#include "laban/learn/support_vector_regression.h"

#include <numeric>

#include <libsvm/svm.h>

#include "learn/checks.h"

namespace laban::learn {
namespace {

/// libsvm prints its iterations through one global hook; it is silenced once, before any training.
void silence_libsvm() {
  static const bool silenced = [] {
    svm_set_print_string_function([](const char*) {});
    return true;
  }();
  static_cast<void>(silenced);
}

struct ModelDeleter {
  void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};

svm_parameter libsvm_parameter(const SupportVectorOptions& options) {
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = PRECOMPUTED;
  parameter.cache_size = 16.0;  // megabytes: 1400 samples before any row is computed twice
  parameter.eps = options.tolerance;
  parameter.C = options.loss_weight;
  parameter.p = options.epsilon;
  parameter.shrinking = 1;
  return parameter;
}

}  // namespace

std::vector<std::string> SupportVectorOptions::problems() const {
  std::vector<std::string> problems;
  append_unless_positive("SupportVectorOptions::width", width, problems);
  append_unless_positive("SupportVectorOptions::loss_weight", loss_weight, problems);
  if (!(epsilon >= 0.0) || epsilon > 1e300) {
    problems.push_back("SupportVectorOptions::epsilon = " + std::to_string(epsilon) +
                       " (must be >= 0 and finite)");
  }
  append_unless_positive("SupportVectorOptions::tolerance", tolerance, problems);
  return problems;
}

/// libsvm's form of a precomputed kernel: row n is (0, n + 1), (1, k_n1), .., (N, k_nN), end.
/// An entry is looked up by the number in the other row's first node, so that any subset of rows is
/// a problem of its own, without a copy.
struct SupportVectorKernel::Nodes {
  explicit Nodes(int sample_count)
      : count(sample_count),
        values(static_cast<std::size_t>(sample_count) * static_cast<std::size_t>(count + 2)) {}

  /// Row of sample n. libsvm takes it as mutable and does not change it.
  /// @throws Error{kData} if there is no such sample.
  svm_node* row(int n) {
    if (n < 0 || n >= count) {
      throw base::Error(base::ErrorKind::kData, "support vector regression: sample " +
                                                    std::to_string(n) + " of " +
                                                    std::to_string(count));
    }
    return values.data() + static_cast<std::size_t>(n) * static_cast<std::size_t>(count + 2);
  }

  int count;
  std::vector<svm_node> values;
};

SupportVectorKernel::SupportVectorKernel(const Eigen::Ref<const Eigen::MatrixXd>& kernel) {
  require_samples("SupportVectorKernel", kernel);
  require_rows("SupportVectorKernel", kernel.rows(), kernel.cols());
  const int count = static_cast<int>(kernel.rows());
  nodes_ = std::make_unique<Nodes>(count);
  for (int n = 0; n < count; ++n) {
    svm_node* row = nodes_->row(n);
    row[0] = {0, static_cast<double>(n + 1)};
    for (int m = 0; m < count; ++m) row[m + 1] = {m + 1, kernel(n, m)};
    row[count + 1] = {-1, 0.0};
  }
}

SupportVectorKernel::~SupportVectorKernel() = default;
SupportVectorKernel::SupportVectorKernel(SupportVectorKernel&&) noexcept = default;
SupportVectorKernel& SupportVectorKernel::operator=(SupportVectorKernel&&) noexcept = default;

SupportVectorSolution SupportVectorKernel::solve(std::span<const int> rows,
                                                 const Eigen::Ref<const Eigen::VectorXd>& y,
                                                 const SupportVectorOptions& options) const {
  require_valid(options.problems());
  if (rows.empty()) {
    throw base::Error(base::ErrorKind::kData, "support vector regression: no sample, at least one");
  }
  require_targets("support vector regression", y, static_cast<Eigen::Index>(rows.size()));
  std::vector<svm_node*> pointers;
  pointers.reserve(rows.size());
  for (const int row : rows) pointers.push_back(nodes_->row(row));
  std::vector<double> targets(y.data(), y.data() + y.size());
  const svm_problem problem{static_cast<int>(rows.size()), targets.data(), pointers.data()};
  const svm_parameter parameter = libsvm_parameter(options);
  silence_libsvm();
  const std::unique_ptr<svm_model, ModelDeleter> model(svm_train(&problem, &parameter));

  SupportVectorSolution result;
  result.coefficients = Eigen::VectorXd::Zero(y.size());
  for (int k = 0; k < model->l; ++k) {
    result.coefficients[model->sv_indices[k] - 1] = model->sv_coef[0][k];
  }
  result.rho = model->rho[0];
  return result;
}

Eigen::VectorXd SupportVectorKernel::predict(std::span<const int> rows,
                                             const SupportVectorSolution& solution,
                                             std::span<const int> at) const {
  require_targets("support vector regression", solution.coefficients,
                  static_cast<Eigen::Index>(rows.size()));
  for (const int row : rows) static_cast<void>(nodes_->row(row));
  Eigen::VectorXd result(static_cast<Eigen::Index>(at.size()));
  for (std::size_t k = 0; k < at.size(); ++k) {
    const svm_node* kernel_row = nodes_->row(at[k]);
    double sum = -solution.rho;
    for (std::size_t n = 0; n < rows.size(); ++n) {
      sum += solution.coefficients[static_cast<Eigen::Index>(n)] * kernel_row[rows[n] + 1].value;
    }
    result[static_cast<Eigen::Index>(k)] = sum;
  }
  return result;
}

KernelExpansion fit_support_vector_regression(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                              const Eigen::Ref<const Eigen::VectorXd>& y,
                                              const SupportVectorOptions& options) {
  require_valid(options.problems());
  require_samples("fit_support_vector_regression", x);
  require_targets("fit_support_vector_regression", y, x.cols());
  const SupportVectorKernel kernel(gaussian_kernel(squared_distances(x, x), options.width));
  std::vector<int> rows(static_cast<std::size_t>(x.cols()));
  std::iota(rows.begin(), rows.end(), 0);
  const SupportVectorSolution solution = kernel.solve(rows, y, options);

  std::vector<Eigen::Index> support;
  for (Eigen::Index n = 0; n < x.cols(); ++n) {
    if (solution.coefficients[n] != 0.0) support.push_back(n);
  }
  KernelExpansion result;
  result.centers = x(Eigen::all, support);
  result.coefficients = solution.coefficients(support);
  result.width = options.width;
  result.offset = -solution.rho;
  return result;
}

}  // namespace laban::learn
