// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/archive.h"
#include "math/se3.h"

namespace photoslam {

template <int kRows, int kColumns>
void serialize(Archive& archive, Eigen::Matrix<double, kRows, kColumns>& matrix) {
  archive.raw(matrix.data(), sizeof(double) * kRows * kColumns);
}

inline void serialize(Archive& archive, SE3& pose) { archive(pose.rotation.coeffs(), pose.translation); }

}  // namespace photoslam
