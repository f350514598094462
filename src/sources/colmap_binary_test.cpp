// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// The same models in both forms; the binary one is written here as COLMAP documents it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <type_traits>

#include "io/mutation_test.h"
#include "io/temp_folder_test.h"
#include "sources/posed_cameras.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

class BinaryFile {
 public:
  template <class T>
  BinaryFile& put(std::type_identity_t<T> value) {
    content.append(reinterpret_cast<const char*>(&value), sizeof(T));
    return *this;
  }
  BinaryFile& numbers(std::initializer_list<double> values) {
    for (const double value : values) put<double>(value);
    return *this;
  }
  BinaryFile& camera(uint32_t id, int32_t model, uint64_t width, uint64_t height, std::initializer_list<double> p) {
    return put<uint32_t>(id).put<int32_t>(model).put<uint64_t>(width).put<uint64_t>(height).numbers(p);
  }
  BinaryFile& image(uint32_t id, std::initializer_list<double> pose, uint32_t camera, const char* name, uint64_t seen) {
    put<uint32_t>(id).numbers(pose).put<uint32_t>(camera);
    content.append(name, std::strlen(name) + 1);
    put<uint64_t>(seen);
    for (uint64_t i = 0; i < seen; ++i) numbers({1.5, 2.5}).put<int64_t>(i == 0 ? -1 : 4);
    return *this;
  }
  BinaryFile& point(uint64_t id, std::initializer_list<double> position, std::initializer_list<int> color,
                    uint64_t track) {
    put<uint64_t>(id).numbers(position);
    for (const int channel : color) put<uint8_t>(static_cast<uint8_t>(channel));
    put<double>(0.5).put<uint64_t>(track);
    for (uint64_t i = 0; i < track; ++i) put<uint32_t>(1).put<uint32_t>(7);
    return *this;
  }
  std::string content;
};

class ColmapBinaryTest : public TempFolderTest {
 protected:
  ColmapBinaryTest() {
    write("text/cameras.txt",
          "1 SIMPLE_PINHOLE 64 48 50 32 24\n"
          "2 PINHOLE 64 48 50 51 32 24\n"
          "3 SIMPLE_RADIAL 64 48 50 32 24 0.1\n"
          "4 RADIAL 64 48 50 32 24 0.1 0.2\n"
          "5 OPENCV 64 48 50 51 32 24 0.1 0.2 0.3 0.4\n"
          "6 OPENCV_FISHEYE 64 48 50 51 32 24 0.1 0.2 0.3 0.4\n"
          "7 FULL_OPENCV 64 48 50 51 32 24 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8\n"
          "8 SIMPLE_RADIAL_FISHEYE 64 48 50 32 24 0.1\n"
          "99 RADIAL_FISHEYE 64 48 50 32 24 0.1 0.2\n");
    write("text/images.txt",
          "8 0.5 0.5 -0.5 0.5 0 0 0 99 i.png\n\n"
          "7 0.5 0.5 -0.5 0.5 0 0 0 8 h.png\n1.5 2.5 -1\n"
          "6 1 0 0 0 0.25 2 3 7 g.png\n\n5 1 0 0 0 0 0 0 6 f.png\n\n4 1 0 0 0 0 0 0 5 e.png\n\n"
          "3 1 0 0 0 0 0 0 4 d.png\n\n2 1 0 0 0 0 0 0 3 c.png\n\n1 1 0 0 0 0 0 0 2 b.png\n\n"
          "9 2 0 0 0 0.1 0.2 0.3 1 sub folder/a.png\n1.5 2.5 -1 1.5 2.5 4\n");
    write("text/points3D.txt", "4 1 -2 0.125 1 20 255 0.5 1 7\n5 3 4 5 0 0 9 0.5\n");
    cameras.put<uint64_t>(9)
        .camera(1, 0, 64, 48, {50, 32, 24})
        .camera(2, 1, 64, 48, {50, 51, 32, 24})
        .camera(3, 2, 64, 48, {50, 32, 24, 0.1})
        .camera(4, 3, 64, 48, {50, 32, 24, 0.1, 0.2})
        .camera(5, 4, 64, 48, {50, 51, 32, 24, 0.1, 0.2, 0.3, 0.4})
        .camera(6, 5, 64, 48, {50, 51, 32, 24, 0.1, 0.2, 0.3, 0.4})
        .camera(7, 6, 64, 48, {50, 51, 32, 24, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8})
        .camera(8, 8, 64, 48, {50, 32, 24, 0.1})
        .camera(99, 9, 64, 48, {50, 32, 24, 0.1, 0.2});
    images.put<uint64_t>(9)
        .image(9, {2, 0, 0, 0, 0.1, 0.2, 0.3}, 1, "sub folder/a.png", 2)
        .image(1, {1, 0, 0, 0, 0, 0, 0}, 2, "b.png", 0)
        .image(2, {1, 0, 0, 0, 0, 0, 0}, 3, "c.png", 0)
        .image(3, {1, 0, 0, 0, 0, 0, 0}, 4, "d.png", 0)
        .image(4, {1, 0, 0, 0, 0, 0, 0}, 5, "e.png", 0)
        .image(5, {1, 0, 0, 0, 0, 0, 0}, 6, "f.png", 0)
        .image(6, {1, 0, 0, 0, 0.25, 2, 3}, 7, "g.png", 0)
        .image(7, {0.5, 0.5, -0.5, 0.5, 0, 0, 0}, 8, "h.png", 1)
        .image(8, {0.5, 0.5, -0.5, 0.5, 0, 0, 0}, 99, "i.png", 0);
    points.put<uint64_t>(2).point(4, {1, -2, 0.125}, {1, 20, 255}, 1).point(5, {3, 4, 5}, {0, 0, 9}, 0);
    write_binary();
  }

