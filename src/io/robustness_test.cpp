// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// Damaged files must give a result or an error, never a crash, a hang or a wild allocation. Run under the address and
// undefined-behaviour sanitizers for full effect.
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "io/gaussian_ply.h"
#include "io/image_codec.h"
#include "io/mutation_test.h"
#include "io/temp_folder_test.h"
#include "io/trajectory_file.h"

namespace photoslam {
namespace {

template <class T>
Image<T> textured(int channels) {
  Image<T> image(40, 30, channels);
  for (size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<T>(i * i / 7 + i);
  return image;
}

/// Gives every chunk the checksum of its (damaged) content, so that the decoder looks at it.
std::string with_valid_checksums(std::string png) {
  size_t chunk = 8;
  const auto byte = [&](size_t i) { return static_cast<uint32_t>(static_cast<uint8_t>(png[i])); };
  while (chunk + 12 <= png.size()) {
    const size_t length = byte(chunk) << 24 | byte(chunk + 1) << 16 | byte(chunk + 2) << 8 | byte(chunk + 3);
    if (length > png.size() - chunk - 12) break;
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(&png[chunk + 4]), static_cast<uInt>(length + 4));
    for (size_t k = 0; k < 4; ++k) png[chunk + 8 + length + k] = static_cast<char>(sum >> (24 - 8 * k));
    chunk += length + 12;
  }
  return png;
}

/// Decodes damaged copies; those that still decode must have a size that fits their pixels.
template <class Decode>
void survive(const std::string& content, int count, Decode decode) {
  Random random(content.size());
  int decoded = 0;
  for (int i = 0; i < count; ++i) {
    const auto image = decode(mutated(content, random));
    if (!image.ok()) {
      EXPECT_FALSE(image.error().message.empty());
      continue;
    }
    EXPECT_LE(image->values().size(), size_t{1} << 29);
    ++decoded;
  }
  EXPECT_LT(decoded, count) << "no damage was noticed";
}

TEST(Robustness, DamagedPng) {
  for (const int channels : {1, 3}) {
    const std::string png = internal::encode_png(textured<uint8_t>(channels), 6).value();
    survive(png, 1500, internal::decode_png);
    survive(png, 1500, [](std::string content) { return internal::decode_png(with_valid_checksums(content)); });
  }
  const std::string depth = internal::encode_png(textured<uint16_t>(1), 6).value();
  survive(depth, 1500, [](std::string content) { return internal::decode_png16(with_valid_checksums(content)); });
}

TEST(Robustness, DamagedJpeg) {
  for (const int channels : {1, 3}) {
    survive(internal::encode_jpeg(textured<uint8_t>(channels), 80).value(), 3000, internal::decode_jpeg);
  }
}

class RobustnessTest : public TempFolderTest {
 protected:
  /// Reads damaged copies from a file; the outcome may be either, but must be one.
  template <class Read>
  void survive_file(const std::string& content, int count, Read read) const {
    Random random(content.size());
    for (int i = 0; i < count; ++i) {
      const auto path = folder / "damaged";
      std::filesystem::remove(path);  // overwriting would wait for the disk
      std::ofstream(path, std::ios::binary) << mutated(content, random);
      const auto result = read(path);
      if (!result.ok()) {
        EXPECT_NE(result.error().message.find("damaged"), std::string::npos);
      }
    }
  }
};

TEST_F(RobustnessTest, DamagedGaussianPly) {
  GaussianTable table;
  table.resize(20);
  ASSERT_TRUE(write_gaussian_ply(folder / "m.ply", table).ok());
  const std::string content = read_file(folder / "m.ply").value();
  survive_file(content, 1500, read_gaussian_ply);
  // Most of the bytes are values: damage the header alone as well.
  survive_file(content.substr(0, content.find("end_header") + 11), 1500, read_gaussian_ply);
}

TEST_F(RobustnessTest, DamagedTrajectory) {
  const Trajectory trajectory(10, StampedPose{1305031102175304000, SE3(so3_exp(Vec3(1, 2, 0)), Vec3(0.1, -20, 3))});
  ASSERT_TRUE(write_tum_trajectory(folder / "t.tum", trajectory).ok());
  survive_file(read_file(folder / "t.tum").value(), 2000, read_tum_trajectory);
}

}  // namespace
}  // namespace photoslam
