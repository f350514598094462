// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/two_view.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/check.h"
#include "base/random.h"
#include "geometry/triangulation.h"

namespace photoslam {
namespace {

// 95 % of χ² with one and two degrees of freedom.
constexpr double kChi2Line = 3.841, kChi2Point = 5.991;

/// Moves points to their centre and scales them to a mean distance of √2 (Hartley 1997).
Mat3 normalization(std::span<const Vec2> points) {
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double distance = 0;
  for (const Vec2& p : points) distance += (p - mean).norm();
  const double scale = std::sqrt(2.0) * static_cast<double>(points.size()) / std::max(distance, 1e-12);
  Mat3 m;
  m << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return m;
}

/// The row-major 3x3 matrix whose nine entries are the null vector of the system.
Mat3 null_matrix(const Eigen::Matrix<double, Eigen::Dynamic, 9>& system) {
  const Eigen::Matrix<double, 9, 9> normal = system.transpose() * system;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  const Eigen::Matrix<double, 9, 1> v = eigen.eigenvectors().col(0);
  Mat3 m;
  m << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  return m;
}

SE3 make_motion(Mat3 rotation, const Vec3& translation) {
  if (rotation.determinant() < 0) rotation = -rotation;
  return {Quat(rotation).normalized(), translation.normalized()};
}

}  // namespace

Mat3 fit_homography(std::span<const Vec2> a, std::span<const Vec2> b) {
  const Mat3 ta = normalization(a), tb = normalization(b);
  Eigen::Matrix<double, Eigen::Dynamic, 9> system(2 * static_cast<Eigen::Index>(a.size()), 9);
  for (size_t i = 0; i < a.size(); ++i) {
    const Vec3 p = ta * a[i].homogeneous(), q = tb * b[i].homogeneous();
    const auto row = 2 * static_cast<Eigen::Index>(i);
    system.row(row) << 0, 0, 0, -p.transpose(), q.y() * p.transpose();
    system.row(row + 1) << p.transpose(), 0, 0, 0, -q.x() * p.transpose();
  }
  return tb.inverse() * null_matrix(system) * ta;
}

Mat3 fit_essential(std::span<const Vec2> a, std::span<const Vec2> b) {
  const Mat3 ta = normalization(a), tb = normalization(b);
  Eigen::Matrix<double, Eigen::Dynamic, 9> system(static_cast<Eigen::Index>(a.size()), 9);
  for (size_t i = 0; i < a.size(); ++i) {
    const Vec3 p = ta * a[i].homogeneous(), q = tb * b[i].homogeneous();
    system.row(static_cast<Eigen::Index>(i)) << q.x() * p.transpose(), q.y() * p.transpose(), p.transpose();
  }
  const Mat3 fundamental = tb.transpose() * null_matrix(system) * ta;
  const Eigen::JacobiSVD<Mat3> svd(fundamental, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * Vec3(1, 1, 0).asDiagonal() * svd.matrixV().transpose();
}

std::vector<SE3> motions_from_essential(const Mat3& essential) {
  const Eigen::JacobiSVD<Mat3> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3& u = svd.matrixU();
  const Vec3 t = u.col(2);
  Mat3 w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Mat3 first = u * w * svd.matrixV().transpose(), second = u * w.transpose() * svd.matrixV().transpose();
  return {make_motion(first, t), make_motion(first, -t), make_motion(second, t), make_motion(second, -t)};
}

std::vector<SE3> motions_from_homography(const Mat3& homography) {
  const Eigen::JacobiSVD<Mat3> svd(homography, Eigen::ComputeFullV);
  Mat3 h = homography / svd.singularValues()[1];
  if (h.determinant() < 0) h = -h;
  const double s1 = std::pow(svd.singularValues()[0] / svd.singularValues()[1], 2);
  const double s3 = std::pow(svd.singularValues()[2] / svd.singularValues()[1], 2);
  constexpr double kRotation = 1e-9;
  if (!(s1 - s3 > kRotation)) return {};
  const Vec3 v1 = svd.matrixV().col(0), v2 = svd.matrixV().col(1), v3 = svd.matrixV().col(2);
  std::vector<SE3> motions;
  for (const double sign : {1.0, -1.0}) {
    const Vec3 u =
        (std::sqrt(std::max(0.0, 1 - s3)) * v1 + sign * std::sqrt(std::max(0.0, s1 - 1)) * v3) / std::sqrt(s1 - s3);
    const Vec3 normal = v2.cross(u);
    Mat3 before, after;
    before << v2, u, normal;
    after << h * v2, h * u, (h * v2).cross(h * u);
    const Mat3 rotation = after * before.transpose();
    const Vec3 translation = (h - rotation) * normal;
    if (!(translation.norm() > kRotation)) continue;
    motions.push_back(make_motion(rotation, translation));
    motions.push_back(make_motion(rotation, -translation));
  }
  return motions;
}

void TwoViewOptions::visit(OptionVisitor& v) {
  v.value({"max_iterations", "", 1, 100000, "Samples of each model."}, max_iterations);
  v.value({"sigma_px", "px", 0.1, 100, "Standard deviation of a keypoint on the finest pyramid level."}, sigma_px);
  v.value({"min_parallax_deg", "deg", 0.1, 45, "Angle between the rays of the two views …"}, min_parallax_deg);
  v.value({"min_points", "", 10, 10000, "… that at least so many reconstructed points have."}, min_points);
  v.value({"min_support", "", 0, 1, "Points of a motion that is looked at closely, relative to the best one."},
          min_support);
}

namespace {

class TwoViews {
 public:
  TwoViews(const TwoViewOptions& options, const PinholeCamera& camera, std::span<const Vec2> pixels_a,
           std::span<const Vec2> pixels_b, std::span<const double> sigmas)
      : options_(options), camera_(camera), pixels_a_(pixels_a), pixels_b_(pixels_b) {
    for (size_t i = 0; i < pixels_a.size(); ++i) {
      a_.emplace_back(camera.unproject(pixels_a[i], 1.0).head<2>());
      b_.emplace_back(camera.unproject(pixels_b[i], 1.0).head<2>());
      sigma_px_.push_back(options.sigma_px * sigmas[i]);
      sigma_.push_back(sigma_px_.back() / std::sqrt(camera.fx * camera.fy));
    }
  }

  TwoViewResult run() {
    TwoViewResult result;
    if (static_cast<int>(a_.size()) < options_.min_points) return refuse(result, "too few matches");
    Random random(1);
    const Model homography = best_model(random, 4, fit_homography, &TwoViews::score_homography);
    const Model essential = best_model(random, 8, fit_essential, &TwoViews::score_essential);
    result.plane_scores = homography.score > essential.score;
    std::vector<TwoViewMotion> tried;
    for (const SE3& motion : motions_from_homography(homography.matrix)) tried.push_back(reconstruct(motion));
    const auto num_of_plane = static_cast<std::ptrdiff_t>(tried.size());
    for (const SE3& motion : motions_from_essential(essential.matrix)) tried.push_back(reconstruct(motion));
    if (!result.plane_scores) std::rotate(tried.begin(), tried.begin() + num_of_plane, tried.end());
    std::ranges::stable_sort(tried, std::greater{}, &TwoViewMotion::num_good);
    const TwoViewMotion& best = tried.front();
    if (best.num_good == 0) return refuse(result, "the camera only turned");
    if (best.num_good < options_.min_points) return refuse(result, "too few points");
    const double least = std::max<double>(options_.min_points, options_.min_support * best.num_good);
    double parallax_deg = 0;
    for (TwoViewMotion& motion : tried) {
      if (motion.num_good < least) continue;
      parallax_deg = std::max(parallax_deg, motion.parallax_deg);
      result.motions.push_back(std::move(motion));
    }
    if (parallax_deg < options_.min_parallax_deg) return refuse(result, "too little parallax");
    result.success = true;
    return result;
  }

 private:
  struct Model {
    Mat3 matrix = Mat3::Identity();
    double score = -1;
    std::vector<uint8_t> inlier;
  };
  using Fit = Mat3 (*)(std::span<const Vec2>, std::span<const Vec2>);
  using Score = double (TwoViews::*)(const Mat3&, std::vector<uint8_t>&) const;

  static TwoViewResult refuse(TwoViewResult result, const char* reason) {
    result.reason = reason;
    return result;
  }

  /// RANSAC; every new best sample is fitted again to all it explains.
  Model best_model(Random& random, int sample_size, Fit fit, Score score) const {
    Model best;
    std::vector<Vec2> a, b;
    std::vector<uint8_t> inlier;
    for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
      a.clear();
      b.clear();
      for (int k = 0; k < sample_size; ++k) {
        const auto i = static_cast<size_t>(random.index(static_cast<int>(a_.size())));
        a.push_back(a_[i]);
        b.push_back(b_[i]);
      }
      Mat3 matrix = fit(a, b);
      for (int round = 0; round < 3; ++round) {
        const double value = matrix.allFinite() ? (this->*score)(matrix, inlier) : -1;
        if (!(value > best.score)) break;
        best = {matrix, value, inlier};
        a.clear();
        b.clear();
        for (size_t i = 0; i < a_.size(); ++i) {
          if (!inlier[i]) continue;
          a.push_back(a_[i]);
          b.push_back(b_[i]);
        }
        if (static_cast<int>(a.size()) < sample_size) break;
        matrix = fit(a, b);
      }
    }
    return best;
  }

  /// Adds how far an error stays below the limit of the essential matrix's looser score, so that both compare.
  static void count(double chi2, double limit, double& sum, uint8_t& inlier) {
    if (chi2 <= limit) {
      sum += kChi2Point - chi2;
    } else {
      inlier = 0;
    }
  }

  /// Symmetric transfer error.
  double score_homography(const Mat3& h, std::vector<uint8_t>& inlier) const {
    const Mat3 inverse = h.inverse();
    inlier.assign(a_.size(), 1);
    double sum = 0;
    for (size_t i = 0; i < a_.size(); ++i) {
      const double variance = sigma_[i] * sigma_[i];
      const Vec3 there = h * a_[i].homogeneous(), back = inverse * b_[i].homogeneous();
      count((there.hnormalized() - b_[i]).squaredNorm() / variance, kChi2Point, sum, inlier[i]);
      count((back.hnormalized() - a_[i]).squaredNorm() / variance, kChi2Point, sum, inlier[i]);
    }
    return sum;
  }

  /// Symmetric distance from the epipolar lines.
  double score_essential(const Mat3& e, std::vector<uint8_t>& inlier) const {
    inlier.assign(a_.size(), 1);
    double sum = 0;
    for (size_t i = 0; i < a_.size(); ++i) {
      const double variance = sigma_[i] * sigma_[i];
      const Vec3 line_b = e * a_[i].homogeneous(), line_a = e.transpose() * b_[i].homogeneous();
      const double error = b_[i].homogeneous().dot(line_b);
      count(error * error / (line_b.head<2>().squaredNorm() * variance), kChi2Line, sum, inlier[i]);
      count(error * error / (line_a.head<2>().squaredNorm() * variance), kChi2Line, sum, inlier[i]);
    }
    return sum;
  }

  /// Triangulates all matches; keeps the points that lie in front of both cameras.
  TwoViewMotion reconstruct(const SE3& b_from_a) const {
    TwoViewMotion motion{b_from_a, std::vector<Vec3>(a_.size()), std::vector<uint8_t>(a_.size(), 0)};
    const Vec3 center_b = b_from_a.inverse().translation;
    std::vector<double> parallax;
    for (size_t i = 0; i < a_.size(); ++i) {
      constexpr TriangulationLimits kLimits{.min_parallax = 1e-5, .max_chi2 = 2 * kChi2Point};
      const auto point =
          triangulate(camera_, {SE3{}, pixels_a_[i], sigma_px_[i]}, {b_from_a, pixels_b_[i], sigma_px_[i]}, kLimits);
      if (!point) continue;
      motion.points[i] = *point;
      motion.good[i] = 1;
      parallax.push_back(parallax_angle(*point, Vec3::Zero(), center_b) * 180 / std::numbers::pi);
    }
    motion.num_good = static_cast<int>(parallax.size());
    if (motion.num_good >= options_.min_points) {
      const auto nth = parallax.begin() + options_.min_points - 1;
      std::ranges::nth_element(parallax, nth, std::greater{});
      motion.parallax_deg = *nth;
    }
    return motion;
  }

  const TwoViewOptions& options_;
  const PinholeCamera& camera_;
  std::span<const Vec2> pixels_a_, pixels_b_;
  std::vector<Vec2> a_, b_;       // on the plane z = 1
  std::vector<double> sigma_px_;  // [px]
  std::vector<double> sigma_;     // on the plane z = 1
};

}  // namespace

TwoViewResult reconstruct_two_views(const TwoViewOptions& options, const PinholeCamera& camera,
                                    std::span<const Vec2> pixels_a, std::span<const Vec2> pixels_b,
                                    std::span<const double> sigmas) {
  PHOTOSLAM_CHECK(pixels_a.size() == pixels_b.size() && pixels_a.size() == sigmas.size(), "{}, {} and {}",
                  pixels_a.size(), pixels_b.size(), sigmas.size());
  return TwoViews(options, camera, pixels_a, pixels_b, sigmas).run();
}

}  // namespace photoslam
