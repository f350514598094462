// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/connected_components.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

/// A map of keyframes with these parents (−1: none) and pairs of covisible keyframes.
MapSnapshot make_map(const std::vector<int>& parents, const std::vector<std::pair<int, int>>& covisible = {}) {
  MapSnapshot map;
  for (size_t i = 0; i < parents.size(); ++i) {
    auto view = std::make_shared<KeyframeView>();
    view->keyframe.id = KeyframeId(static_cast<int>(i));
    view->keyframe.parent = KeyframeId(parents[i]);
    for (const auto& [a, b] : covisible) {
      if (a == static_cast<int>(i)) view->covisible.push_back({KeyframeId(b), 20});
    }
    map.keyframes.push_back(std::move(view));
  }
  return map;
}

TEST(ConnectedComponents, AnUnbrokenTreeIsOnePart) {
  EXPECT_EQ(connected_components(make_map({-1, 0, 1, 1, 3})), (std::vector<int>{0, 0, 0, 0, 0}));
  EXPECT_TRUE(connected_components({}).empty());
}

TEST(ConnectedComponents, EveryRootBeginsAPart) {
  EXPECT_EQ(connected_components(make_map({-1, 0, -1, 2, 1, -1})), (std::vector<int>{0, 0, 1, 1, 0, 2}));
}

TEST(ConnectedComponents, CovisibleKeyframesConnectParts) {
  EXPECT_EQ(connected_components(make_map({-1, 0, -1, 2, -1}, {{3, 1}})), (std::vector<int>{0, 0, 0, 0, 1}));
}

}  // namespace
}  // namespace photoslam
