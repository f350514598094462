// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mapping_worker.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

TEST(MappingMessage, OnlyPosesAreReplacedByNewerOnes) {
  const auto map = std::make_shared<const MapSnapshot>();
  const auto message = [](std::shared_ptr<const MapSnapshot> brought, KeyframeId keyframe, bool saves = false) {
    MappingMessage result;
    result.update.map = std::move(brought);
    result.update.keyframe = keyframe;
    if (saves) result.update.session = std::make_shared<Archive>();
    return result;
  };
  const MappingMessage poses = message(map, {}), keyframe = message(map, KeyframeId(3)),
                       save = message(nullptr, {}, true), nothing = message(nullptr, {});
  EXPECT_TRUE(replaces(poses, poses));
  EXPECT_TRUE(replaces(keyframe, poses)) << "it brings all poses as well";
  EXPECT_FALSE(replaces(poses, keyframe));
  EXPECT_FALSE(replaces(keyframe, keyframe));
  EXPECT_FALSE(replaces(save, poses)) << "what is saved with them has them";
  EXPECT_FALSE(replaces(poses, save));
  EXPECT_FALSE(replaces(nothing, poses));
  MappingMessage training = poses;
  training.iterations = 1;
  EXPECT_FALSE(replaces(poses, training));
}

}  // namespace
}  // namespace photoslam
