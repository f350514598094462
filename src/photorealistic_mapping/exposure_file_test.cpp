// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/exposure_file.h"

#include <gtest/gtest.h>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using ExposureFile = TempFolderTest;

TEST_F(ExposureFile, ComesBackExactly) {
  ExposureTrack track;
  for (int i = 0; i < 20; ++i) {
    const float x = 0.1f * static_cast<float>(i) + 1.0f / 3;
    track.push_back({1'305'031'102'175'304'001 + i * 33'333'333LL, {{x, 1, 1 / x}, {-x / 100, 0, 1e-7f * x}}});
  }
  ASSERT_TRUE(write_exposures(folder / "exposures.txt", track));
  const auto read = read_exposures(folder / "exposures.txt");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), track.size());
  for (size_t i = 0; i < track.size(); ++i) {
    EXPECT_EQ((*read)[i].timestamp_ns, track[i].timestamp_ns);
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_EQ((*read)[i].exposure.gain[c], track[i].exposure.gain[c]);
      EXPECT_EQ((*read)[i].exposure.bias[c], track[i].exposure.bias[c]);
    }
  }
}

TEST_F(ExposureFile, DamageIsAnErrorThatNamesTheLine) {
  const std::string head = "# photoslam exposures 1\n";
  for (const auto& [content, where] : {std::pair<std::string, std::string>{"", ":1:"},
                                       {"0.0 1 1 1 0 0 0\n", ":1:"},
                                       {"# photoslam exposures 2\n", ":1:"},
                                       {head + "0.0 1 1 1 0 0\n", ":2:"},
                                       {head + "0.0 1 1 1 0 0 0\n0.1 1 0 1 0 0 0\n", ":3:"},
                                       {head + "0.0 -1 1 1 0 0 0\n", ":2:"},
                                       {head + "0.0 1e60 1 1 0 0 0\n", ":2:"},
                                       {head + "0.0 1 1 nan 0 0 0\n", ":2:"},
                                       {head + "when 1 1 1 0 0 0\n", ":2:"}}) {
    const auto path = write("exposures.txt", content);
    const auto read = read_exposures(path);
    ASSERT_FALSE(read) << content;
    EXPECT_NE(read.error().message.find(path.string() + where), std::string::npos) << read.error().message;
  }
  EXPECT_FALSE(read_exposures(folder / "nowhere.txt"));
}

TEST_F(ExposureFile, TheNearestInTimeCounts) {
  EXPECT_EQ(nearest_exposure({}, 5).gain[0], 1);
  const ExposureTrack track = {{10, {{2, 2, 2}, {}}}, {20, {{3, 3, 3}, {}}}, {40, {{4, 4, 4}, {}}}};
  for (const auto& [time, gain] : {std::pair{-100, 2}, {10, 2}, {15, 2}, {16, 3}, {29, 3}, {31, 4}, {1000, 4}}) {
    EXPECT_EQ(nearest_exposure(track, time).gain[1], static_cast<float>(gain)) << time;
  }
}

}  // namespace
}  // namespace photoslam
