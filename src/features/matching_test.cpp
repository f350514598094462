// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "base/random.h"

namespace photoslam {
namespace {

Descriptor random_descriptor(Random& random) { return {random.next(), random.next(), random.next(), random.next()}; }

Descriptor with_flipped_bits(Descriptor descriptor, int count, Random& random) {
  for (int i = 0; i < count; ++i) {
    const int bit = random.index(256);
    descriptor[static_cast<size_t>(bit / 64)] ^= uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

Features random_features(int count, int width, int height, Random& random) {
  Features features;
  for (int i = 0; i < count; ++i) {
    features.keypoints.push_back({.x = static_cast<float>(random.uniform(0, width)),
                                  .y = static_cast<float>(random.uniform(0, height)),
                                  .angle = static_cast<float>(random.uniform(0, 2 * std::numbers::pi)),
                                  .octave = random.index(3)});
    features.descriptors.push_back(random_descriptor(random));
  }
  return features;
}

TEST(Hamming, CountsDifferingBits) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Descriptor a = random_descriptor(random), b = random_descriptor(random);
    int expected = 0;
    for (size_t bit = 0; bit < 256; ++bit) expected += ((a[bit / 64] ^ b[bit / 64]) >> (bit % 64)) & 1 ? 1 : 0;
    EXPECT_EQ(hamming_distance(a, b), expected);
  }
  EXPECT_EQ(hamming_distance(Descriptor{}, Descriptor{~0ull, ~0ull, ~0ull, ~0ull}), 256);
}

TEST(KeypointGrid, FindsEveryKeypointNearAPixelOnce) {
  Random random(2);
  Features features = random_features(500, 330, 250, random);
  features.keypoints[0].x = -5;  // Undistorted keypoints may lie outside.
  features.keypoints[1].y = 1000;
  KeypointGrid grid;
  grid.build(features.keypoints, 330, 250);
  for (int trial = 0; trial < 200; ++trial) {
    const float x = static_cast<float>(random.uniform(-40, 370)), y = static_cast<float>(random.uniform(-40, 290));
    const float radius = static_cast<float>(random.uniform(0, 60));
    std::vector<int> found;
    grid.for_each_near(x, y, radius, [&](int i) { found.push_back(i); });
    std::sort(found.begin(), found.end());
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    for (int i = 0; i < 500; ++i) {
      const Keypoint& k = features.keypoints[static_cast<size_t>(i)];
      if (std::hypot(k.x - x, k.y - y) > radius) continue;
      EXPECT_TRUE(std::binary_search(found.begin(), found.end(), i));
    }
  }
}

TEST(KeypointGrid, EmptyOrOddQueriesFindNothingOrSomethingButDoNotFail) {
  KeypointGrid grid;
  int visits = 0;
  grid.for_each_near(3, 3, 10, [&](int) { ++visits; });
  grid.build({}, 100, 100);
  grid.for_each_near(std::nanf(""), 3, 10, [&](int) { ++visits; });
  grid.for_each_near(1e30f, -1e30f, 10, [&](int) { ++visits; });
  EXPECT_EQ(visits, 0);
}

class ProjectionMatcherTest : public testing::Test {
 protected:
  ProjectionMatcherTest() : features(random_features(400, 320, 240, random)) {
    grid.build(features.keypoints, 320, 240);
  }
  ProjectionQuery query_of(int i, int flipped_bits) {
    const auto n = static_cast<size_t>(i);
    const Keypoint& k = features.keypoints[n];
    return {.x = k.x + 2,
            .y = k.y - 1,
            .radius = 5,
            .min_octave = k.octave,
            .max_octave = k.octave,
            .angle = k.angle,
            .descriptor = with_flipped_bits(features.descriptors[n], flipped_bits, random)};
  }
  ProjectionMatcher::Target target() const { return {features, grid, u_right, taken}; }

