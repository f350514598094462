// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

class MeshFileTest : public TempFolderTest {
 protected:
  std::string failure(const std::filesystem::path& path) const {
    const auto mesh = read_mesh(path);
    return mesh ? "" : mesh.error().message;
  }
};

TEST_F(MeshFileTest, ReadsColoursAtTheVerticesOfAPlyAndSplitsPolygons) {
  const auto path = write("square.ply",
                          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                          "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                          "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                          "0 0 2 255 0 0\n1 0 2 0 255 0\n1 1 2 0 0 255\n0 1 2 51 102 153\n4 0 1 2 3\n");
  const auto mesh = read_mesh(path);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->num_triangles(), 2u);
  ASSERT_EQ(mesh->positions.size(), 4u);
  EXPECT_EQ(mesh->positions[2], Eigen::Vector3f(1, 1, 2));
  EXPECT_TRUE(mesh->colors[3].isApprox(Eigen::Vector3f(0.2f, 0.4f, 0.6f), 1e-6f));
  EXPECT_TRUE(mesh->parts.front().image.empty());
}

TEST_F(MeshFileTest, FindsTheImagesOfAnObjBesideIt) {
  write("wall.mtl", "newmtl bricks\nmap_Kd textures\\bricks.png\n");
  const auto path = write("wall.obj",
                          "mtllib wall.mtl\nv 0 0 1\nv 1 0 1\nv 1 1 1\nvt 0 0\nvt 1 0\nvt 1 0.5\nusemtl bricks\n"
                          "f 1/1 2/2 3/3\n");
  const auto mesh = read_mesh(path);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  ASSERT_EQ(mesh->parts.size(), 1u);
  EXPECT_EQ(mesh->parts.front().image, folder / "textures/bricks.png");
  ASSERT_EQ(mesh->uvs.size(), 3u);
  EXPECT_EQ(mesh->uvs[2], Eigen::Vector2f(1, 0.5f));
}

TEST_F(MeshFileTest, ErrorsNameTheFileAndWhatIsMissing) {
  EXPECT_THAT(failure(folder / "none.ply"), testing::HasSubstr("none.ply"));
  EXPECT_THAT(failure(write("text.obj", "hello\n")), testing::HasSubstr("text.obj: has no faces"));
  EXPECT_THAT(failure(write("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n")),
              testing::HasSubstr("broken.ply: the PLY header has no end"));
  EXPECT_THAT(failure(write("range.obj", "v 0 0 1 1 1 1\nv 1 0 1 1 1 1\nv 1 1 1 1 1 1\nf 1 2 4\n")),
              testing::HasSubstr("range.obj: line 4: a face: vertex '4' is none of the 3 before it"));
  EXPECT_THAT(failure(write("lib.obj", "mtllib gone.mtl\n")), testing::HasSubstr("gone.mtl"));
  EXPECT_THAT(failure(write("plain.obj", "v 0 0 1\nv 1 0 1\nv 1 1 1\nf 1 2 3\n")),
              testing::HasSubstr("plain.obj: line 4: a face has neither colours at its vertices"));
  EXPECT_THAT(failure(write("points.ply",
                            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                            "property float y\nproperty float z\nend_header\n0 0 0\n")),
              testing::HasSubstr("points.ply: the vertices have no property 'red'"));
}

const std::string kHeader =
    "ply\nformat binary_little_endian 1.0\ncomment made here\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
    "property list uchar uint vertex_index\nend_header\n";

std::string binary_triangle() {
  std::string data = kHeader;
  const auto put = [&](auto value) { data.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const float x : {0.0f, 1.0f, 2.0f}) {
    put(x), put(0.5f), put(2.0);
    for (const uint8_t channel : {uint8_t{255}, uint8_t{0}, uint8_t{51}}) put(channel);
  }
  put(uint8_t{3});
  for (const uint32_t index : {0u, 1u, 2u}) put(index);
  return data;
}

TEST_F(MeshFileTest, ReadsBinaryPly) {
  const auto mesh = read_mesh(write("triangle.ply", binary_triangle()));
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->positions[1], Eigen::Vector3f(1, 0.5f, 2));
  EXPECT_TRUE(mesh->colors[2].isApprox(Eigen::Vector3f(1, 0, 0.2f), 1e-6f));
  EXPECT_EQ(mesh->parts.front().triangles.front(), (MeshFile::Triangle{0, 1, 2}));
}

TEST_F(MeshFileTest, EveryTruncationIsAnErrorAndNothingHangs) {
  const std::string whole = binary_triangle();
  for (size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(failure(write("cut.ply", whole.substr(0, length))), "") << length;
  }
}

TEST_F(MeshFileTest, DamagedBytesNeverCrash) {
  const std::string whole = binary_triangle();
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const char byte : {'\0', '9', '\xFF'}) {
      std::string damaged = whole;
      damaged[at] = byte;
      (void)internal::parse_ply_mesh(damaged);
    }
  }
}

}  // namespace
}  // namespace photoslam
