// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/gaussian_ply.h"

#include <gmock/gmock.h>

#include <bit>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "base/random.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

GaussianTable random_table(size_t count, uint64_t seed) {
  Random random(seed);
  GaussianTable table;
  table.resize(count);
  for (float& v : table.values) v = static_cast<float>(random.normal());
  return table;
}

std::string as_bytes(float value) {
  std::string bytes(sizeof(value), '\0');
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}

class GaussianPlyTest : public TempFolderTest {
 protected:
  std::string failure(std::string_view content) const {
    return read_gaussian_ply(write("bad.ply", content)).error().message;
  }
};

TEST_F(GaussianPlyTest, RoundTripIsExactToTheBit) {
  GaussianTable table = random_table(100, 1);
  table.values[0] = -0.0f;
  table.values[1] = std::numeric_limits<float>::denorm_min();
  table.values[2] = std::numeric_limits<float>::max();
  const GaussianPlyReport report = write_gaussian_ply(folder / "m.ply", table).value();
  EXPECT_EQ(report.written, 100u);
  EXPECT_EQ(report.left_out, 0u);
  const GaussianTable back = read_gaussian_ply(folder / "m.ply").value();
  ASSERT_EQ(back.values.size(), table.values.size());
  EXPECT_EQ(std::memcmp(back.values.data(), table.values.data(), table.values.size() * sizeof(float)), 0);
}

TEST_F(GaussianPlyTest, TheFileIsWhatViewersExpect) {
  GaussianTable table = random_table(2, 2);
  for (size_t i = 0; i < GaussianTable::kColumns; ++i) table.row(1)[i] = static_cast<float>(i);
  ASSERT_TRUE(write_gaussian_ply(folder / "m.ply", table).ok());
  const std::string content = read_file(folder / "m.ply").value();

  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"}) {
    header += fmt::format("property float {}\n", name);
  }
  for (int i = 0; i < 45; ++i) header += fmt::format("property float f_rest_{}\n", i);
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    header += fmt::format("property float {}\n", name);
  }
  header += "end_header\n";
  ASSERT_EQ(content.substr(0, header.size()), header);
  ASSERT_EQ(content.size(), header.size() + 2 * 62 * sizeof(float));

  std::string second_row = as_bytes(0) + as_bytes(1) + as_bytes(2) + as_bytes(0) + as_bytes(0) + as_bytes(0);
  for (int i = 3; i < 59; ++i) second_row += as_bytes(static_cast<float>(i));
  EXPECT_EQ(content.substr(content.size() - second_row.size()), second_row);
}

TEST_F(GaussianPlyTest, RowsThatAreNotFiniteAreLeftOutAndCounted) {
  GaussianTable table = random_table(5, 3);
  table.row(1)[40] = std::numeric_limits<float>::quiet_NaN();
  table.row(4)[0] = -std::numeric_limits<float>::infinity();
  const GaussianPlyReport report = write_gaussian_ply(folder / "m.ply", table).value();
  EXPECT_EQ(report.written, 3u);
  EXPECT_EQ(report.left_out, 2u);
  const GaussianTable back = read_gaussian_ply(folder / "m.ply").value();
  ASSERT_EQ(back.size(), 3u);
  EXPECT_TRUE(std::ranges::equal(back.row(1), table.row(2)));
}

