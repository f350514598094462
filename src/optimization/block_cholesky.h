// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace photoslam {

/// Symmetric positive definite system of square blocks (of size 6 or 7), stored and factored as a skyline: of every
/// block row the lower triangle from its first non-zero block to the diagonal. Camera systems are close to banded when
/// the poses are in temporal order. Keeps its memory between problems.
template <int kBlock>
class BlockCholesky {
 public:
  using Block = Eigen::Matrix<double, kBlock, kBlock>;

  /// first_column[i] <= i is the first non-zero block of block row i. All blocks become zero.
  void reset(std::span<const int> first_column);

  int size() const { return static_cast<int>(first_column_.size()); }
  /// Block (row, column) with first_column[row] <= column <= row; of the diagonal blocks only the lower triangle
  /// counts.
  Block& block(int row, int column) {
    return blocks_[static_cast<size_t>(row_start_[static_cast<size_t>(row)] + column)];
  }

  /// Replaces the matrix by its Cholesky factor; false (and undefined content) when it is not positive definite.
  bool factorize();
  /// Solves in place after factorize(). `x` has kBlock size() entries.
  void solve(Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  const Block& block(int row, int column) const {
    return blocks_[static_cast<size_t>(row_start_[static_cast<size_t>(row)] + column)];
  }

  std::vector<int> first_column_;
  std::vector<int> row_start_;  // Index of the (stored or not) block of column 0.
  std::vector<Block> blocks_;
};

}  // namespace photoslam
