// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/absolute_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

/// Real roots of c3 x³ + c2 x² + c1 x + c0; returns their number.
int solve_cubic(double c0, double c1, double c2, double c3, double roots[3]) {
  // x = y - shift with y³ + p y + q = 0.
  const double b = c2 / c3, c = c1 / c3, d = c0 / c3, shift = b / 3;
  if (!std::isfinite(b) || !std::isfinite(c) || !std::isfinite(d)) return 0;
  const double p = c - b * b / 3, q = 2 * b * b * b / 27 - b * c / 3 + d;
  const double discriminant = q * q / 4 + p * p * p / 27;
  int count = 0;
  if (discriminant > 0) {
    const double root = std::sqrt(discriminant);
    // The sum without cancellation; the other cube root follows from u v = -p / 3.
    const double u = std::cbrt(q > 0 ? -q / 2 - root : -q / 2 + root);
    roots[count++] = (u == 0 ? 0 : u - p / (3 * u)) - shift;
  } else {
    const double radius = std::sqrt(std::max(0.0, -p / 3));
    const double cosine = radius == 0 ? 0 : std::clamp(-q / (2 * radius * radius * radius), -1.0, 1.0);
    const double angle = std::acos(cosine) / 3;
    for (int k = 0; k < 3; ++k) roots[count++] = 2 * radius * std::cos(angle - k * 2 * M_PI / 3) - shift;
  }
  for (int i = 0; i < count; ++i) {
    double& x = roots[i];
    for (int iteration = 0; iteration < 2; ++iteration) {
      const double slope = (3 * x + 2 * b) * x + c;
      if (slope != 0) x -= (((x + b) * x + c) * x + d) / slope;
    }
  }
  return count;
}

/// adj(m) with m adj(m) = det(m) I, for a symmetric matrix.
Mat3 adjugate(const Mat3& m) {
  Mat3 result;
  result.row(0) = m.col(1).cross(m.col(2));
  result.row(1) = m.col(2).cross(m.col(0));
  result.row(2) = m.col(0).cross(m.col(1));
  return result;
}

/// The three squared side lengths as quadratic forms of the distances d: dᵀ form[k] d = length[k].
struct Triangle {
  static constexpr int kSides[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  Mat3 form[3];
  double length[3];

  Triangle(const Vec3 points[3], const Vec3 rays[3]) {
    for (int k = 0; k < 3; ++k) {
      const int i = kSides[k][0], j = kSides[k][1];
      length[k] = (points[i] - points[j]).squaredNorm();
      form[k].setZero();
      form[k](i, i) = form[k](j, j) = 1;
      form[k](i, j) = form[k](j, i) = -rays[i].dot(rays[j]);
    }
  }

  /// Newton's method on the three lengths; false when the distances do not explain them.
  bool polish(Vec3& d) const {
    Vec3 error;
    for (int iteration = 0; iteration < 3; ++iteration) {
      Mat3 jacobian;
      for (int k = 0; k < 3; ++k) {
        error[k] = d.dot(form[k] * d) - length[k];
        jacobian.row(k) = 2 * (form[k] * d).transpose();
      }
      const Vec3 step = jacobian.partialPivLu().solve(error);
      if (!step.allFinite()) return false;
      d -= step;
    }
    return error.norm() < 1e-6 * (length[0] + length[1] + length[2]) && d.minCoeff() > 0;
  }
};

/// Pose from three points and where they lie in the camera frame.
SE3 pose_from_triangles(const Vec3 world[3], const Vec3 camera[3]) {
  const auto frame = [](const Vec3 p[3]) {
    Mat3 m;
    m.col(0) = p[1] - p[0];
    m.col(1) = p[2] - p[0];
    m.col(2) = m.col(0).cross(m.col(1));
    return m;
  };
  const Mat3 rotation = frame(camera) * frame(world).inverse();
  SE3 pose;
  pose.rotation = Quat(rotation).normalized();
  pose.translation = camera[0] - pose.rotation * world[0];
  return pose;
}

/// Intersects the pair of planes that make up the degenerate form with the cone of a second form: up to four
/// directions.
int intersect(const Mat3& degenerate, const Mat3& cone, Vec3 directions[4]) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(degenerate);
  const Vec3& values = eigen.eigenvalues();
  if (!(values[0] < 0 && values[2] > 0)) return 0;  // No real planes.
  const double ratio = std::sqrt(-values[0] / values[2]);
  int count = 0;
  for (double sign : {1.0, -1.0}) {
    const Vec3 normal = (eigen.eigenvectors().col(2) + sign * ratio * eigen.eigenvectors().col(0)).normalized();
    const Vec3 u = eigen.eigenvectors().col(1), v = normal.cross(u);
    // (u + τ v)ᵀ cone (u + τ v) = 0.
    const double a = v.dot(cone * v), b = u.dot(cone * v), c = u.dot(cone * u);
    const double discriminant = b * b - a * c;
    if (discriminant < 0) continue;
    const double q = -(b + std::copysign(std::sqrt(discriminant), b));
    // Roots q / a and c / q; as directions they need no division.
    directions[count++] = a * u + q * v;
    directions[count++] = q * u + c * v;
  }
  return count;
}

}  // namespace

