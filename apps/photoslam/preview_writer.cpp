// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "preview_writer.h"

#include <algorithm>
#include <cmath>

#include "io/image_file.h"

namespace photoslam {
namespace {

constexpr double kIntervalSeconds = 1.0;
constexpr int kMargin = 12;  // pixels around the trajectory

void copy_into(const ImageU8& image, int x0, ImageU8& target) {
  for (int y = 0; y < image.height(); ++y) std::copy_n(image.row(y), 3 * image.width(), target.row(y) + 3 * x0);
}

void draw_dot(ImageU8& image, int x, int y, int radius, const uint8_t (&color)[3]) {
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const int px = x + dx, py = y + dy;
      if (px < 0 || py < 0 || px >= image.width() || py >= image.height()) continue;
      std::copy_n(color, 3, image.row(py) + 3 * px);
    }
  }
}

ImageU8 draw_trajectory(const std::vector<Vec3>& positions, int size) {
  ImageU8 plot(size, size, 3, 250);
  if (positions.empty()) return plot;
  Vec3 low = positions.front(), high = low;
  for (const Vec3& p : positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double extent = std::max({high.x() - low.x(), high.z() - low.z(), 1e-6});
  const Vec3 middle = 0.5 * (low + high);
  const auto column = [&](const Vec3& p) {
    return static_cast<int>(std::lround(0.5 * size + (p.x() - middle.x()) / extent * (size - 2 * kMargin)));
  };
  const auto row = [&](const Vec3& p) {
    return static_cast<int>(std::lround(0.5 * size - (p.z() - middle.z()) / extent * (size - 2 * kMargin)));
  };
  constexpr uint8_t kWay[3] = {90, 90, 90}, kNow[3] = {210, 30, 30};
  for (const Vec3& p : positions) draw_dot(plot, column(p), row(p), 0, kWay);
  draw_dot(plot, column(positions.back()), row(positions.back()), 2, kNow);
  return plot;
}

/// Active features and the others, on the left picture.
void draw_features(const KeyframeComparison& comparison, ImageU8& preview) {
  constexpr uint8_t kActive[3] = {40, 200, 60}, kInactive[3] = {240, 140, 20};
  for (const bool active : {false, true}) {
    for (const DepthPixel& feature : comparison.features) {
      if (feature.active != active) continue;
      const auto x = static_cast<int>(0.5f * feature.x), y = static_cast<int>(0.5f * feature.y);
      if (x + 1 < comparison.picture.width()) draw_dot(preview, x, y, 1, active ? kActive : kInactive);
    }
  }
}

}  // namespace

ImageU8 compose_preview(const Progress& progress) {
  const ImageU8& picture = progress.comparison->picture;
  ImageU8 preview(2 * picture.width() + picture.height(), picture.height(), 3);
  copy_into(picture, 0, preview);
  draw_features(*progress.comparison, preview);
  copy_into(progress.comparison->render, picture.width(), preview);
  copy_into(draw_trajectory(progress.positions, picture.height()), 2 * picture.width(), preview);
  return preview;
}

void PreviewWriter::show(const Progress& progress) {
  const bool is_due = first_ || progress.phase == Progress::Phase::done || since_last_.seconds() >= kIntervalSeconds;
  if (path_.empty() || !progress.comparison || !is_due) return;
  first_ = false;
  since_last_.restart();
  const Status status = write_png(path_, compose_preview(progress));
  failure_ = status ? "" : status.error().message;
}

}  // namespace photoslam