  void write_binary() const {
    fs::create_directories(folder / "binary");
    const auto put = [&](const char* name, const std::string& content) {
      fs::remove(folder / "binary" / name);  // overwriting would wait for the disk
      std::ofstream(folder / "binary" / name, std::ios::binary) << content;
    };
    put("cameras.bin", cameras.content);
    put("images.bin", images.content);
    put("points3D.bin", points.content);
  }
  Result<std::vector<PosedCamera>> read(const char* form) const {
    return read_colmap_cameras(folder / form, folder / "images");
  }
  std::string camera_error() const {
    write_binary();
    const auto read_back = read("binary");
    return read_back ? "no error" : read_back.error().message;
  }
  std::string point_error() const {
    write_binary();
    const auto read_back = read_colmap_points(folder / "binary");
    return read_back ? "no error" : read_back.error().message;
  }

  BinaryFile cameras, images, points;
};

#define EXPECT_CONTAINS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << (text)

TEST_F(ColmapBinaryTest, IsReadAsTheTextIs) {
  const auto text = read("text"), binary = read("binary");
  ASSERT_TRUE(text.ok()) << text.error().message;
  ASSERT_TRUE(binary.ok()) << binary.error().message;
  ASSERT_EQ(text->size(), 9u);
  ASSERT_EQ(binary->size(), 9u);
  for (size_t i = 0; i < 9; ++i) {
    EXPECT_EQ((*text)[i].image, (*binary)[i].image);
    EXPECT_EQ((*text)[i].camera, (*binary)[i].camera);
    EXPECT_EQ((*text)[i].distortion, (*binary)[i].distortion);
    EXPECT_EQ((*text)[i].camera_from_world.matrix(), (*binary)[i].camera_from_world.matrix());
  }
  EXPECT_EQ(binary->front().image, folder / "images" / "b.png") << "in the order of their names";
  EXPECT_EQ(binary->back().image, folder / "images" / "sub folder" / "a.png");
  const auto text_points = read_colmap_points(folder / "text"), binary_points = read_colmap_points(folder / "binary");
  ASSERT_TRUE(text_points.ok() && binary_points.ok());
  ASSERT_EQ(text_points->size(), 2u);
  ASSERT_EQ(binary_points->size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*text_points)[i].position, (*binary_points)[i].position);
    EXPECT_TRUE(std::ranges::equal((*text_points)[i].color, (*binary_points)[i].color));
  }
}

