// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/gaussian_spz.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "base/file.h"
#include "base/random.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

GaussianTable some_gaussians(size_t count, size_t harmonics) {
  Random random(5);
  GaussianTable table;
  table.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const auto row = table.row(i);
    for (size_t k = 0; k < 3; ++k) row[k] = static_cast<float>(random.uniform(-20, 20));
    for (size_t c = 0; c < 3; ++c) row[GaussianTable::kShDc + c] = static_cast<float>(random.uniform(-1.5, 1.5));
    for (size_t c = 0; c < 3; ++c) {
      for (size_t k = 0; k < harmonics; ++k) {
        row[GaussianTable::kShRest + 15 * c + k] = static_cast<float>(random.uniform(-0.5, 0.5));
      }
    }
    row[GaussianTable::kOpacity] = static_cast<float>(random.uniform(-4, 4));
    for (size_t k = 0; k < 3; ++k) row[GaussianTable::kScale + k] = static_cast<float>(random.uniform(-7, 1));
    for (size_t k = 0; k < 4; ++k) row[GaussianTable::kRotation + k] = static_cast<float>(random.normal());
  }
  return table;
}

std::string gunzip(const std::string& packed) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, MAX_WBITS + 16), Z_OK);
  std::string data(1 << 20, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(data.data());
  stream.avail_out = static_cast<uInt>(data.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  data.resize(stream.total_out);
  inflateEnd(&stream);
  return data;
}

/// Walks the unpacked stream, decoding as the format's description says.
class SpzDecoder {
 public:
  explicit SpzDecoder(const std::string& data) : data_(data) {}
  uint32_t byte() { return static_cast<uint8_t>(data_.at(at_++)); }
  uint32_t word() {
    uint32_t value = 0;
    for (int k = 0; k < 4; ++k) value |= byte() << (8 * k);
    return value;
  }
  double fixed24() {
    uint32_t value = 0;
    for (int k = 0; k < 3; ++k) value |= byte() << (8 * k);
    if (value & 0x800000) value |= 0xff000000;
    return static_cast<int32_t>(value) / 4096.0;
  }
  /// x, y, z, w of the "smallest three" code.
  std::array<double, 4> rotation() {
    uint32_t code = word();
    const size_t largest = code >> 30;
    std::array<double, 4> q{};
    double rest = 1;
    for (int k = 3; k >= 0; --k) {
      if (static_cast<size_t>(k) == largest) continue;
      const double magnitude = (code & 511) / 511.0 * std::sqrt(0.5);
      q[static_cast<size_t>(k)] = (code >> 9) & 1 ? -magnitude : magnitude;
      rest -= magnitude * magnitude;
      code >>= 10;
    }
    q[largest] = std::sqrt(std::max(rest, 0.0));
    return q;
  }
  bool finished() const { return at_ == data_.size(); }

 private:
  const std::string& data_;
  size_t at_ = 0;
};

class GaussianSpz : public TempFolderTest {};

TEST_F(GaussianSpz, HoldsWhatTheFormatPromises) {
  const GaussianTable table = some_gaussians(200, 8);
  const auto path = folder / "map.spz";
  const auto report = write_gaussian_spz(path, table);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->written, 200u);
  const std::string data = gunzip(*read_file(path));
  SpzDecoder decoder(data);
  EXPECT_EQ(decoder.word(), 0x5053474eu);
  EXPECT_EQ(decoder.word(), 3u);
  EXPECT_EQ(decoder.word(), 200u);
  EXPECT_EQ(decoder.byte(), 2u) << "the highest degree in use";
  EXPECT_EQ(decoder.byte(), 12u);
  EXPECT_EQ(decoder.byte(), 0u) << "no flags";
  EXPECT_EQ(decoder.byte(), 0u) << "reserved";
}

