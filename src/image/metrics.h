// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

namespace photoslam {

/// What psnr() returns for images without any difference [dB].
inline constexpr double kLargestPsnr = 100.0;

/// Peak signal-to-noise ratio [dB] of images in [0, 1] (values outside are clamped), one mean squared error over all
/// pixels and channels; at most kLargestPsnr. Both images have the same size and channels.
///
/// `mask` (1 channel; empty = everything) selects the pixels that are not 0; at least one is required.
double psnr(const ImageF& a, const ImageF& b, const ImageU8& mask = {});

/// Structural similarity (Wang et al. 2004) of images in [0, 1] (values outside are clamped): gaussian window of 11x11
/// with σ = 1.5, C1 = 0.01², C2 = 0.03², mean over channels and windows that lie fully inside the image.
///
/// Equal to scikit-image's structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
/// data_range=1). With a mask, the mean is over windows without any masked pixel. Sides must be at least 11; with no
/// window left the result is NaN.
double ssim(const ImageF& a, const ImageF& b, const ImageU8& mask = {});

}  // namespace photoslam
