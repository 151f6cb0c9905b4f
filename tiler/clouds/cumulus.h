#pragma once

#include <cstdint>

#include "world/volume.h"

namespace terracast::tiler {

/// A cumulus of about a kilometre: a flat base at z = 0, heaps over it, billows on the heaps. Its origin is
/// in the middle of the base.
/// number   0 towers, 1 and 2 are as high as wide, 3 and 4 are flat, 5 is torn; and so on from 6
/// cost     about a second
world::Volume make_cumulus(std::uint64_t seed, int number);

/// A bank of fog with wisps on top: 3.2 km wide, 150 m deep, thinner toward its rim. Its origin is in the
/// middle of its foot.
world::Volume make_fog(std::uint64_t seed);

}  // namespace terracast::tiler