int solve_p3p(const Vec3 points_in_world[3], const Vec3 rays_in_camera[3], SE3 camera_from_world[4]) {
  // The distances solve three quadratic forms. Two combinations without constant term span a pencil of cones; its
  // degenerate members are pairs of planes, which turn the quartic into quadratics (after Persson & Nordberg 2018).
  const Triangle triangle(points_in_world, rays_in_camera);
  const Mat3 first = triangle.length[2] * triangle.form[0] - triangle.length[0] * triangle.form[2];
  const Mat3 second = triangle.length[2] * triangle.form[1] - triangle.length[1] * triangle.form[2];
  double roots[3];
  const int num_roots = solve_cubic(first.determinant(), (adjugate(first) * second).trace(),
                                    (adjugate(second) * first).trace(), second.determinant(), roots);
  Vec3 directions[4];
  int num_directions = 0;
  for (int i = 0; i < num_roots && num_directions == 0; ++i) {
    num_directions = intersect(first + roots[i] * second, second, directions);
  }

  int count = 0;
  for (int i = 0; i < num_directions; ++i) {
    Vec3 d = directions[i];
    const double squared = d.dot(triangle.form[2] * d);
    if (!(squared > 0)) continue;
    d *= std::copysign(std::sqrt(triangle.length[2] / squared), d.sum());
    if (!(d.minCoeff() > 0) || !triangle.polish(d)) continue;
    const Vec3 in_camera[3] = {d[0] * rays_in_camera[0], d[1] * rays_in_camera[1], d[2] * rays_in_camera[2]};
    const SE3 pose = pose_from_triangles(points_in_world, in_camera);
    if (pose.rotation.coeffs().allFinite() && pose.translation.allFinite()) camera_from_world[count++] = pose;
  }
  return count;
}

void PoseRansacOptions::visit(OptionVisitor& visitor) {
  visitor.value({"max_iterations", "", 1, 100000, "Samples of three correspondences."}, max_iterations);
  visitor.value({"min_inliers", "", 4, 1000, "Fewer agreeing correspondences count as a failure."}, min_inliers);
  visitor.value({"max_error_px", "px", 0.1, 100, "Reprojection error up to which a correspondence agrees."},
                max_error_px);
  visitor.value({"confidence", "", 0.5, 1, "Stops when a better pose was missed with a probability below 1 − this."},
                confidence);
  visitor.value({"seed", "", 0, 1e9, "Seed of the sampling."}, seed);
}

namespace {

class PoseRansac {
 public:
  PoseRansac(const PoseRansacOptions& options, const PinholeCamera& camera, std::span<const Vec3> points,
             std::span<const Vec2> pixels, std::span<const double> sigmas)
      : options_(options), camera_(camera), points_(points), pixels_(pixels), sigmas_(sigmas) {
    for (size_t i = 0; i < points.size(); ++i) {
      rays_.push_back(camera.unproject(pixels[i], 1.0).normalized());
      if (points[i].allFinite() && pixels[i].allFinite()) usable_.push_back(static_cast<int>(i));
    }
  }

  PoseRansacResult run() {
    PoseRansacResult result;
    result.inlier.assign(points_.size(), 0);
    if (static_cast<int>(usable_.size()) < std::max(4, options_.min_inliers)) return result;
    Random random(static_cast<uint64_t>(options_.seed));
    SE3 best;
    double best_cost = std::numeric_limits<double>::infinity();
    int needed = options_.max_iterations;
    while (result.iterations < needed) {
      ++result.iterations;
      SE3 poses[4];
      const int num_poses = sample(random, poses);
      for (int i = 0; i < num_poses; ++i) {
        if (cost(poses[i]) >= best_cost) continue;
        // Local optimisation: a sample of three is noisy, the inliers it finds are not.
        SE3 pose = poses[i];
        for (int round = 0; round < 3; ++round) refine(pose);
        const double refined_cost = cost(pose), sample_cost = cost(poses[i]);
        best = refined_cost < sample_cost ? pose : poses[i];
        best_cost = std::min(refined_cost, sample_cost);
        needed = std::min(options_.max_iterations, iterations_needed(best));
      }
    }
    if (!std::isfinite(best_cost)) return result;
    for (int i : usable_) {
      const bool inlier = normalized_error(best, static_cast<size_t>(i)) <= 1;
      result.inlier[static_cast<size_t>(i)] = inlier;
      result.num_inliers += inlier;
    }
    result.camera_from_world = best;
    result.success = result.num_inliers >= options_.min_inliers;
    return result;
  }

