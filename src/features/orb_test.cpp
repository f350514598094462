// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/orb.h"

#include <gtest/gtest.h>

#include <numbers>

#include "features/corner_refinement.h"
#include "features/fast.h"
#include "features/test_images.h"

namespace photoslam {
namespace {

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(CornerRefinement, ReducesTheError) {
  // The same scene twice, moved by a fraction of a pixel: how well does the distance between corners tell the motion?
  const RectangleScene scene(400, 300, 80, 1);
  std::vector<double> pixel_errors, refined_errors;
  PaddedImage a(scene.render(400, 300, [](double&, double&) {}));
  std::vector<uint8_t> scratch;
  std::vector<Corner> corners_a;
  detect_fast(a.view(), 16, 20, scratch, corners_a);
  for (const auto& [mx, my] : {std::pair(0.5, 0.25), std::pair(-0.3, 0.6), std::pair(0.2, 0.1), std::pair(0.4, -0.5)}) {
    PaddedImage b(scene.render(400, 300, [mx = mx, my = my](double& x, double& y) { x -= mx, y -= my; }));
    std::vector<Corner> corners_b;
    detect_fast(b.view(), 16, 20, scratch, corners_b);
    for (const Corner& ca : corners_a) {
      for (const Corner& cb : corners_b) {
        if (std::hypot(cb.x - ca.x - mx, cb.y - ca.y - my) > 1.5) continue;
        pixel_errors.push_back(std::hypot(cb.x - ca.x - mx, cb.y - ca.y - my));
        const auto pa = refine_corner(a.view(), ca.x, ca.y), pb = refine_corner(b.view(), cb.x, cb.y);
        refined_errors.push_back(std::hypot(pb.x - pa.x - mx, pb.y - pa.y - my));
      }
    }
  }
  ASSERT_GT(pixel_errors.size(), 300u);
  EXPECT_LT(median(refined_errors), 0.75 * median(pixel_errors))
      << median(refined_errors) << " px instead of " << median(pixel_errors) << " px";
}

TEST(Orb, FindsTheSamePointsAfterTurningAndScaling) {
  constexpr int kWidth = 480, kHeight = 360;
  const RectangleScene scene(kWidth, kHeight, 250, 2);
  const double angle = 0.4, scale = 1.25;
  const auto scene_from_b = [&](double& x, double& y) {
    const double dx = (x - kWidth / 2.0) / scale, dy = (y - kHeight / 2.0) / scale;
    x = kWidth / 2.0 + std::cos(angle) * dx - std::sin(angle) * dy;
    y = kHeight / 2.0 + std::sin(angle) * dx + std::cos(angle) * dy;
  };
  OrbExtractor extractor{OrbOptions{}};
  Features a, b;
  extractor.extract(scene.render(kWidth, kHeight, [](double&, double&) {}), a);
  extractor.extract(scene.render(kWidth, kHeight, scene_from_b), b);

  int inside = 0, correct = 0, wrong = 0;
  std::vector<double> turns;
  for (size_t j = 0; j < b.size(); ++j) {
    double x = b.keypoints[j].x, y = b.keypoints[j].y;
    scene_from_b(x, y);
    if (x < 25 || y < 25 || x > kWidth - 25 || y > kHeight - 25) continue;
    ++inside;
    size_t best = 0;
    int distance = 257, second = 257;
    for (size_t i = 0; i < a.size(); ++i) {
      const int d = hamming_distance(a.descriptors[i], b.descriptors[j]);
      // Neighbouring octaves hold the same corner again: only others count as second.
      if (d < distance) {
        if (std::hypot(a.keypoints[i].x - a.keypoints[best].x, a.keypoints[i].y - a.keypoints[best].y) > 5)
          second = distance;
        distance = d;
        best = i;
      } else if (d < second &&
                 std::hypot(a.keypoints[i].x - a.keypoints[best].x, a.keypoints[i].y - a.keypoints[best].y) > 5) {
        second = d;
      }
    }
    if (distance > 60 || distance > 0.8 * second) continue;
    const Keypoint& match = a.keypoints[best];
    const bool same = std::hypot(match.x - x, match.y - y) < 2 * std::pow(1.2, match.octave);
    same ? ++correct : ++wrong;
    if (same) turns.push_back(std::remainder(b.keypoints[j].angle - match.angle + angle, 2 * std::numbers::pi));
  }
  EXPECT_GT(inside, 500);

  EXPECT_GT(correct, 0.4 * inside) << wrong << " wrong";
  EXPECT_LT(wrong, correct / 10);
  EXPECT_LT(std::abs(median(turns)), 0.02);
}

TEST(Orb, GivesAboutAsManyAsAskedForEvenlySpread) {
  const ImageU8 image = RectangleScene(640, 480, 150, 3).render(640, 480, [](double&, double&) {});
  for (int count : {300, 1000}) {
    OrbOptions options;
    options.num_features = count;
    Features features;
    OrbExtractor(options).extract(image, features);
    EXPECT_LE(features.size(), static_cast<size_t>(count));
    EXPECT_GT(features.size(), static_cast<size_t>(0.95 * count));
    int per_cell[4][4] = {};
    for (const Keypoint& k : features.keypoints) ++per_cell[static_cast<int>(k.y / 120)][static_cast<int>(k.x / 160)];
    for (const auto& row : per_cell) {
      for (int n : row) EXPECT_GT(n, count / 16 / 4);
    }
  }
}

TEST(Orb, WeakCornersCountOnlyWhereThereAreNoStrongOnes) {
  // Left: strong squares. Right: squares of 12 grey levels, below fast_threshold, above min_fast_threshold.
  ImageU8 image(320, 240, 1, 100);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if ((x / 20) % 2 == 0 && (y / 20) % 2 == 0) image(x, y) = x < 160 ? 200 : 112;
    }
  }
  Features features;
  OrbExtractor(OrbOptions{}).extract(image, features);
  int strong = 0, weak = 0;
  for (const Keypoint& k : features.keypoints) (k.x < 160 ? strong : weak)++;
  EXPECT_GT(strong, 50);
  EXPECT_GT(weak, 50);
}

TEST(Orb, IsDeterministicAndKeepsNoStateBetweenImages) {
  const ImageU8 image = RectangleScene(320, 240, 200, 4).render(320, 240, [](double&, double&) {});
  OrbExtractor fresh{OrbOptions{}}, used{OrbOptions{}};
  Features a, b;
  used.extract(random_image(500, 300, 1), b);
  used.extract(image, b);
  fresh.extract(image, a);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.keypoints[i].x, b.keypoints[i].x);
    EXPECT_EQ(a.keypoints[i].y, b.keypoints[i].y);
    EXPECT_EQ(a.keypoints[i].angle, b.keypoints[i].angle);
  }
}

TEST(Orb, ImagesWithoutCornersGiveNoFeatures) {
  OrbExtractor extractor{OrbOptions{}};
  Features features;
  extractor.extract(random_image(63, 480, 1), features);
  EXPECT_EQ(features.size(), 0u);
  extractor.extract(ImageU8(640, 480, 1, 128), features);
  EXPECT_EQ(features.size(), 0u);
  extractor.extract(random_image(64, 64, 1), features);
  EXPECT_GT(features.size(), 0u);
}

}  // namespace
}  // namespace photoslam
