// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cpu/frame.h"

namespace photoslam::splatting {

/// Lists every tile's gaussians front to back (by fp32 depth, ties by index): one radix sort by depth, then a stable
/// counting sort by tile. Fills the frame from sort_keys to num_instances.
void sort_frame(Frame& frame);

}  // namespace photoslam::splatting
