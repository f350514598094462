// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/landmark_chunk.h"

#include <gtest/gtest.h>

#include <map>

#include "base/random.h"

namespace photoslam {
namespace {

TEST(LandmarkChunk, FindsWhatAMapOfTheSlotsFinds) {
  Random random(3);
  for (const double share : {0.0, 0.02, 0.5, 1.0}) {
    LandmarkChunk chunk;
    std::map<int, double> alive;
    std::map<int, LandmarkId> replaced;
    for (int slot = 0; slot < LandmarkChunk::kSize; ++slot) {
      if (random.uniform() < share) {
        LandmarkView view;
        view.position.x() = alive[slot] = random.uniform();
        chunk.add(slot, view);
      } else if (random.uniform() < 0.2) {
        chunk.replace(slot, replaced[slot] = LandmarkId(random.index(1000)));
      }
    }
    for (int slot = 0; slot < LandmarkChunk::kSize; ++slot) {
      const LandmarkView* view = chunk.find(slot);
      ASSERT_EQ(view != nullptr, alive.contains(slot));
      if (view != nullptr) {
        EXPECT_EQ(view->position.x(), alive[slot]);
      }
      EXPECT_EQ(chunk.replacement(slot), replaced.contains(slot) ? replaced[slot] : LandmarkId());
    }
  }
}

}  // namespace
}  // namespace photoslam
