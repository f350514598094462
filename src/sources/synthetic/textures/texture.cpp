// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"
#include "sources/synthetic/textures/noise.h"

namespace photoslam::synthetic {
namespace {

uint32_t pack(const Color& c) {
  const Eigen::Array4i v = (c * 255.0f + 0.5f).max(0.0f).min(255.0f).cast<int>();
  return static_cast<uint32_t>(v[0] | v[1] << 8 | v[2] << 16 | v[3] << 24);
}

Color unpack(uint32_t texel) {
  return Eigen::Array<uint8_t, 4, 1>(std::bit_cast<std::array<uint8_t, 4>>(texel).data()).cast<float>();
}

/// The four bytes of a texel, each in 16 bits of its own.
uint64_t spread(uint32_t texel) {
  const uint64_t halves = (texel | static_cast<uint64_t>(texel) << 16) & 0x0000FFFF0000FFFFu;
  return (halves | halves << 8) & 0x00FF00FF00FF00FFu;
}

/// Index into `size` texels continued by repetition or by mirroring.
int continued(int i, int size, bool repeats) {
  if (static_cast<unsigned>(i) < static_cast<unsigned>(size)) return i;
  if (repeats) return ((i % size) + size) % size;
  i %= 2 * size;
  if (i < 0) i += 2 * size;
  return i < size ? i : 2 * size - 1 - i;
}

}  // namespace

Texture Texture::paint(float width, float height, float texels_per_metre, const Shader& shader, Executor& executor) {
  PHOTOSLAM_CHECK(width > 0 && height > 0 && texels_per_metre > 0, "{} x {} m at {} per m", width, height,
                  texels_per_metre);
  Texture texture;
  texture.width_ = width;
  texture.height_ = height;
  texture.texels_per_metre_ = texels_per_metre;
  Level base;
  base.width = std::max(1, static_cast<int>(std::lround(width * texels_per_metre)));
  base.height = std::max(1, static_cast<int>(std::lround(height * texels_per_metre)));
  base.texels.resize(static_cast<size_t>(base.width) * static_cast<size_t>(base.height));
  constexpr int kRows = 16;
  executor.for_each((base.height + kRows - 1) / kRows, [&](int band, int) {
    for (int y = band * kRows; y < std::min(base.height, (band + 1) * kRows); ++y) {
      uint32_t* row = base.texels.data() + static_cast<size_t>(y) * static_cast<size_t>(base.width);
      for (int x = 0; x < base.width; ++x) {
        row[x] = pack(shader((static_cast<float>(x) + 0.5f) * width / static_cast<float>(base.width),
                             (static_cast<float>(y) + 0.5f) * height / static_cast<float>(base.height)));
      }
    }
  });
  texture.levels_.push_back(std::move(base));
  texture.add_smaller_levels();
  return texture;
}

Texture Texture::from_image(const ImageU8& image, Executor& executor) {
  PHOTOSLAM_CHECK(!image.empty(), "an empty image");
  const auto width = static_cast<float>(image.width());
  Texture texture = paint(
      1, static_cast<float>(image.height()) / width, width,
      [&](float x, float y) -> Color {
        const int column = std::min(static_cast<int>(x * width), image.width() - 1);
        const int row = std::min(static_cast<int>(y * width), image.height() - 1);
        const auto value = [&](int channel) {
          return static_cast<float>(image(column, row, std::min(channel, image.channels() - 1))) / 255.0f;
        };
        return {value(0), value(1), value(2), 1};
      },
      executor);
  texture.repeats_ = true;
  return texture;
}

void Texture::add_smaller_levels() {
  while (std::min(levels_.back().width, levels_.back().height) > 1) levels_.push_back(shrink(levels_.back()));
}

Texture::Level Texture::shrink(const Level& level) {
  Level half;
  half.width = level.width / 2;
  half.height = level.height / 2;
  half.texels.resize(static_cast<size_t>(half.width) * static_cast<size_t>(half.height));
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      // Light adds up in linear values, of which the texels hold the square roots.
      Color sum = Color::Zero();
      for (int k = 0; k < 4; ++k) {
        const size_t at =
            static_cast<size_t>(2 * y + k / 2) * static_cast<size_t>(level.width) + static_cast<size_t>(2 * x + k % 2);
        sum += unpack(level.texels[at]).square();
      }
      half.texels[static_cast<size_t>(y) * static_cast<size_t>(half.width) + static_cast<size_t>(x)] =
          pack((sum / 4.0f).sqrt() / 255.0f);
    }
  }
  return half;
}

Color Texture::bilinear(const Level& level, float x, float y) const {
  const float tx = x * static_cast<float>(level.width) - 0.5f, ty = y * static_cast<float>(level.height) - 0.5f;
  const int ix = floor_int(tx), iy = floor_int(ty);
  const int x0 = continued(ix, level.width, repeats_), x1 = continued(ix + 1, level.width, repeats_);
  const uint32_t* row0 =
      level.texels.data() + static_cast<ptrdiff_t>(continued(iy, level.height, repeats_)) * level.width;
  const uint32_t* row1 =
      level.texels.data() + static_cast<ptrdiff_t>(continued(iy + 1, level.height, repeats_)) * level.width;
  // Four 16-bit sums side by side in one integer; the weights add up to 256, so nothing overflows.
  const uint32_t fx = static_cast<uint32_t>((tx - static_cast<float>(ix)) * 16 + 0.5f);
  const uint32_t fy = static_cast<uint32_t>((ty - static_cast<float>(iy)) * 16 + 0.5f);
  const uint64_t sums = (16 - fx) * (16 - fy) * spread(row0[x0]) + fx * (16 - fy) * spread(row0[x1]) +
                        (16 - fx) * fy * spread(row1[x0]) + fx * fy * spread(row1[x1]);
  const auto sum = [sums](int channel) {
    return static_cast<float>(static_cast<int>(sums >> (16 * channel) & 0xFFFF)) * (1.0f / (256 * 255));
  };
  return {sum(0), sum(1), sum(2), sum(3)};
}

Color Texture::sample(float x, float y, float footprint) const {
  const float u = x / width_, v = y / height_;
  const float ratio = std::max(1.0f, footprint * texels_per_metre_);
  const int last = static_cast<int>(levels_.size()) - 1;
  // The exponent and mantissa of the ratio are the level and a linear blend to the next one.
  const uint32_t bits = std::bit_cast<uint32_t>(ratio);
  const int level = std::min(static_cast<int>(bits >> 23) - 127, last);
  const float blend = std::bit_cast<float>((bits & 0x7FFFFFu) | 0x3F800000u) - 1.0f;
  Color c = bilinear(levels_[static_cast<size_t>(level)], u, v);
  if (level < last && blend > 0) {
    c = c * (1 - blend) + bilinear(levels_[static_cast<size_t>(level) + 1], u, v) * blend;
  }
  const float gloss = c[3];
  c = c.square();
  c[3] = gloss;
  return c;
}

}  // namespace photoslam::synthetic
