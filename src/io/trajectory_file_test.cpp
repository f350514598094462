// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/trajectory_file.h"

#include <gmock/gmock.h>

#include "base/random.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

TEST(Seconds, AreExactToTheNanosecond) {
  EXPECT_EQ(parse_seconds("1305031102.175304").value(), 1305031102175304000);
  EXPECT_EQ(parse_seconds("1403715273.262142976").value(), 1403715273262142976);  // no double holds this
  EXPECT_EQ(parse_seconds("0").value(), 0);
  EXPECT_EQ(parse_seconds("-0.5").value(), -500000000);
  EXPECT_EQ(parse_seconds(".25").value(), 250000000);
  EXPECT_EQ(parse_seconds("7.").value(), 7000000000);
  EXPECT_EQ(parse_seconds("1.3050311021753e+09").value(), 1305031102175300000);
  EXPECT_EQ(parse_seconds("25e-2").value(), 250000000);
}

TEST(Seconds, DigitsBeyondTheNanosecondRound) {
  EXPECT_EQ(parse_seconds("0.0000000014").value(), 1);
  EXPECT_EQ(parse_seconds("0.0000000015").value(), 2);
  EXPECT_EQ(parse_seconds("0.99999999999").value(), 1000000000);
  EXPECT_EQ(parse_seconds("9e-11").value(), 0);
}

TEST(Seconds, RejectWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "abc", "1.2.3", "1e", "1e99", "nan", "inf", "1 2", "0x10", "9223372037",
                           "99999999999999999999999999"}) {
    EXPECT_FALSE(parse_seconds(text).ok()) << text;
  }
  EXPECT_EQ(parse_seconds("9223372036.854775807").value(), INT64_MAX);
}

TEST(Seconds, FormatInvertsParse) {
  EXPECT_EQ(format_seconds(1305031102175304000), "1305031102.175304000");
  EXPECT_EQ(format_seconds(-1), "-0.000000001");
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const int64_t t = static_cast<int64_t>(random.next() >> 1) * (i % 2 == 0 ? 1 : -1);
    EXPECT_EQ(parse_seconds(format_seconds(t)).value(), t);
  }
}

class TrajectoryFileTest : public TempFolderTest {};

TEST_F(TrajectoryFileTest, ReadsWhatItWrote) {
  Random random(2);
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    const Vec3 omega(random.normal(), random.normal(), random.normal());
    const Vec3 position(random.normal(), random.normal(), random.normal());
    trajectory.push_back({1305031102175304000 + i * int64_t{33333333}, SE3(so3_exp(omega), position)});
  }
  ASSERT_TRUE(write_tum_trajectory(folder / "t.tum", trajectory).ok());
  const Trajectory back = read_tum_trajectory(folder / "t.tum").value();
  ASSERT_EQ(back.size(), trajectory.size());
  for (size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].timestamp_ns, trajectory[i].timestamp_ns);
    const SE3 difference = back[i].world_from_camera.inverse() * trajectory[i].world_from_camera;
    EXPECT_LT(difference.log().norm(), 5e-9);
  }
}

TEST_F(TrajectoryFileTest, SortsByTimeAndNormalisesRotations) {
  const auto path = write("t.txt", "# comment\n\n2.0 1 2 3 0 0 0 1.0002 # end\r\n1.5\t4,5,6 0 0.7071 0 0.7071");
  const Trajectory trajectory = read_tum_trajectory(path).value();
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].timestamp_ns, 1500000000);
  EXPECT_EQ(trajectory[0].world_from_camera.translation, Vec3(4, 5, 6));
  EXPECT_NEAR(trajectory[0].world_from_camera.rotation.norm(), 1, 1e-15);
  EXPECT_EQ(trajectory[1].world_from_camera.rotation.w(), 1);
}

TEST_F(TrajectoryFileTest, ErrorsNameFileAndLine) {
  const auto message = [&](std::string_view content) {
    return read_tum_trajectory(write("bad.txt", content)).error().message;
  };
  EXPECT_THAT(message("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n"), HasSubstr("bad.txt:2: expected 8 fields"));
  EXPECT_THAT(message("# c\n1 0 0 zero 0 0 0 1\n"), HasSubstr("bad.txt:2: 'zero' is not a number"));
  EXPECT_THAT(message("now 0 0 0 0 0 0 1\n"), HasSubstr("bad.txt:1: 'now' is not a time"));
  EXPECT_THAT(message("1 0 0 0 0 0 0 0\n"), HasSubstr("bad.txt:1: the quaternion has norm 0"));
  EXPECT_THAT(message("1 0 nan 0 0 0 0 1\n"), HasSubstr("'nan' is not a number"));
  EXPECT_THAT(read_tum_trajectory(folder / "absent").error().message, HasSubstr("absent"));
}

}  // namespace
}  // namespace photoslam
