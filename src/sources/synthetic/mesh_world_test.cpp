// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/mesh_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "io/image_file.h"
#include "io/temp_folder_test.h"
#include "sources/synthetic/sensor_model.h"
#include "sources/synthetic/synthetic_source.h"

namespace photoslam {
namespace {

/// What the camera makes of a colour of the mesh: its display value squared is linear light, then comes the tone curve
/// below the knee.
double seen(double value) {
  const double linear = std::pow(value / 255, 2);
  return 255 * (1.055 * std::pow(0.18 * std::pow(linear / 0.18, 1.15), 1 / 2.4) - 0.055);
}

constexpr PinholeCamera kCamera{.width = 64, .height = 48, .fx = 40, .fy = 40, .cx = 31.5, .cy = 23.5};

/// A wall of 8 x 8 m at z = 2 m, upright before a camera at the origin.
class MeshWorldTest : public TempFolderTest {
 protected:
  MeshWorldTest() { write("walk.txt", "10 0 0 0 0 0 0 1\n11 0 0 -1 0 0 0 1\n"); }

  MeshWorld open(const std::filesystem::path& mesh) {
    auto world = open_mesh_world(mesh, folder / "walk.txt", pool_);
    EXPECT_TRUE(world.ok()) << world.error().message;
    return *world;
  }
  /// Frame `index` at 1 Hz, without noise.
  Frame film(const MeshWorld& world, int index) {
    SyntheticOptions options;
    options.camera = kCamera;
    options.num_frames = 2;
    options.frames_per_second = 1;
    options.image_noise = options.depth_noise = options.depth_holes = 0;
    return SyntheticCamera(world.world, options).frame(index, pool_);
  }
  ThreadPool pool_{2};
};

TEST_F(MeshWorldTest, ShowsColoursAtVerticesAsTheyAreWithExactDepthAlongTheWalk) {
  const MeshWorld world = open(write("wall.ply",
                                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                     "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                                     "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                     "-4 -4 2 190 100 50\n4 -4 2 190 100 50\n4 4 2 190 100 50\n-4 4 2 190 100 50\n"
                                     "4 0 1 2 3\n"));
  EXPECT_DOUBLE_EQ(world.seconds, 1);
  for (int index : {0, 1}) {
    const Frame frame = film(world, index);
    const double metres = frame.depth(32, 24) * SyntheticCamera::kMetresPerDepthUnit;
    EXPECT_NEAR(metres, 2.0 + index, 1e-3);
    EXPECT_NEAR(frame.color(32, 24, 0), seen(190), 1.5);
    EXPECT_NEAR(frame.color(32, 24, 1), seen(100), 1.5);
    EXPECT_NEAR(frame.color(32, 24, 2), seen(50), 1.5);
  }
}

TEST_F(MeshWorldTest, PutsImagesUprightOnTheSurfaceAndRepeatsThem) {
  ImageU8 image(8, 8, 3);  // upper half red, lower half blue
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) image(x, y, y < 4 ? 0 : 2) = 190;
  }
  ASSERT_TRUE(write_png(folder / "halves.png", image).ok());
  write("wall.mtl", "newmtl halves\nmap_Kd halves.png\n");
  // The camera looks along z with y down: the upper edge of the wall is at y = -4. Two repetitions across and down.
  const MeshWorld world = open(write("wall.obj",
                                     "mtllib wall.mtl\nv -4 4 2\nv 4 4 2\nv 4 -4 2\nv -4 -4 2\nvt 0 0\nvt 2 0\nvt 2 2\n"
                                     "vt 0 2\nusemtl halves\nf 1/1 2/2 3/3 4/4\n"));
  const Frame frame = film(world, 0);
  // Rows 0 to 47 see y from -1.2 m to 1.2 m: the image's lower half above the middle, its upper half below.
  for (int x : {4, 32, 60}) {
    EXPECT_NEAR(frame.color(x, 4, 2), seen(190), 2);
    EXPECT_NEAR(frame.color(x, 4, 0), 0, 3);
    EXPECT_NEAR(frame.color(x, 43, 0), seen(190), 2);
    EXPECT_NEAR(frame.color(x, 43, 2), 0, 3);
  }
}

TEST_F(MeshWorldTest, WithoutASurfaceThereIsNoDepth) {
  const MeshWorld world = open(write("speck.ply",
                                     "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                     "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                                     "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                     "5 5 2 9 9 9\n6 5 2 9 9 9\n5 6 2 9 9 9\n3 0 1 2\n"));
  const Frame frame = film(world, 0);
  EXPECT_EQ(frame.depth(32, 24), 0);
  EXPECT_LE(frame.color(32, 24, 0), 2);
}

TEST_F(MeshWorldTest, ErrorsNameTheFile) {
  write("wall.mtl", "newmtl gone\nmap_Kd gone.png\n");
  const auto mesh = write("wall.obj",
                          "mtllib wall.mtl\nv 0 0 1\nv 1 0 1\nv 1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl gone\n"
                          "f 1/1 2/2 3/3\n");
  const auto no_image = open_mesh_world(mesh, folder / "walk.txt", pool_);
  ASSERT_FALSE(no_image.ok());
  EXPECT_THAT(no_image.error().message, testing::HasSubstr("gone.png"));
  const auto no_walk = open_mesh_world(mesh, write("empty.txt", "# nothing\n"), pool_);
  ASSERT_FALSE(no_walk.ok());
  EXPECT_THAT(no_walk.error().message, testing::HasSubstr("empty.txt"));
}

}  // namespace
}  // namespace photoslam
