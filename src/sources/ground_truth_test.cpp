// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/ground_truth.h"

#include <gmock/gmock.h>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

class GroundTruthTest : public TempFolderTest {
 protected:
  std::string failure(std::string_view content) const {
    return read_ground_truth(write("traj.txt", content)).error().message;
  }
};

TEST_F(GroundTruthTest, ReadsTum) {
  write("groundtruth.txt", "# t x y z q\n5.5 1 2 3 0 0 0 1\n");
  EXPECT_EQ(find_ground_truth(folder), folder / "groundtruth.txt");
  const Trajectory truth = read_ground_truth(folder).value();
  ASSERT_EQ(truth.size(), 1u);
  EXPECT_EQ(truth[0].timestamp_ns, 5'500'000'000);
  EXPECT_EQ(truth[0].world_from_camera.translation, Vec3(1, 2, 3));
}

TEST_F(GroundTruthTest, ReadsReplica) {
  write("traj.txt", "1 0 0 4  0 1 0 5  0 0 1 6  0 0 0 1\n0 -1 0 7  1 0 0 8  0 0 1 9  0.0e+00 0 0 1\n");
  write("results/readme", "");
  for (const auto& path : {folder, folder / "results", folder / "traj.txt"}) {
    const Trajectory truth = read_ground_truth(path).value();
    ASSERT_EQ(truth.size(), 2u);
    EXPECT_EQ(truth[1].timestamp_ns, 33'333'333);
    EXPECT_EQ(truth[1].world_from_camera.translation, Vec3(7, 8, 9));
    // The matrix takes the camera to the world: the camera's x axis points along the world's y.
    EXPECT_LT((truth[1].world_from_camera.rotation * Vec3(1, 0, 0) - Vec3(0, 1, 0)).norm(), 1e-12);
  }
}

TEST_F(GroundTruthTest, AbsenceIsNoError) {
  EXPECT_FALSE(find_ground_truth(folder).has_value());
  EXPECT_THAT(read_ground_truth(folder).error().message, HasSubstr("has no true trajectory"));
}

TEST_F(GroundTruthTest, ErrorsNameTheLine) {
  const std::string good = "1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n";
  EXPECT_THAT(failure(good + "1 0 0 4 0 1 0 5 0 0 1 6\n"), HasSubstr("traj.txt:2: expected the 16 numbers"));
  EXPECT_THAT(failure(good + "1 0 0 x 0 1 0 5 0 0 1 6 0 0 0 1\n"), HasSubstr("traj.txt:2: 'x' is not a number"));
  EXPECT_THAT(failure(good + "2 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n"), HasSubstr("traj.txt:2: the upper left 3x3"));
  EXPECT_THAT(failure(good + "-1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n"), HasSubstr("traj.txt:2: the upper left 3x3"));
  EXPECT_THAT(failure(good + "1 0 0 4 0 1 0 5 0 0 1 6 0 0 1 1\n"), HasSubstr("traj.txt:2: the last four"));
  EXPECT_THAT(failure(""), HasSubstr("holds no poses"));
}

}  // namespace
}  // namespace photoslam
