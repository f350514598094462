// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/run_evaluation.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

class NoFrames final : public FrameSource {
 public:
  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override { return std::nullopt; }

 private:
  SourceInfo info_;
};

Report report_of(const RunOutcome& run) {
  NoFrames source;
  SerialExecutor executor;
  return evaluate_run(run, {}, source, std::nullopt, false, executor).report;
}

TEST(RunEvaluation, TheGpuIsUsedForAPartOfTheMappingTime) {
  RunOutcome run;
  run.seconds_online = 4;
  run.seconds_drain = 1;
  run.seconds_refine = 5;
  run.seconds_total = 100;
  run.gpu = {.peak_mb = 300, .busy_seconds = 2.5};
  const Report report = report_of(run);
  EXPECT_DOUBLE_EQ(report.gpu.utilisation.value(), 0.25);
  EXPECT_DOUBLE_EQ(report.memory.gpu_mb.value(), 300);
}

TEST(RunEvaluation, WithoutAGpuNothingIsSaidOfIt) {
  RunOutcome run;
  run.seconds_online = 4;
  const Report report = report_of(run);
  EXPECT_FALSE(report.gpu.utilisation.has_value());
  EXPECT_FALSE(report.memory.gpu_mb.has_value());
  EXPECT_FALSE(report.mapping.ms_per_iteration.has_value()) << "no iterations";
}

}  // namespace
}  // namespace photoslam