TEST_F(GaussianSpz, ValuesComeBackToThePrecisionOfTheFormat) {
  const size_t count = 100;
  const GaussianTable table = some_gaussians(count, 3);
  const auto path = folder / "map.spz";
  ASSERT_TRUE(write_gaussian_spz(path, table).ok());
  const std::string data = gunzip(*read_file(path));
  SpzDecoder decoder(data);
  for (int k = 0; k < 16; ++k) decoder.byte();
  const double axis[3] = {1, -1, -1};  // right, up, backwards instead of right, down, forwards
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(axis[k] * decoder.fixed24(), table.row(i)[k], 1.3e-4);
  }
  for (size_t i = 0; i < count; ++i) {
    EXPECT_NEAR(decoder.byte() / 255.0, 1 / (1 + std::exp(-table.row(i)[GaussianTable::kOpacity])), 0.5 / 255 + 1e-6);
  }
  for (size_t i = 0; i < count; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR((decoder.byte() / 255.0 - 0.5) / 0.15, table.row(i)[GaussianTable::kShDc + c],
                  0.5 / 255 / 0.15 + 1e-6);
    }
  }
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(decoder.byte() / 16.0 - 10, table.row(i)[GaussianTable::kScale + k], 0.5 / 16 + 1e-6);
    }
  }
  for (size_t i = 0; i < count; ++i) {
    const auto q = decoder.rotation();
    const float* const r = &table.row(i)[GaussianTable::kRotation];
    const double norm = std::sqrt(static_cast<double>(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]));
    // The same rotation seen in turned axes: its axis turns along.
    const double dot = q[3] * static_cast<double>(r[0]) + q[0] * static_cast<double>(r[1]) -
                       q[1] * static_cast<double>(r[2]) - q[2] * static_cast<double>(r[3]);
    EXPECT_GT(std::abs(dot) / norm, 1 - 4e-6) << "0.16 degrees";
  }
  for (size_t i = 0; i < count; ++i) {
    const double signs[3] = {-1, -1, 1};  // Y1-1 goes with y, Y10 with z, Y11 with x
    for (size_t k = 0; k < 3; ++k) {
      for (size_t c = 0; c < 3; ++c) {
        const double value = (static_cast<double>(decoder.byte()) - 128) / 128;
        EXPECT_NEAR(signs[k] * value, table.row(i)[GaussianTable::kShRest + 15 * c + k], 4.6 / 128);
      }
    }
  }
  EXPECT_TRUE(decoder.finished());
}

TEST_F(GaussianSpz, IsATenthOfThePly) {
  const GaussianTable table = some_gaussians(5000, 3);
  ASSERT_TRUE(write_gaussian_spz(folder / "map.spz", table).ok());
  ASSERT_TRUE(write_gaussian_ply(folder / "map.ply", table).ok());
  EXPECT_LT(8 * std::filesystem::file_size(folder / "map.spz"), std::filesystem::file_size(folder / "map.ply"));
}

TEST_F(GaussianSpz, LeavesOutWhatCannotBeStored) {
  GaussianTable table = some_gaussians(4, 0);
  table.row(1)[2] = std::numeric_limits<float>::quiet_NaN();
  table.row(2)[0] = 1e5f;
  const auto report = write_gaussian_spz(folder / "map.spz", table);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->written, 2u);
  EXPECT_EQ(report->left_out, 2u);
}

TEST_F(GaussianSpz, SplatFilesHoldThirtyTwoBytesEach) {
  GaussianTable table = some_gaussians(2, 0);
  for (size_t k = 0; k < 3; ++k) table.row(1)[GaussianTable::kScale + k] = 2;  // by far the most important
  table.row(1)[GaussianTable::kOpacity] = 3;
  const auto path = folder / "map.splat";
  ASSERT_TRUE(write_gaussian_splat(path, table).ok());
  const std::string data = *read_file(path);
  ASSERT_EQ(data.size(), 64u);
  float values[6];
  std::memcpy(values, data.data(), sizeof(values));
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(values[k], table.row(1)[k]);
    EXPECT_NEAR(values[3 + k], std::exp(2.0), 1e-5);
  }
  EXPECT_EQ(static_cast<uint8_t>(data[27]), std::lround(255 / (1 + std::exp(-3.0))));
}

TEST_F(GaussianSpz, AnUnwritablePlaceIsAnError) {
  EXPECT_FALSE(write_gaussian_spz(folder / "none" / "map.spz", some_gaussians(1, 0)).ok());
}

}  // namespace
}  // namespace photoslam
