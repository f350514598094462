// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/clock.h"
#include "pipeline/system.h"

namespace photoslam {

/// One line on stderr that says where a run stands: rewritten in place on a terminal, else printed every few seconds.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  void show(const Progress& progress);

 private:
  bool terminal_;
  bool open_ = false;
  Stopwatch since_last_;
  bool first_ = true;
};

}  // namespace photoslam
