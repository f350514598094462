// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
//
// Maps a dataset folder with the installed library, saves the gaussians and draws the last view.
#include <photoslam/slam.h>
#include <photoslam/version.h>

#include <fstream>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: map_a_dataset <dataset folder> <map.ply>\n";
    return 2;
  }
  std::cout << "photoslam " << photoslam::library_version() << "\n";
  try {
    const photoslam::SlamResult result = photoslam::map_dataset(argv[1], {.realtime = false});
    std::cout << result.tracked << " of " << result.frames << " frames tracked, " << result.map.num_gaussians()
              << " gaussians, trained on " << (result.gpu.empty() ? "the CPU" : result.gpu) << "\n";
    if (result.trajectory.empty()) return 1;
    result.map.save(argv[2]);
    const std::vector<uint8_t> picture = result.map.render(result.camera, result.trajectory.back());
    std::ofstream file("last_view.ppm", std::ios::binary);
    file << "P6\n" << result.camera.width << " " << result.camera.height << "\n255\n";
    file.write(reinterpret_cast<const char*>(picture.data()), static_cast<std::streamsize>(picture.size()));
  } catch (const photoslam::Failure& failure) {
    std::cerr << failure.what() << "\n";
    return 1;
  }
}