 private:
  int sample(Random& random, SE3 poses[4]) const {
    Vec3 points[3], rays[3];
    int chosen[3];
    for (int k = 0; k < 3; ++k) {
      chosen[k] = usable_[static_cast<size_t>(random.index(static_cast<int>(usable_.size())))];
      for (int other = 0; other < k; ++other) {
        if (chosen[other] == chosen[k]) return 0;
      }
      points[k] = points_[static_cast<size_t>(chosen[k])];
      rays[k] = rays_[static_cast<size_t>(chosen[k])];
    }
    return solve_p3p(points, rays, poses);
  }

  /// Squared reprojection error relative to the threshold; infinite behind the camera.
  double normalized_error(const SE3& pose, size_t i) const {
    const Vec3 x = pose * points_[i];
    if (!(x.z() > 0)) return std::numeric_limits<double>::infinity();
    const double limit = options_.max_error_px * (sigmas_.empty() ? 1.0 : sigmas_[i]);
    return (camera_.project(x) - pixels_[i]).squaredNorm() / (limit * limit);
  }

  /// Truncated squared error, so that among equal counts the better fit wins (MSAC).
  double cost(const SE3& pose) const {
    double sum = 0;
    for (int i : usable_) sum += std::min(1.0, normalized_error(pose, static_cast<size_t>(i)));
    return sum;
  }

  int iterations_needed(const SE3& pose) const {
    double inliers = 0;
    for (int i : usable_) inliers += normalized_error(pose, static_cast<size_t>(i)) <= 1;
    const double good_sample = std::pow(inliers / static_cast<double>(usable_.size()), 3);
    if (good_sample >= 1) return 1;
    const double needed = std::log(1 - options_.confidence) / std::log(1 - good_sample);
    return static_cast<int>(std::min(needed, 1e9)) + 1;
  }

  /// One Gauss-Newton step on the reprojection error of the inliers.
  void refine(SE3& pose) const {
    Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
    Vec6 gradient = Vec6::Zero();
    for (int index : usable_) {
      const auto i = static_cast<size_t>(index);
      if (normalized_error(pose, i) > 1) continue;
      const Vec3 x = pose * points_[i];
      const double iz = 1 / x.z(), sigma = sigmas_.empty() ? 1.0 : sigmas_[i];
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << camera_.fx * iz, 0, -camera_.fx * x.x() * iz * iz, 0, camera_.fy * iz, -camera_.fy * x.y() * iz * iz;
      Eigen::Matrix<double, 2, 6> jacobian;
      jacobian << by_point, -by_point * hat(x);
      hessian += jacobian.transpose() * jacobian / (sigma * sigma);
      gradient += jacobian.transpose() * (camera_.project(x) - pixels_[i]) / (sigma * sigma);
    }
    const Vec6 step = -hessian.ldlt().solve(gradient);
    if (step.allFinite()) pose = SE3::exp(step) * pose;
  }

  const PoseRansacOptions& options_;
  const PinholeCamera& camera_;
  std::span<const Vec3> points_;
  std::span<const Vec2> pixels_;
  std::span<const double> sigmas_;
  std::vector<Vec3> rays_;
  std::vector<int> usable_;
};

}  // namespace

PoseRansacResult estimate_pose_ransac(const PoseRansacOptions& options, const PinholeCamera& camera,
                                      std::span<const Vec3> points_in_world, std::span<const Vec2> pixels,
                                      std::span<const double> sigmas) {
  PHOTOSLAM_CHECK(points_in_world.size() == pixels.size() && (sigmas.empty() || sigmas.size() == pixels.size()),
                  "{} points, {} pixels, {} sigmas", points_in_world.size(), pixels.size(), sigmas.size());
  return PoseRansac(options, camera, points_in_world, pixels, sigmas).run();
}

}  // namespace photoslam
