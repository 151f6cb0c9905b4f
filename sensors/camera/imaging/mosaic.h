#pragma once

#include <string>

#include "core/image.h"

namespace terracast::sensors {

/// Bayer's color filters, named by the first two pixels of the first two rows: rggb, bggr, grbg, gbrg.
class Mosaic {
 public:
  explicit Mosaic(const std::string& name) : name_(name) {}

  /// 0 red, 1 green, 2 blue.
  int channel_at(int x, int y) const {
    const char filter = name_[static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
    return filter == 'r' ? 0 : filter == 'g' ? 1 : 2;
  }

  /// All three colours of each pixel from the one that it saw: linear interpolation corrected by the
  /// gradient of the pixel's own colour. Exact where colours are linear over five pixels and keep their
  /// distances. The image goes on mirrored beyond its sides, about the pixels there.
  /// seen     one channel, white-balanced; 3 x 3 px at least. Noise about black may be below 0, and so may
  ///          what comes of it
  /// source   Malvar, He and Cutler 2004, ICASSP, figure 2
  core::ImageF demosaiced(const core::ImageF& seen) const;

 private:
  std::string name_;
};

}  // namespace terracast::sensors
