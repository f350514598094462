// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

/// What a module that decodes video offers. The library loads it when a video is opened, so that it does not link the
/// decoder itself. Plain C types: module and library may come from different compilers.
extern "C" {

struct PhotoslamVideoInfo {
  int width, height;         ///< Of the stored images, before rotation.
  double frames_per_second;  ///< Nominal; 0 where the file does not tell.
  long long num_frames;      ///< 0 where the file does not tell.
  int clockwise_deg;         ///< By how much the images are to be turned to be upright: 0, 90, 180 or 270.
};

struct PhotoslamVideoApi {
  int version;  ///< kPhotoslamVideoApiVersion.
  /// A reader of the first video stream of a file, or null with a reason in `error`.
  void* (*open)(const char* path, PhotoslamVideoInfo* info, char* error, int error_size);
  /// Decodes the next image into `rgb` [height, width, 3]. 1: an image and its container's time; 0: the end; -1: an
  /// image that cannot be decoded, and why.
  int (*next)(void* reader, unsigned char* rgb, long long* timestamp_ns, char* error, int error_size);
  void (*close)(void* reader);
};

constexpr int kPhotoslamVideoApiVersion = 1;

/// The one symbol of the module, named photoslam_video_api.
using PhotoslamVideoEntry = const PhotoslamVideoApi* (*)();
}
