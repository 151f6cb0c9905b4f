#pragma once

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tests/support/brute_terrain.h"
#include "world/ray_query.h"

namespace terracast::test {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<world::SurfaceHit> cast_all(const world::RayQuery& query,
                                        std::span<const world::WorldRay> rays,
                                        world::Coherence coherence = world::Coherence::Incoherent);

world::SurfaceHit cast(const world::RayQuery& query, const world::WorldRay& ray);

bool is_blocked(const world::RayQuery& query, const world::WorldRay& ray);

std::string text(const world::WorldRay& ray);

bool has_same_bits(const world::SurfaceHit& a, const world::SurfaceHit& b);

/// Whether hits are the same to the last bit; names the first that is not.
testing::AssertionResult same_bits(std::span<const world::SurfaceHit> hits,
                                   std::span<const world::SurfaceHit> expected);

/// Rays of every kind over a world of a size: downward, level, along and across borders.
std::vector<world::WorldRay> mixed_rays(const world::RayQuery& query, double half_size_m,
                                        std::size_t count);

/// What a crossing's height above its plane may err by, as a share of the largest coordinate that
/// it is computed from: a dozen roundings of 2^-53 in plane and position.
inline constexpr double kClearanceError = 12.0 * 0x1.0p-53;

/// By how much t may err for it: what the clearance errs by over how fast the ray closes in. Of a
/// ray whose direction has length 1.
double t_error(const world::WorldRay& ray, const world::SurfaceHit& hit);

/// Whether the triangle that a hit names holds the place that it names, and has its slopes.
bool is_of_its_triangle(const BruteTerrain& brute, const world::WorldRay& ray,
                        const world::SurfaceHit& hit);

/// Whether a hit is the crossing that the full traversal found at t; infinity: there is none.
bool is_crossing_at(double t, const BruteTerrain& brute, const world::WorldRay& ray,
                    const world::SurfaceHit& hit);

}  // namespace terracast::test
