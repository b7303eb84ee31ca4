#pragma once

#include <string>

#include <Eigen/Dense>

#include "laban/base/container.h"
#include "laban/base/error.h"

namespace laban::effort {

/// Adds a matrix to a model file.
inline void put_array(base::Container& container, const std::string& name,
                      const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  base::Array array;
  array.rows = static_cast<int>(matrix.rows());
  array.cols = static_cast<int>(matrix.cols());
  array.values.reserve(static_cast<std::size_t>(matrix.size()));
  for (Eigen::Index col = 0; col < matrix.cols(); ++col) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      array.values.push_back(matrix(row, col));
    }
  }
  container.arrays[name] = std::move(array);
}

/// The matrix of that name. @throws Error{kFormat} if absent or if a size >= 0 is not met.
inline Eigen::MatrixXd take_array(const base::Container& container, const std::string& name,
                                  Eigen::Index rows, Eigen::Index cols) {
  const base::Array& array = container.array(name);
  if ((rows >= 0 && array.rows != rows) || (cols >= 0 && array.cols != cols)) {
    const auto text = [](Eigen::Index size) {
      return size < 0 ? std::string("any") : std::to_string(size);
    };
    throw base::Error(base::ErrorKind::kFormat, "model array " + name + ": " +
                                                    std::to_string(array.rows) + " x " +
                                                    std::to_string(array.cols) + ", must be " +
                                                    text(rows) + " x " + text(cols));
  }
  return Eigen::Map<const Eigen::MatrixXd>(array.values.data(), array.rows, array.cols);
}

}  // namespace laban::effort
