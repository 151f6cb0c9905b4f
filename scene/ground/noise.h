#pragma once

#include "core/noise.h"

namespace terracast::scene {

using core::count_steps;
using core::kCoarsestNoiseLevel;
using core::kFinestNoiseLevel;
using core::kNoiseStep_m;
using core::kNumNoisePlanes;
using core::noise_planes;
using core::NoisePlaces;
using core::NoisePlane;
using core::NoiseSlope;
using core::NoiseSum;
using core::sum_all_noise;
using core::sum_noise;
using core::sum_noise_at;
using core::sum_noise_at_with_slope;
using core::sum_noise_with_slope;

}  // namespace terracast::scene
