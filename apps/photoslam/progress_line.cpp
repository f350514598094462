// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <string>

namespace photoslam {
namespace {

constexpr double kRewriteSeconds = 0.1;  // on a terminal
constexpr double kLineSeconds = 2.0;     // elsewhere

std::string describe(const Progress& p) {
  std::string map = fmt::format("{} keyframes, {} gaussians", p.keyframes, p.gaussians);
  if (p.iterations > 0) map += fmt::format(", {} iterations, PSNR {:.1f} dB", p.iterations, p.training_psnr_db);
  switch (p.phase) {
    case Progress::Phase::refining:
      return fmt::format("refining {:3.0f} %: {}", 100 * p.refined, map);
    case Progress::Phase::draining:
    case Progress::Phase::done:
      return fmt::format("finishing: {}", map);
    case Progress::Phase::online:
      break;
  }
  const std::string total = p.num_frames > 0 ? fmt::format("/{}", p.num_frames) : "";
  const std::string dropped = p.dropped > 0 ? fmt::format(", {} dropped", p.dropped) : "";
  return fmt::format("frame {}{} {}, {:.1f} fps{}: {}", p.frames, total, to_string(p.state), p.frames_per_second,
                     dropped, map);
}

}  // namespace

ProgressLine::ProgressLine() : terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (open_) fmt::print(stderr, "\n");
}

void ProgressLine::show(const Progress& progress) {
  for (const std::string& message : progress.messages) {
    fmt::print(stderr, "{}  note: {}\n", open_ ? "\n" : "", message);
    open_ = false;
  }
  if (!first_ && since_last_.seconds() < (terminal_ ? kRewriteSeconds : kLineSeconds)) return;
  since_last_.restart();
  first_ = false;
  if (terminal_) {
    fmt::print(stderr, "\r\033[K{}", describe(progress));
    std::fflush(stderr);
    open_ = true;
  } else {
    fmt::print(stderr, "{}\n", describe(progress));
  }
}

}  // namespace photoslam
