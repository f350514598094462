// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/packed_bytes.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace photoslam {
namespace {

/// Noise between stretches of zeros.
std::string some_bytes(size_t size) {
  Random random(3);
  std::string bytes(size, '\0');
  for (size_t i = 0; i < size; ++i) {
    if (i / 500 % 2 == 0) bytes[i] = static_cast<char>(random.index(256));
  }
  return bytes;
}

TEST(PackedBytes, ComeBackWhateverZlibIsGivenAtATime) {
  for (const size_t size : {0u, 1u, 999u, 1000u, 1001u, 40000u}) {
    const std::string bytes = some_bytes(size);
    for (const size_t most : {size_t{1}, size_t{7}, size_t{1000}, kMostAtOnce}) {
      const std::string small = packed(bytes, most);
      if (size > 1000) {
        EXPECT_LT(small.size(), 0.6 * static_cast<double>(size));
      }
      for (const size_t most_back : {size_t{1}, size_t{1000}, kMostAtOnce}) {
        const auto back = unpacked(small, most_back);
        ASSERT_TRUE(back.has_value()) << size << " bytes, " << most << " and " << most_back << " at a time";
        EXPECT_TRUE(*back == bytes);
      }
    }
  }
}

TEST(PackedBytes, WhatWasNeverPackedIsNothing) {
  const std::string small = packed(some_bytes(5000));
  EXPECT_FALSE(unpacked("").has_value());
  EXPECT_FALSE(unpacked("few").has_value());
  EXPECT_FALSE(unpacked(std::string(1000, 'x')).has_value());
  for (const size_t cut : {size_t{8}, small.size() / 2, small.size() - 1}) {
    for (const size_t most : {size_t{100}, kMostAtOnce}) {
      EXPECT_FALSE(unpacked(std::string_view(small).substr(0, cut), most).has_value()) << cut;
    }
  }
  std::string longer = small;
  ++longer[0];  // of the size
  EXPECT_FALSE(unpacked(longer).has_value());
}

}  // namespace
}  // namespace photoslam
