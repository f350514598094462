// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/density.h"

#include <map>

#include "base/check.h"
#include "splatting/density_formulas.h"

namespace photoslam::splatting {

std::vector<Fate> GaussianModel::judge(const DensityRules& rules) const {
  std::vector<Fate> fates(index_end(), Fate::stays);
  if (remote_ && remote_->judge(*this, rules, fates)) return fates;
  bring_home();
  for_each([&](size_t i) {
    fates[i] = splatting::judge(rules, *blocks_[i / kBlockSize], static_cast<int>(i % kBlockSize));
  });
  return fates;
}

void GaussianModel::breed(std::span<const Fate> fates, std::span<const double> normals) {
  PHOTOSLAM_CHECK(fates.size() == index_end(), "{} fates for {} indices", fates.size(), index_end());
  std::vector<Child> children;
  std::vector<uint8_t> leaves(index_end(), 0);
  size_t used = 0;
  for_each([&](size_t i) {
    const auto parent = static_cast<uint32_t>(i);
    leaves[i] = fates[i] == Fate::goes || fates[i] == Fate::splits ? 1 : 0;
    if (fates[i] == Fate::clones) children.push_back({parent, 0, {}});
    if (fates[i] != Fate::splits) return;
    PHOTOSLAM_CHECK(used + 6 <= normals.size(), "{} numbers are too few", normals.size());
    for (const double* n = &normals[used]; n != &normals[used] + 6; n += 3)
      children.push_back({parent, 1, {n[0], n[1], n[2]}});
    used += 6;
  });
  // Where the values are elsewhere they are divided there. Those here are older, and serve only should these be lost.
  std::optional<size_t> first_slot;
  if (remote_ && !children.empty()) {
    first_slot = remote_->breed(*this, children);
    if (!first_slot) bring_home();
  }
  struct Siblings {
    std::vector<Gaussian> gaussians;  // as their parents are
    std::vector<uint32_t> tags;
    std::vector<size_t> numbers;
  };
  std::map<int, Siblings> of_anchor;
  for (size_t k = 0; k < children.size(); ++k) {
    Siblings& siblings = of_anchor[anchor(children[k].parent)];
    siblings.gaussians.push_back(read(children[k].parent));
    siblings.tags.push_back(tag(children[k].parent));
    siblings.numbers.push_back(k);
  }
  remove(leaves);
  for (const auto& [anchor, siblings] : of_anchor) {
    const std::vector<size_t> indices = add(anchor, siblings.gaussians);
    for (size_t i = 0; i < indices.size(); ++i) {
      const size_t number = siblings.numbers[i], lane = indices[i] % kBlockSize;
      Block& block = *blocks_[indices[i] / kBlockSize];
      block.tags[lane] = siblings.tags[i];
      if (children[number].is_half != 0) halve(children[number].normals, &block.parameters[0][lane], kBlockSize);
      if (first_slot) block.origins[lane] = static_cast<uint32_t>(*first_slot + number + 1);
    }
    for (size_t i = 0; i < indices.size(); ++i)
      if (i + 1 == indices.size() || indices[i] / kBlockSize != indices[i + 1] / kBlockSize)
        update_bounds(indices[i] / kBlockSize);
  }
  if (!first_slot) return;
  remote_blocks_ += (children.size() + kBlockSize - 1) / kBlockSize;
  current_ &= ~kParameters;
}

}  // namespace photoslam::splatting
