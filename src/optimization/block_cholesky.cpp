// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/block_cholesky.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace photoslam {
namespace {

template <int kBlock>
using Block = Eigen::Matrix<double, kBlock, kBlock>;

/// c -= a bᵀ
template <int kBlock>
void subtract_product(const Block<kBlock>& a, const Block<kBlock>& b, Block<kBlock>& c) {
  for (int j = 0; j < kBlock; ++j) {
    auto column = c.col(j);
    for (int k = 0; k < kBlock; ++k) column -= b(j, k) * a.col(k);
  }
}

/// Cholesky factor of the lower triangle, in place; false when not positive definite.
template <int kBlock>
bool factorize_block(Block<kBlock>& a) {
  for (int j = 0; j < kBlock; ++j) {
    double d = a(j, j);
    for (int k = 0; k < j; ++k) d -= a(j, k) * a(j, k);
    if (!(d > 0) || !std::isfinite(d)) return false;
    const double root = std::sqrt(d);
    a(j, j) = root;
    for (int i = j + 1; i < kBlock; ++i) {
      double v = a(i, j);
      for (int k = 0; k < j; ++k) v -= a(i, k) * a(j, k);
      a(i, j) = v / root;
    }
  }
  return true;
}

/// x ← x L⁻ᵀ for a lower triangular L.
template <int kBlock>
void solve_right(const Block<kBlock>& lower, Block<kBlock>& x) {
  for (int j = 0; j < kBlock; ++j) {
    for (int k = 0; k < j; ++k) x.col(j) -= lower(j, k) * x.col(k);
    x.col(j) *= 1.0 / lower(j, j);
  }
}

}  // namespace

template <int kBlock>
void BlockCholesky<kBlock>::reset(std::span<const int> first_column) {
  first_column_.assign(first_column.begin(), first_column.end());
  row_start_.resize(first_column.size());
  int count = 0;
  for (int row = 0; row < size(); ++row) {
    const int first = first_column[static_cast<size_t>(row)];
    PHOTOSLAM_CHECK(first >= 0 && first <= row, "row {} starts at {}", row, first);
    row_start_[static_cast<size_t>(row)] = count - first;
    count += row - first + 1;
  }
  blocks_.assign(static_cast<size_t>(count), Block::Zero());
}

template <int kBlock>
bool BlockCholesky<kBlock>::factorize() {
  for (int row = 0; row < size(); ++row) {
    const int first = first_column_[static_cast<size_t>(row)];
    for (int column = first; column <= row; ++column) {
      Block& target = block(row, column);
      const int begin = std::max(first, first_column_[static_cast<size_t>(column)]);
      for (int k = begin; k < column; ++k) subtract_product(block(row, k), block(column, k), target);
      if (column < row) {
        solve_right(block(column, column), target);
      } else if (!factorize_block(target)) {
        return false;
      }
    }
  }
  return true;
}

template <int kBlock>
void BlockCholesky<kBlock>::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  PHOTOSLAM_CHECK(x.size() == kBlock * size(), "{} values, {} blocks", x.size(), size());
  for (int row = 0; row < size(); ++row) {
    auto part = x.template segment<kBlock>(kBlock * row);
    for (int column = first_column_[static_cast<size_t>(row)]; column < row; ++column) {
      part.noalias() -= block(row, column) * x.template segment<kBlock>(kBlock * column);
    }
    block(row, row).template triangularView<Eigen::Lower>().solveInPlace(part);
  }
  for (int row = size() - 1; row >= 0; --row) {
    auto part = x.template segment<kBlock>(kBlock * row);
    block(row, row).template triangularView<Eigen::Lower>().transpose().solveInPlace(part);
    for (int column = first_column_[static_cast<size_t>(row)]; column < row; ++column) {
      x.template segment<kBlock>(kBlock * column).noalias() -= block(row, column).transpose() * part;
    }
  }
}

template class BlockCholesky<6>;
template class BlockCholesky<7>;

}  // namespace photoslam
