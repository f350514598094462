// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/npy_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>

#include "base/file.h"

namespace photoslam {
namespace {

TEST(NpyFile, HeaderAndDataAsTheFormatDescribes) {
  ImageF image(3, 2, 3);
  for (size_t i = 0; i < image.values().size(); ++i) image.values()[i] = 0.5f * static_cast<float>(i);
  const auto path = std::filesystem::path(testing::TempDir()) / fmt::format("image_{}.npy", ::getpid());
  ASSERT_TRUE(write_npy(path, image).ok());
  const std::string bytes = read_file(path).value();
  ASSERT_EQ(bytes.substr(0, 6), "\x93NUMPY");
  const size_t header = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  EXPECT_EQ((10 + header) % 64, 0u);
  EXPECT_NE(bytes.substr(10, header).find("'shape': (2, 3, 3)"), std::string::npos);
  ASSERT_EQ(bytes.size(), 10 + header + 18 * sizeof(float));
  float last = 0;
  std::memcpy(&last, bytes.data() + bytes.size() - sizeof(float), sizeof(float));
  EXPECT_EQ(last, 8.5f);
}

}  // namespace
}  // namespace photoslam
