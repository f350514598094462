// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/place_index.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace photoslam {
namespace {

using Place = std::vector<Descriptor>;

Place random_place(int count, Random& random) {
  Place place(static_cast<size_t>(count));
  for (Descriptor& d : place) d = {random.next(), random.next(), random.next(), random.next()};
  return place;
}

/// The place seen again: a share of its descriptors, each bit flipped with a probability, among new ones.
Place seen_again(const Place& place, double share, double flip, Random& random) {
  Place again = random_place(static_cast<int>(place.size()), random);
  for (size_t i = 0; i < place.size(); ++i) {
    if (random.uniform() > share) continue;
    again[i] = place[i];
    for (size_t bit = 0; bit < 256; ++bit) {
      if (random.uniform() < flip) again[i][bit / 64] ^= uint64_t{1} << (bit % 64);
    }
  }
  return again;
}

TEST(PlaceIndex, FindsPlacesSeenAgainLikeBruteForceDoes) {
  Random random(1);
  std::vector<Place> places;
  PlaceIndex index;
  for (int i = 0; i < 100; ++i) {
    places.push_back(random_place(100, random));
    index.add(i, places.back());
  }
  int found = 0;
  for (int i = 0; i < 100; i += 4) {
    // A third of the descriptors again, an eighth of their bits flipped.
    const Place query = seen_again(places[static_cast<size_t>(i)], 0.35, 0.125, random);
    int brute_force = -1, most = 0;
    for (int p = 0; p < 100; ++p) {
      int similar = 0;
      for (const Descriptor& a : query) {
        for (const Descriptor& b : places[static_cast<size_t>(p)]) similar += hamming_distance(a, b) <= 64;
      }
      if (similar > most) {
        most = similar;
        brute_force = p;
      }
    }
    ASSERT_EQ(brute_force, i);
    const auto candidates = index.query(query, 5);
    found += !candidates.empty() && candidates[0].place == i;
  }
  EXPECT_GE(found, 24) << "of 25";
}

TEST(PlaceIndex, CommonDescriptorsCountLittle) {
  // Every place shares the descriptors of a repeated texture; one has something of its own as well.
  Random random(2);
  const Place texture = random_place(100, random), landmark = random_place(20, random);
  PlaceIndex index;
  for (int i = 0; i < 50; ++i) {
    index.add(i, texture);
    if (i == 33) index.add(i, landmark);
  }
  Place query = texture;
  query.insert(query.end(), landmark.begin(), landmark.end());
  const auto candidates = index.query(query, 3);
  ASSERT_EQ(candidates.size(), 3u);
  EXPECT_EQ(candidates[0].place, 33);
  EXPECT_GT(candidates[0].score, 1.5 * candidates[1].score);
}

TEST(PlaceIndex, AcceptsOnlyWhatTheCallerWantsAndForgetsRemovedPlaces) {
  Random random(3);
  const Place place = random_place(50, random);
  PlaceIndex index;
  for (int i = 0; i < 4; ++i) index.add(i, place);
  index.add(4, random_place(50, random));
  EXPECT_EQ(index.num_places(), 5);
  const auto places_of = [](const std::vector<PlaceCandidate>& candidates) {
    std::vector<int> result;
    for (const PlaceCandidate& c : candidates) result.push_back(c.place);
    return result;
  };
  EXPECT_EQ(places_of(index.query(place, 10)), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(places_of(index.query(place, 2)), (std::vector<int>{0, 1}));
  EXPECT_EQ(places_of(index.query(place, 10, [](int p) { return p % 2 == 1; })), (std::vector<int>{1, 3}));
  index.remove(1);
  index.remove(1);
  index.remove(77);
  EXPECT_EQ(index.num_places(), 4);
  EXPECT_EQ(places_of(index.query(place, 10)), (std::vector<int>{0, 2, 3}));
}

TEST(PlaceIndex, FilesTheStrongestCornersInOrder) {
  Features features;
  for (size_t i = 0; i < 1000; ++i) {
    Keypoint keypoint;
    keypoint.response = static_cast<float>((i * 7) % 500);  // every value twice, shuffled
    features.keypoints.push_back(keypoint);
    features.descriptors.push_back(Descriptor{i});
  }
  const std::vector<Descriptor> strongest = strongest_descriptors(features);
  ASSERT_EQ(strongest.size(), 300);
  for (size_t k = 0; k < strongest.size(); ++k) {
    const uint64_t corner = strongest[k][0];
    EXPECT_EQ((corner * 7) % 500, 499 - k / 2);
    EXPECT_EQ(corner >= 500, k % 2 == 1) << "the first of two equals comes first";
  }
  EXPECT_TRUE(strongest_descriptors({}).empty());
}

TEST(PlaceIndex, EmptyIndexAndEmptyQueryFindNothing) {
  PlaceIndex index;
  Random random(4);
  EXPECT_TRUE(index.query(random_place(10, random), 5).empty());
  index.add(0, {});
  EXPECT_TRUE(index.query({}, 5).empty());
}

}  // namespace
}  // namespace photoslam