TEST_F(ColmapBinaryTest, LensesHaveTheirCoefficients) {
  const auto posed = read("binary");
  ASSERT_TRUE(posed.ok());
  const Distortion full{.k1 = 0.1, .k2 = 0.2, .p1 = 0.3, .p2 = 0.4, .k3 = 0.5, .k4 = 0.6, .k5 = 0.7, .k6 = 0.8};
  const Distortion fisheye{.k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4, .model = LensModel::kannala_brandt};
  EXPECT_EQ((*posed)[5].distortion, full);
  EXPECT_EQ((*posed)[4].distortion, fisheye);
  EXPECT_EQ((*posed)[3].distortion, (Distortion{.k1 = 0.1, .k2 = 0.2, .p1 = 0.3, .p2 = 0.4}));
  EXPECT_EQ((*posed)[0].camera, (PinholeCamera{64, 48, 50, 51, 31.5, 23.5}));
  EXPECT_TRUE((*posed)[0].distortion.none());
}

TEST_F(ColmapBinaryTest, ErrorsNameFileAndByte) {
  const std::string whole = cameras.content;
  cameras.content = whole.substr(0, 8 + 4 + 2);
  EXPECT_CONTAINS(camera_error(), "cameras.bin: byte 0: 9 cameras announced, but only 6 bytes follow");
  cameras.content = whole.substr(0, whole.size() - 3);
  EXPECT_CONTAINS(camera_error(), fmt::format("cameras.bin: byte {}: the file ends in a camera's", whole.size() - 8));
  cameras.content = whole + "x";
  EXPECT_CONTAINS(camera_error(), fmt::format("cameras.bin: byte {}: 1 bytes too many", whole.size()));
  cameras.content = BinaryFile().put<uint64_t>(1).camera(1, 7, 64, 48, {50, 51, 32, 24, 0.1}).content;
  EXPECT_CONTAINS(camera_error(), "cameras.bin: byte 12: camera model number 7");
  cameras.content = BinaryFile().put<uint64_t>(1).camera(1, 0, 64, 48, {50, 32, std::nan("")}).content;
  EXPECT_CONTAINS(camera_error(), "cameras.bin: byte 48: a camera's parameters is not a finite number");
  cameras.content = BinaryFile().put<uint64_t>(1).camera(1, 0, 0, 48, {50, 32, 24}).content;
  EXPECT_CONTAINS(camera_error(), "cameras.bin: byte 12: images of 0x48");
  cameras.content = BinaryFile().put<uint64_t>(1).camera(1, 0, 64, 48, {50, 32, 24}).content;
  EXPECT_CONTAINS(camera_error(), "images.bin: byte");
  EXPECT_CONTAINS(camera_error(), "camera 2 is not in cameras.bin");
  images.content.resize(images.content.size() - 9);
  cameras.content = whole;
  EXPECT_CONTAINS(camera_error(), "the end of an image's name is missing");
  images.content.clear();
  EXPECT_CONTAINS(camera_error(), "images.bin: byte 0: the file ends in images");
  images.put<uint64_t>(0);
  EXPECT_CONTAINS(camera_error(), "images.bin: no images");
  points.content.pop_back();
  EXPECT_CONTAINS(point_error(), "points3D.bin: byte");
  fs::remove(folder / "binary" / "points3D.bin");
  EXPECT_CONTAINS(read_colmap_points(folder / "binary").error().message, "points3D.bin");
}

TEST_F(ColmapBinaryTest, DamagedFilesGiveAModelOrAnError) {
  const std::string good[] = {cameras.content, images.content, points.content};
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    cameras.content = mutated(good[0], random);
    EXPECT_FALSE(camera_error().empty());
    cameras.content = good[0];
    images.content = mutated(good[1], random);
    points.content = mutated(good[2], random);
    EXPECT_FALSE(camera_error().empty());
    EXPECT_FALSE(point_error().empty());
  }
}

}  // namespace
}  // namespace photoslam
