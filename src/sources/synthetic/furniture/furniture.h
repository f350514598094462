// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/synthetic/furniture/workshop.h"

/// Pieces of furniture. Frames have their origin on the floor (or on what the piece stands on), x to the right as seen
/// from the front, y backwards, z up; large pieces start at their lower left front corner, small ones stand centred.
namespace photoslam::synthetic {

// Large pieces.
void bookshelf(Workshop& w, const SE3& frame, double width, double height, int boards);
void desk(Workshop& w, const SE3& frame);
void coffee_table(Workshop& w, const SE3& frame);
void sofa(Workshop& w, const SE3& frame, double width);
void armchair(Workshop& w, const SE3& frame);
void wooden_chair(Workshop& w, const SE3& frame, int seat_cover);
void sideboard(Workshop& w, const SE3& frame, double width);
void cupboard(Workshop& w, const SE3& frame, double width);
void tiled_stove(Workshop& w, const SE3& frame);

// Books.
enum class BookPose { upright, lying };
/// A book; upright with the spine at the front, lying with the spine at the front and the cover on top.
void book(Workshop& w, const SE3& frame, double thickness, double depth, double height, BookPose pose);
void book_pile(Workshop& w, const SE3& frame, int count);

// Things to put on things.
void vase(Workshop& w, const SE3& frame, double height, bool with_flowers);
void potted_plant(Workshop& w, const SE3& frame, double pot_height, double leaf_length, int leaves);
void mug(Workshop& w, const SE3& frame, const Color& color);
void teapot(Workshop& w, const SE3& frame);
void fruit_bowl(Workshop& w, const SE3& frame);
void globe_on_stand(Workshop& w, const SE3& frame);
void table_lamp(Workshop& w, const SE3& frame);
void candles(Workshop& w, const SE3& frame);
void wicker_basket(Workshop& w, const SE3& frame, double radius, double height);
void printed_sheet(Workshop& w, const SE3& frame, double width, double height);

/// A framed picture hung on a wall: frame at its centre, on the wall, looking from the front.
void framed_picture(Workshop& w, const SE3& frame, double width, double height, PictureKind kind, int moulding);
void floor_lamp(Workshop& w, const SE3& frame);

/// A paper ball on a wire, and its light.
void pendant_lamp(Workshop& w, const Vec3& position, double ceiling);

/// The room itself: walls, floor, ceiling, window, curtains, door and the lights of the sky and the ceiling.
void shell(Workshop& w, const Vec3& size);

/// The garden before the window of a shell of this size.
void hang_backdrop(SceneModel& model, const Vec3& size, uint64_t seed, Executor& executor);

/// Furnishes the whole room.
SceneModel furnish_room(uint64_t seed, const Vec3& size, SceneQuality quality, Executor& executor);

}  // namespace photoslam::synthetic