TEST_F(GaussianPlyTest, ReadsAnyOrderLowerDegreesAndStrangers) {
  // Degree 1: f_rest holds three coefficients of red, then of green, then of blue.
  std::string content =
      "ply\r\nformat binary_little_endian 1.0\ncomment made elsewhere\nelement vertex 1\nproperty uchar red\n"
      "property float opacity\nproperty double confidence\n";
  std::string row(1, '\x7f');
  row += as_bytes(-1.5f) + std::string(8, '\1');
  const auto add = [&](const std::string& name, float value) {
    content += fmt::format("property float {}\n", name);
    row += as_bytes(value);
  };
  for (int i = 8; i >= 0; --i) add(fmt::format("f_rest_{}", i), static_cast<float>(10 + i));
  for (int i = 0; i < 4; ++i) add(fmt::format("rot_{}", i), static_cast<float>(50 + i));
  for (int i = 0; i < 3; ++i) add(fmt::format("scale_{}", i), static_cast<float>(-i));
  for (int i = 0; i < 3; ++i) add(fmt::format("f_dc_{}", i), static_cast<float>(30 + i));
  add("z", 3);
  add("y", 2);
  add("x", 1);
  content += "element face 0\nproperty list uchar int vertex_indices\nend_header\n" + row;

  const GaussianTable table = read_gaussian_ply(write("m.ply", content)).value();
  ASSERT_EQ(table.size(), 1u);
  const auto values = table.row(0);
  EXPECT_THAT(values.subspan(0, 6), ElementsAre(1, 2, 3, 30, 31, 32));
  EXPECT_THAT(values.subspan(6, 4), ElementsAre(10, 11, 12, 0));
  EXPECT_THAT(values.subspan(21, 4), ElementsAre(13, 14, 15, 0));
  EXPECT_THAT(values.subspan(36, 4), ElementsAre(16, 17, 18, 0));
  EXPECT_THAT(values.subspan(51, 8), ElementsAre(-1.5f, 0, -1, -2, 50, 51, 52, 53));
}

TEST_F(GaussianPlyTest, AnEmptyMapIsAMap) {
  ASSERT_TRUE(write_gaussian_ply(folder / "m.ply", {}).ok());
  EXPECT_EQ(read_gaussian_ply(folder / "m.ply").value().size(), 0u);
}

TEST_F(GaussianPlyTest, ErrorsSayWhatIsWrong) {
  ASSERT_TRUE(write_gaussian_ply(folder / "m.ply", random_table(3, 4)).ok());
  const std::string good = read_file(folder / "m.ply").value();
  const auto replaced = [&](std::string_view from, std::string_view to) {
    std::string content = good;
    return content.replace(content.find(from), from.size(), to);
  };
  EXPECT_THAT(failure(""), HasSubstr("bad.ply: not a PLY file"));
  EXPECT_THAT(failure(good.substr(0, 300)), HasSubstr("header has no end"));
  EXPECT_THAT(failure(good.substr(0, good.size() - 1)), HasSubstr("promises 3 gaussians, the data ends after 2"));
  EXPECT_THAT(failure(replaced("binary_little_endian", "ascii")), HasSubstr("line 2: only the format"));
  EXPECT_THAT(failure(replaced("vertex 3", "vertex -3")), HasSubstr("line 3: '-3' is not a number of vertices"));
  EXPECT_THAT(failure(replaced("vertex 3", "vertex 18446744073709551615")), HasSubstr("the data ends after 3"));
  EXPECT_THAT(failure(replaced("element vertex", "element chunk")), HasSubstr("compressed"));
  EXPECT_THAT(failure(replaced("float opacity", "float opaque")), HasSubstr("the property opacity is missing"));
  EXPECT_THAT(failure(replaced("float opacity", "int opacity")), HasSubstr("opacity is not of type float"));
  EXPECT_THAT(failure(replaced("float f_rest_44", "float other")), HasSubstr("44 properties f_rest_*"));
  EXPECT_THAT(failure(replaced("float nx", "float x")), HasSubstr("line 7: a second property 'x'"));
  EXPECT_THAT(failure(replaced("float nx", "list uchar int nx")), HasSubstr("no lists"));
  EXPECT_THAT(failure(replaced("float nx", "half nx")), HasSubstr("unknown type 'half'"));
}

TEST_F(GaussianPlyTest, ReadsAMapOfAnotherTrainer) {
  const char* data = std::getenv("PHOTOSLAM_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "PHOTOSLAM_DATA_DIR is not set";
  const auto table = read_gaussian_ply(std::filesystem::path(data) / "fox-bench" / "gaussians-100k.ply").value();
  EXPECT_EQ(table.size(), 100000u);
  for (size_t i = 0; i < table.size(); i += 1000) {
    const auto rotation = table.row(i).subspan<GaussianTable::kRotation, 4>();
    float squared_norm = 0;
    for (const float v : rotation) squared_norm += v * v;
    EXPECT_GT(squared_norm, 0.01f);
    EXPECT_LT(table.row(i)[GaussianTable::kScale], 3.0f);
  }
}

}  // namespace
}  // namespace photoslam
