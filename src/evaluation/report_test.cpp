// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/report.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

/// All keys as "group.key", in order.
std::string key_list(const Json& json, const std::string& prefix = "") {
  std::string list;
  for (const auto& [key, value] : json.items()) {
    list += value.is_object() && !value.empty() ? key_list(value, prefix + key + ".") : prefix + key + " ";
  }
  return list;
}

FrameRecord record(FrameState state, double tracking_ms) {
  FrameRecord result;
  result.state = state;
  if (tracking_ms > 0) result.tracking_ms = tracking_ms;
  return result;
}

class ReportTest : public TempFolderTest {};

TEST_F(ReportTest, HasExactlyTheKeysOfTheContract) {
  EXPECT_EQ(key_list(Json::parse(to_json({}))),
            "frames.total frames.tracked frames.lost frames.lost_before_init frames.dropped "
            "tracking.fps tracking.p50_ms tracking.p99_ms tracking.mean_ms tracking.min_ms tracking.max_ms "
            "tracking.std_ms tracking.blocked_p99_ms tracking.active_feature_ratio "
            "latency.p50_ms latency.p99_ms latency.max_ms "
            "mapping.iterations mapping.ms_per_iteration mapping.gaussians mapping.keyframes "
            "mapping.keyframes_without_pictures mapping.cpu_seconds "
            "mapping.seconds_online mapping.seconds_drain mapping.seconds_refine seconds_total "
            "ate.rmse_m ate.std_m ate.median_m ate.rot_rmse_deg ate.scale ate.matched "
            "ate_online.rmse_m ate_online.std_m ate_online.median_m ate_online.rot_rmse_deg ate_online.scale "
            "ate_online.matched rpe.trans_m rpe.rot_deg "
            "image_online.psnr_db image_online.psnr_p5_db image_online.ssim image_online.lpips image_online.frames "
            "image.psnr_db image.psnr_p5_db image.ssim image.lpips image.frames "
            "image_keyframes.psnr_db image_keyframes.psnr_p5_db image_keyframes.ssim image_keyframes.lpips "
            "image_keyframes.frames image_held_out.psnr_db image_held_out.psnr_p5_db image_held_out.ssim "
            "image_held_out.lpips image_held_out.frames "
            "render.fps memory.peak_rss_mb memory.gpu_mb gpu.utilisation map.size_mb "
            "loops.closed loops.reconnected "
            "machine version config.all config.changed ");
}

TEST_F(ReportTest, WhatWasNotMeasuredIsNull) {
  const Json json = Json::parse(to_json({}));
  EXPECT_TRUE(json["frames"]["total"].is_null());
  EXPECT_TRUE(json["ate"]["rmse_m"].is_null());
  EXPECT_TRUE(json["config"]["changed"].empty());
}

TEST_F(ReportTest, ReadsWhatItWrote) {
  Report report;
  report.frames.total = 500;
  report.tracking.p50_ms = 12.25;
  report.seconds_total = 33.5;
  report.ate = to_report(AbsoluteError{.rmse_m = 0.0123,
                                       .std_m = 0.004,
                                       .median_m = 0.01,
                                       .rot_rmse_deg = 0.5,
                                       .scale = 1,
                                       .matched = 499,
                                       .truth_from_estimate = {}});
  report.rpe = to_report(RelativeError{0.02, 0.3, 7});
  report.image.ssim = 0.875;
  report.image.frames = 500;
  report.gpu.utilisation = 0.625;
  report.machine = "two cores";
  report.version = "0.1.0";
  report.config.all = {{"a.switch", true}, {"a.count", 3}, {"b.ratio", 0.5}, {"b.name", std::string("x \"y\"")}};
  report.config.changed = {{"a.count", 3}};
  ASSERT_TRUE(write_report(folder / "report.json", report).ok());
  const Report back = read_report(folder / "report.json").value();
  EXPECT_EQ(to_json(back), to_json(report));
  EXPECT_EQ(back.ate.matched, 499);
  EXPECT_EQ(back.gpu.utilisation, 0.625);
  EXPECT_EQ(back.config.all[2].value, ConfigValue(0.5));
  EXPECT_FALSE(back.latency.p50_ms.has_value());
  EXPECT_FALSE(to_report(std::optional<AbsoluteError>()).rmse_m.has_value());
}

TEST_F(ReportTest, ForeignAndDamagedFilesAreErrorsOrUnmeasured) {
  EXPECT_THAT(read_report(write("a.json", "{\"frames\"")).error().message, HasSubstr("a.json is not a report"));
  EXPECT_THAT(read_report(write("b.json", "[1]")).error().message, HasSubstr("b.json is not a report"));
  const Report odd =
      read_report(write("c.json", R"({"frames": 3, "ate": {"rmse_m": "x"}, "config": {"all": 1}})")).value();
  EXPECT_EQ(to_json(odd), to_json({}));
}

TEST_F(ReportTest, CountsFramesAndTimes) {
  FrameLog log = {record(FrameState::initializing, 0), record(FrameState::lost, 10),
                  record(FrameState::dropped, 0),      record(FrameState::tracked, 20),
                  record(FrameState::tracked, 30),     record(FrameState::coasted, 40)};
  log[3].latency_ms = 25;
  log[4].latency_ms = 35;
  log[3].blocked_ms = 2;
  log[3].active_ratio = 0.25;
  log[4].active_ratio = 0.75;
  Report report;
  summarize(log, report);
  EXPECT_EQ(report.frames.total, 6);
  EXPECT_EQ(report.frames.tracked, 2);
  EXPECT_EQ(report.frames.lost, 3);
  EXPECT_EQ(report.frames.lost_before_init, 2);
  EXPECT_EQ(report.frames.dropped, 1);
  EXPECT_EQ(*report.frames.total, *report.frames.tracked + *report.frames.lost + *report.frames.dropped);
  EXPECT_DOUBLE_EQ(report.tracking.mean_ms.value(), 25);
  EXPECT_DOUBLE_EQ(report.tracking.fps.value(), 40);
  EXPECT_DOUBLE_EQ(report.tracking.p50_ms.value(), 25);
  EXPECT_DOUBLE_EQ(report.tracking.min_ms.value(), 10);
  EXPECT_DOUBLE_EQ(report.tracking.max_ms.value(), 40);
  EXPECT_DOUBLE_EQ(report.tracking.blocked_p99_ms.value(), 2);
  EXPECT_DOUBLE_EQ(report.tracking.active_feature_ratio.value(), 0.5);
  EXPECT_DOUBLE_EQ(report.latency.max_ms.value(), 35);
  summarize(FrameLog{}, report);
  EXPECT_EQ(report.frames.total, 0);
  EXPECT_FALSE(report.tracking.fps.has_value());
  EXPECT_FALSE(report.latency.p50_ms.has_value());
}

}  // namespace
}  // namespace photoslam
