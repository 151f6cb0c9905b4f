#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>

#include "capture/frame.h"
#include "core/hash.h"
#include "core/random.h"

namespace terracast::capture {

/// Normal deviates of one camera in one sequence: a function of the seed and of the names of sequence, rig and camera
/// alone.
class CameraDraws {
 public:
  /// The errors of a rig that are drawn once a sequence.
  enum Draw : std::uint64_t {
    kFocalLength,
    kAzimuth,
    kPitch,
    kRoll,
    kOffset,  ///< and the two after it
    kClockOffset = kOffset + 3,
    kClockDrift,
    kJitter,  ///< its stream gives a deviate for each frame
  };

  CameraDraws(std::int64_t seed, const std::string& sequence, const CameraCalibration& camera)
      : seed_(static_cast<std::uint64_t>(seed)) {
    const std::string names = sequence + "/" + camera.rig + "/" + camera.name;
    stream_ = core::content_hash64(std::as_bytes(std::span(names)));
  }

  /// Standard normal.
  double normal(Draw draw) const { return normal_of(stream_, draw); }
  double jitter(int frame) const {
    return normal_of(core::stream_of(stream_, kJitter), static_cast<std::uint64_t>(frame));
  }

 private:
  /// By the transform of Box and Muller.
  double normal_of(std::uint64_t stream, std::uint64_t index) const {
    const double radius =
        std::sqrt(-2.0 * std::log(1.0 - core::random_unit(seed_, stream, 2 * index)));
    return radius *
           std::cos(2.0 * std::numbers::pi * core::random_unit(seed_, stream, 2 * index + 1));
  }

  std::uint64_t seed_;
  std::uint64_t stream_ = 0;
};

}  // namespace terracast::capture
