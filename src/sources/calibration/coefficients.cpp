// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/coefficients.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>

namespace photoslam {

Result<Distortion> distortion_from(LensModel model, std::span<const double> coefficients) {
  const size_t count = coefficients.size();
  if (count == 0) return Distortion{};
  const bool fisheye = model == LensModel::kannala_brandt;
  if (fisheye ? count != 4 : (count != 4 && count != 5 && count < 8)) {
    return error("found {} distortion coefficients, expected {}", count,
                 fisheye ? "4 of a fisheye: k1 k2 k3 k4" : "4, 5 or 8: k1 k2 p1 p2 k3 k4 k5 k6");
  }
  constexpr size_t kKnown = 8;
  if (std::ranges::any_of(coefficients.subspan(std::min(kKnown, count)), [](double c) { return c != 0; })) {
    return error("thin-prism and tilt coefficients (the 9th and later) are not supported");
  }
  std::array<double, kKnown> c{};
  std::ranges::copy(coefficients.first(std::min(kKnown, count)), c.begin());
  if (fisheye) return Distortion{.k1 = c[0], .k2 = c[1], .k3 = c[2], .k4 = c[3], .model = model};
  return Distortion{c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], model};
}

std::string coefficients_text(const Distortion& d) {
  if (d.none()) return "";
  if (d.model == LensModel::kannala_brandt) return fmt::format("{}, {}, {}, {}", d.k1, d.k2, d.k3, d.k4);
  return fmt::format("{}, {}, {}, {}, {}, {}, {}, {}", d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6);
}

Result<SE3> rigid_from_rows(std::span<const double> numbers) {
  if (numbers.size() != 12 && numbers.size() != 16) {
    return error("expected the 16 numbers of a pose matrix, or its first 12, found {}", numbers.size());
  }
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (size_t i = 0; i < numbers.size(); ++i) matrix(static_cast<int>(i / 4), static_cast<int>(i % 4)) = numbers[i];
  const Mat3 rotation = matrix.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-2;
  if ((rotation * rotation.transpose() - Mat3::Identity()).norm() > kTolerance || rotation.determinant() < 0) {
    return error("the upper left 3x3 numbers are not a rotation");
  }
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > kTolerance) {
    return error("the last four numbers are not 0 0 0 1");
  }
  return SE3::from_matrix(matrix);
}

}  // namespace photoslam
