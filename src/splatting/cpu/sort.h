// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cpu/frame.h"

namespace photoslam::splatting {

/// Numbers the instances and lists every tile's gaussians, in the order of their slots: a counting sort by tile. Fills
/// the frame from num_visible to num_instances.
void distribute_to_tiles(Frame& frame);

/// Sorts a tile's list front to back: by fp32 depth, ties by index.
void sort_tile(Frame& frame, int tile, TileSorter& sorter);

}  // namespace photoslam::splatting
