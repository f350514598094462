// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/glyphs.h"
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {
namespace {

Color ink_color(uint32_t id) {
  const Color inks[] = {rgb(0x7C2A2A), rgb(0x1F3D5A), rgb(0x2E5444), rgb(0xC98B2B), rgb(0xE7DDC7),
                        rgb(0x2B2A2E), rgb(0x9B5A2C), rgb(0xB9C2B2), rgb(0xB5472F), rgb(0x4A6C8C),
                        rgb(0xD9C48F), rgb(0x5B3A55), rgb(0xEFEAE0), rgb(0x3A7078)};
  return inks[id % std::size(inks)];
}

float brightness(const Color& c) { return c[0] * 0.3f + c[1] * 0.59f + c[2] * 0.11f; }

Color contrasting(const Color& ground, uint32_t id) {
  if (brightness(ground) > 0.5f) return id % 3 == 0 ? rgb(0x8C2F28) : rgb(0x2A2626);
  return id % 3 == 0 ? rgb(0xE2B857) : rgb(0xEEE6D6);
}

/// Rubbed corners and faded cloth.
Color worn(const Color& c, float x, float y, float edge, uint32_t seed) {
  const float rub = smoothstep(0.006f, 0.0f, edge + 0.003f * noise(x * 300, y * 300, seed));
  return shade(mix(c, rgb(0xCFC3AE), 0.5f * rub), 1 + 0.07f * fractal(x * 40, y * 40, 4, seed + 1));
}

}  // namespace

Shader book_spine(float width, float height, uint32_t seed) {
  const Color cloth = ink_color(hash(1, 0, seed)), second = ink_color(hash(2, 0, seed));
  const Color ink = contrasting(cloth, hash(3, 0, seed)), ink_on_second = contrasting(second, hash(4, 0, seed));
  const uint32_t style = hash(5, 0, seed) % 4;
  const float block_from = 0.1f + 0.35f * hash01(6, 0, seed),
              block_to = block_from + 0.15f + 0.25f * hash01(7, 0, seed);
  return [=](float x, float y) -> Color {
    const float t = y / height;
    const bool in_block = style >= 2 && t > block_from && t < block_to;
    Color c = in_block ? second : cloth;
    const Color mark = in_block ? ink_on_second : ink;
    // Rules near head and tail.
    const float rule = std::min(std::abs(t - 0.05f), std::abs(t - 0.93f)) * height;
    if (style != 3) c = mix(c, ink, smoothstep(0.0022f, 0.0012f, rule));
    if (style == 1) c = mix(c, ink, smoothstep(0.0016f, 0.0008f, std::abs(t - 0.22f) * height));
    // Title and author run down the spine.
    const float size = std::min(0.6f * width, 0.02f);
    const float along = y - 0.12f * height, title_end = 0.52f * height;
    if (along > 0 && along < title_end) {
      c = mix(c, mark, glyph_line(along, (width - x) - 0.5f * width + 0.5f * size, size, seed + 3));
    }
    const float author = y - 0.68f * height;
    if (author > 0 && author < 0.2f * height) {
      c = mix(c, mark, glyph_line(author, (width - x) - 0.5f * width + 0.3f * size, 0.6f * size, seed + 4));
    }
    c = worn(c, x, y, std::min({x, width - x, y, height - y}), seed + 5);
    const float hollow = 2 * x / width - 1;
    return shade(c, 1 - 0.18f * hollow * hollow * hollow * hollow);
  };
}

Shader book_cover(float width, float height, uint32_t seed) {
  const Color ground = ink_color(hash(1, 0, seed)), ink = contrasting(ground, hash(3, 0, seed));
  const PictureKind kind = static_cast<PictureKind>(hash(8, 0, seed) % 6);
  const float inset = 0.1f * width, top = 0.34f * height;
  const Shader art = picture(kind, width - 2 * inset, 0.5f * height, seed + 9);
  return [=](float x, float y) -> Color {
    Color c = ground;
    if (x > inset && x < width - inset && y > top && y < top + 0.5f * height) c = art(x - inset, y - top);
    const float size = 0.11f * height;
    for (int line = 0; line < 2; ++line) {
      const float ly = y - (0.06f + 0.13f * static_cast<float>(line)) * height;
      if (ly > 0 && ly < size && x > inset && x < width - inset) {
        c = mix(c, ink, glyph_line(x - inset, ly, size * 0.85f, seed + 20 + static_cast<uint32_t>(line)));
      }
    }
    const float ay = y - 0.89f * height;
    if (ay > 0 && ay < 0.05f * height && x > inset && x < width - inset)
      c = mix(c, ink, glyph_line(x - inset, ay, 0.04f * height, seed + 30));
    return worn(c, x, y, std::min({x, width - x, y, height - y}), seed + 5);
  };
}

Shader book_pages(uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float sheet = noise(x * 4, y * 1400, seed) + 0.7f * noise(x * 2, y * 350, seed + 1);
    const Color c = mix(rgb(0xE4D8BE), rgb(0xC2AC84), 0.5f + 0.4f * fractal(x * 12, y * 12, 3, seed + 2));
    return shade(Color(c[0], c[1], c[2], 0.2f), 0.93f + 0.14f * sheet);
  };
}

