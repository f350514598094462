// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/umeyama.h"

#include <Eigen/SVD>

#include "base/check.h"

namespace photoslam {

Sim3 align_umeyama(std::span<const Vec3> source, std::span<const Vec3> target, bool with_scale) {
  PHOTOSLAM_CHECK(source.size() == target.size() && !source.empty(), "{} source, {} target points", source.size(),
                  target.size());
  const auto count = static_cast<double>(source.size());
  Vec3 source_mean = Vec3::Zero(), target_mean = Vec3::Zero();
  for (size_t i = 0; i < source.size(); ++i) {
    source_mean += source[i] / count;
    target_mean += target[i] / count;
  }
  Mat3 covariance = Mat3::Zero();
  double source_variance = 0;
  for (size_t i = 0; i < source.size(); ++i) {
    covariance += (target[i] - target_mean) * (source[i] - source_mean).transpose() / count;
    source_variance += (source[i] - source_mean).squaredNorm() / count;
  }
  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // The best orthogonal matrix may be a reflection; flipping the weakest axis makes it the best rotation.
  Vec3 sign(1, 1, svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1);
  const Mat3 rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  Sim3 result;
  if (with_scale && source_variance > 0) result.scale = svd.singularValues().dot(sign) / source_variance;
  result.rotation = Quat(rotation).normalized();
  result.translation = target_mean - result.rotation * (result.scale * source_mean);
  return result;
}

}  // namespace photoslam