  Random random{3};
  Features features;
  KeypointGrid grid;
  std::vector<float> u_right;
  std::vector<uint8_t> taken;
  MatchOptions options;
  ProjectionMatcher matcher;
  std::vector<int> matches;
};

TEST_F(ProjectionMatcherTest, FindsTheProjectedLandmarks) {
  std::vector<ProjectionQuery> queries;
  for (int i = 0; i < 400; ++i) queries.push_back(query_of(i, 30));
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 400);
  for (int i = 0; i < 400; ++i) EXPECT_EQ(matches[static_cast<size_t>(i)], i);
}

TEST_F(ProjectionMatcherTest, RespectsRadiusOctaveDistanceAndRightColumn) {
  ProjectionQuery far = query_of(5, 0), octave = query_of(6, 0), different = query_of(7, 0), right = query_of(8, 0);
  far.radius = 2.2f;  // The prediction is 2.24 px off.
  octave.min_octave = octave.max_octave = features.keypoints[6].octave + 1;
  for (uint64_t& word : different.descriptor) word ^= 0xFFFFFFFF;  // 128 bits differ.
  right.u_right = 100;
  u_right.assign(400, 120);
  const ProjectionQuery queries[] = {far, octave, different, right};
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 0);
  u_right[8] = std::nanf("");
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 1);
  EXPECT_EQ(matches[3], 8);
  taken.assign(400, 0);
  taken[8] = 1;
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 0);
}

TEST_F(ProjectionMatcherTest, AKeypointGoesToTheMostSimilarLandmark) {
  const ProjectionQuery queries[] = {query_of(9, 40), query_of(9, 5), query_of(9, 60)};
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 1);
  EXPECT_EQ(matches, (std::vector<int>{kNoMatch, 9, kNoMatch}));
}

TEST_F(ProjectionMatcherTest, RatioTestDropsTwinsOfTheSameOctave) {
  features.keypoints[11] = features.keypoints[10];
  features.descriptors[11] = with_flipped_bits(features.descriptors[10], 2, random);
  grid.build(features.keypoints, 320, 240);
  options.max_ratio = 0.8;
  ProjectionQuery query = query_of(10, 30);
  EXPECT_EQ(matcher.match(options, target(), {&query, 1}, matches), 0);
  features.keypoints[11].octave += 1;
  query.max_octave += 1;
  EXPECT_EQ(matcher.match(options, target(), {&query, 1}, matches), 1);
}

TEST_F(ProjectionMatcherTest, DropsMatchesThatTurnedDifferently) {
  std::vector<ProjectionQuery> queries;
  for (int i = 0; i < 100; ++i) {
    queries.push_back(query_of(i, 10));
    // All turned by 0.2 rad, but every tenth by an angle of its own.
    queries.back().angle -= i % 10 == 0 ? 1.0f + 0.05f * static_cast<float>(i) : 0.2f;
  }
  queries[10].angle = std::nanf("");
  EXPECT_EQ(matcher.match(options, target(), queries, matches), 91);
  for (size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(matches[i], i % 10 != 0 || i == 10 ? static_cast<int>(i) : kNoMatch);
  }
}

TEST(BruteForce, FindsMutualNearestNeighbours) {
  Random random(4);
  const Features a = random_features(200, 100, 100, random);
  Features b = random_features(300, 100, 100, random);
  for (size_t i = 0; i < 150; ++i) {
    b.descriptors[2 * i] = with_flipped_bits(a.descriptors[i], 30, random);
    b.keypoints[2 * i].angle = a.keypoints[i].angle + 1;
  }
  std::vector<int> matches;
  MatchOptions options{.max_distance = 60, .max_ratio = 0.8};
  EXPECT_EQ(match_brute_force(options, a, b, matches), 150);
  for (size_t i = 0; i < 200; ++i) EXPECT_EQ(matches[i], i < 150 ? static_cast<int>(2 * i) : kNoMatch);
}

TEST(Rotations, NoneOrUnknownAreKept) {
  std::vector<uint8_t> keep;
  select_consistent_rotations({}, keep);
  EXPECT_TRUE(keep.empty());
  const float rotations[] = {std::nanf(""), 0.1f, -0.05f, 6.27f};
  select_consistent_rotations(rotations, keep);
  EXPECT_EQ(keep, (std::vector<uint8_t>{1, 1, 1, 1}));
}

}  // namespace
}  // namespace photoslam