Shader printed_page(float width, float height, uint32_t seed) {
  const float margin = 0.09f * width;
  const bool two_columns = hash(1, 0, seed) % 2 == 0;
  const float picture_top = height * (0.15f + 0.4f * hash01(2, 0, seed));
  const float column = two_columns ? (width - 3 * margin) / 2 : width - 2 * margin;
  const float picture_height = 0.28f * height;
  const PictureKind kind = static_cast<PictureKind>(hash(8, 0, seed) % 6);
  const Shader art = picture(kind, column, picture_height, seed + 9);
  return [=](float x, float y) -> Color {
    Color c = shade(rgb(0xEFEBE0, 0.5f), 1 + 0.03f * fractal(x * 30, y * 30, 3, seed));
    const Color ink = rgb(0x262424);
    if (y > margin && y < 2.2f * margin && x > margin && x < width - margin) {
      return mix(c, ink, glyph_line(x - margin, y - margin, margin, seed + 1));
    }
    for (int k = 0; k < (two_columns ? 2 : 1); ++k) {
      const float left = margin + static_cast<float>(k) * (column + margin);
      if (x < left || x > left + column || y < 2.8f * margin || y > height - margin) continue;
      if (k == 0 && y > picture_top && y < picture_top + picture_height) return art(x - left, y - picture_top);
      constexpr float kLine = 0.0075f;
      const int line = floor_int(y / kLine);
      const float end = column * (hash(line, k, seed) % 6 == 0 ? 0.55f : 1.0f);
      if (x - left < end && hash(line, 5, seed) % 12 != 0) {
        c = mix(c, ink,
                0.9f * glyph_line(x - left, y - static_cast<float>(line) * kLine - 0.0012f, 0.0048f,
                                  seed + 40 + static_cast<uint32_t>(line)));
      }
    }
    return c;
  };
}

Shader code_editor(float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    Color c = rgb(0x1B2028);
    if (y < 0.02f) return glyph_line(x, y - 0.005f, 0.011f, seed) > 0.5f ? rgb(0xC8CCD4) : rgb(0x323A46);
    if (x < 0.09f) {
      c = rgb(0x242B35);
      const int line = floor_int(y / 0.014f);
      return mix(c, rgb(0x93A1B5),
                 x > 0.008f && x < 0.03f + 0.05f * hash01(line, 2, seed)
                     ? glyph_line(x, fraction(y / 0.014f) * 0.014f - 0.003f, 0.009f, seed + hash(line, 9, seed) % 999)
                     : 0.0f);
    }
    constexpr float kLine = 0.0115f;
    const int line = floor_int(y / kLine);
    const float indent = 0.105f + 0.014f * static_cast<float>(hash(line / 3, 0, seed) % 4);
    const float end = std::min(indent + 0.05f + 0.2f * hash01(line, 1, seed), width - 0.02f);
    if (y > height - 0.012f) return rgb(0x2F6FA8);
    if (x > indent && x < end && hash(line, 3, seed) % 7 != 0) {
      const Color inks[] = {rgb(0xD7DCE2), rgb(0x7FC1E8), rgb(0xE2A35C), rgb(0x8FCB7B), rgb(0xC58FD8)};
      const Color ink = inks[hash(floor_int((x - indent) / 0.035f), line, seed) % 5];
      c = mix(c, ink,
              glyph_line(x - indent, y - static_cast<float>(line) * kLine - 0.002f, 0.0078f,
                         seed + 60 + static_cast<uint32_t>(line)));
    }
    return c;
  };
}

Shader keyboard(float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float row_height = height / 5.2f;
    const int row = floor_int((y - 0.1f * row_height) / row_height);
    const float key_width = width / 15.2f;
    const float shifted = x - key_width * (0.1f + 0.25f * static_cast<float>(std::abs(row) % 3) * 0.5f);
    const int key = floor_int(shifted / key_width);
    const float u = std::abs(fraction(shifted / key_width) - 0.5f),
                v = std::abs(fraction((y - 0.1f * row_height) / row_height) - 0.5f);
    const float cap = smoothstep(0.45f, 0.41f, std::max(u, v));
    const bool bar = row == 4 && key > 3 && key < 9;
    Color c = mix(rgb(0x17181A), rgb(0x3C3F44), bar ? smoothstep(0.45f, 0.41f, v) : cap);
    if (!bar && cap > 0.5f) {
      c = mix(c, rgb(0xE8E8E4),
              glyph_line(fraction(shifted / key_width) * key_width - 0.3f * key_width,
                         fraction((y - 0.1f * row_height) / row_height) * row_height - 0.3f * row_height,
                         0.42f * row_height, seed + hash(row, key, seed) % 512) *
                  (u < 0.22f ? 1.0f : 0.0f));
    }
    return shade(c, 1 - 0.25f * (v > 0.3f ? 1.0f : 0.0f));
  };
}

Shader clock_face(float size) {
  return [=](float x, float y) -> Color {
    const float u = 2 * x / size - 1, v = 2 * y / size - 1;
    const float radius = std::hypot(u, v), turn = std::atan2(u, -v) / 6.28319f;
    Color c = shade(rgb(0xF1EBDD), 1 + 0.04f * fractal(x * 60, y * 60, 3, 3));
    const float hour = std::abs(fraction(turn * 12 + 0.5f) - 0.5f) / 12,
                minute = std::abs(fraction(turn * 60 + 0.5f) - 0.5f) / 60;
    if (radius > 0.74f && radius < 0.9f && hour * radius * 6.28f < 0.022f) c = rgb(0x222222);
    if (radius > 0.84f && radius < 0.9f && minute * radius * 6.28f < 0.01f) c = rgb(0x222222);
    const auto hand = [&](float at, float length, float half_width) {
      const float dx = std::sin(6.28319f * at), dy = -std::cos(6.28319f * at);
      const float along = u * dx + v * dy, across = std::abs(u * dy - v * dx);
      return along > -0.1f && along < length && across < half_width;
    };
    if (hand(10.15f / 12, 0.5f, 0.035f) || hand(9.0f / 60, 0.75f, 0.025f)) c = rgb(0x1A1A1C);
    if (hand(0.61f, 0.8f, 0.01f)) c = rgb(0xB03A2E);
    return c;
  };
}

}  // namespace photoslam::synthetic
