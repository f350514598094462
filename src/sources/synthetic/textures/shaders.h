// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/synthetic/textures/texture.h"

/// Procedural surfaces with detail down to a millimetre. All take a seed; sizes are in metres.
namespace photoslam::synthetic {

// Wood and stone.
Shader wood(const Color& light, const Color& dark, uint32_t seed);  ///< Grain along x.
Shader parquet(uint32_t seed);                                      ///< Oak boards along x.
Shader basket(uint32_t seed);                                       ///< Woven wicker.
Shader brick_wall(uint32_t seed);
Shader plaster(const Color& paint, uint32_t seed);
Shader wallpaper(const Color& ground, uint32_t seed);  ///< Scattered leaves, nowhere the same.
Shader tiles(float size, uint32_t seed);               ///< Painted tiles, each one different.
Shader terracotta(uint32_t seed);
Shader glaze(const Color& ground, const Color& paint, float height, uint32_t seed);  ///< Painted pottery.
Shader metal(const Color& tone, uint32_t seed);

// Cloth.
Shader tweed(const Color& a, const Color& b, uint32_t seed);
Shader stripes(uint32_t seed);
Shader ikat(uint32_t seed);
Shader flowers(uint32_t seed);
Shader knit(const Color& wool, uint32_t seed);
Shader curtain(const Color& linen, uint32_t seed);
Shader leather(const Color& hide, uint32_t seed);
Shader rug(float width, float height, uint32_t seed);

// Print.
Shader book_spine(float width, float height, uint32_t seed);
Shader book_cover(float width, float height, uint32_t seed);
Shader book_pages(uint32_t seed);
Shader printed_page(float width, float height, uint32_t seed);
Shader code_editor(float width, float height, uint32_t seed);
Shader keyboard(float width, float height, uint32_t seed);
Shader clock_face(float size);

// Pictures.
enum class PictureKind { landscape, map, shapes, skyline, abstract, botanical };
Shader picture(PictureKind kind, float width, float height, uint32_t seed);
Shader pin_board(float width, float height, uint32_t seed);
Shader globe(float radius, uint32_t seed);
Shader garden(float width, float height, uint32_t seed);  ///< What the window shows.

// Plants and food.
Shader leaf_blade(const Color& green, uint32_t seed);
Shader fruit(const Color& ripe, const Color& unripe, uint32_t seed);

}  // namespace photoslam::synthetic
