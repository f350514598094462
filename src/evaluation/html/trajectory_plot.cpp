// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/trajectory_plot.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "evaluation/html/time_plot.h"

namespace photoslam::html {
namespace {

using Plane = Eigen::Matrix<double, 2, 3>;

constexpr double kWidth = 620, kMargin = 30, kFooter = 34;
constexpr double kLeastHeight = 240, kLargestHeight = 620;

/// The two directions of largest motion as rows; their signs are fixed by the largest component.
Plane ground_plane(const Trajectory& trajectory) {
  Vec3 mean = Vec3::Zero();
  for (const StampedPose& pose : trajectory) mean += pose.world_from_camera.translation;
  mean /= static_cast<double>(trajectory.size());
  Mat3 covariance = Mat3::Zero();
  for (const StampedPose& pose : trajectory) {
    const Vec3 offset = pose.world_from_camera.translation - mean;
    covariance += offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(covariance);  // eigenvalues in increasing order
  Plane plane;
  for (int row = 0; row < 2; ++row) {
    const Vec3 axis = solver.eigenvectors().col(2 - row);
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    plane.row(row) = (axis[largest] < 0 ? -axis : axis).transpose();
  }
  return plane;
}

/// Maps positions to the picture and draws.
class Drawing {
 public:
  Drawing(const Trajectory& estimate, const Trajectory& truth)
      : plane_(ground_plane(truth.empty() ? estimate : truth)) {
    for (const Trajectory* trajectory : {&estimate, &truth}) {
      for (const StampedPose& pose : *trajectory) {
        const Vec2 p = plane_ * pose.world_from_camera.translation;
        low_ = low_.cwiseMin(p);
        high_ = high_.cwiseMax(p);
      }
    }
    const Vec2 extent = (high_ - low_).cwiseMax(1e-3);
    scale_ = std::min((kWidth - 2 * kMargin) / extent.x(), (kLargestHeight - 2 * kMargin - kFooter) / extent.y());
    height_ = std::max(kLeastHeight, scale_ * extent.y() + 2 * kMargin + kFooter);
  }

  std::string draw(const Trajectory& estimate, const Trajectory& truth) {
    add("<svg class=\"map\" viewBox=\"0 0 {} {:.0f}\" role=\"img\">", kWidth, height_);
    add("<path class=\"curve truth\" d=\"{}\"/>", path(truth));
    add("<path class=\"curve estimate\" d=\"{}\"/>", path(estimate));
    if (!estimate.empty()) {
      const Vec2 start = position(estimate.front()), end = position(estimate.back());
      add("<circle class=\"start\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>", start.x(), start.y());
      add("<circle class=\"end\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", end.x(), end.y());
    }
    draw_scale_bar();
    add("</svg>\n");
    return std::move(svg_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<Args>(args)...);
  }

  Vec2 position(const StampedPose& pose) const {
    const Vec2 offset = scale_ * (plane_ * pose.world_from_camera.translation - (low_ + high_) / 2);
    return {kWidth / 2 + offset.x(), (height_ - kFooter) / 2 - offset.y()};
  }

  /// Interrupted where poses are missing.
  std::string path(const Trajectory& trajectory) const {
    std::vector<double> seconds;
    for (const StampedPose& pose : trajectory) seconds.push_back(static_cast<double>(pose.timestamp_ns) * 1e-9);
    const double gap = gap_threshold(seconds);
    std::string result;
    for (size_t i = 0; i < trajectory.size(); ++i) {
      const bool connected = i > 0 && seconds[i] - seconds[i - 1] <= gap;
      const Vec2 p = position(trajectory[i]);
      fmt::format_to(std::back_inserter(result), "{}{:.1f} {:.1f}", connected ? 'L' : 'M', p.x(), p.y());
    }
    return result;
  }

  void draw_scale_bar() {
    const double metres = round_ticks(0, kWidth / scale_, 5).at(1);
    const double y = height_ - 14;
    add("<path class=\"bar\" d=\"M{0} {1:.1f}v5h{2:.1f}v-5\"/>", kMargin, y - 5, metres * scale_);
    add("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{:.6g} m</text>", kMargin + metres * scale_ + 8, y + 2, metres);
  }

  const Plane plane_;
  Vec2 low_ = Vec2::Constant(1e300), high_ = Vec2::Constant(-1e300);  // [m]
  double scale_ = 1;                                                  // picture units per metre
  double height_ = 0;
  std::string svg_;
};

}  // namespace

std::string draw_trajectories(const Trajectory& estimate, const Trajectory& truth) {
  if (estimate.empty() && truth.empty()) return {};
  return Drawing(estimate, truth).draw(estimate, truth);
}

}  // namespace photoslam::html
