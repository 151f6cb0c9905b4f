#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/image.h"

/// Images of numbers, each of which is a part of the image: panoptic ones.
namespace terracast::capture {

/// Numbers of things are this and up, those of stuff below it; 0 is nothing.
inline constexpr std::uint32_t kFirstThingSegment = 1000;
/// An image of 3 x 8 bits holds so many.
inline constexpr std::uint32_t kMostSegments = 1U << 24;

/// Lengths of runs along the columns, from the top left pixel down and then to the right: first of pixels that
/// are not in the mask (0 where the first one is), then of those that are, and so on.
using MaskRuns = std::vector<std::uint32_t>;

/// A part of an image whose pixels bear one number.
struct Segment {
  std::int64_t area = 0;                         ///< pixels
  int left = 0, top = 0, right = 0, bottom = 0;  ///< of its pixels, the last ones included
  MaskRuns runs;
};

/// All segments of an image of numbers, by number; 0 is none.
std::map<std::uint32_t, Segment> segments_of(const core::ImageU32& numbers);

/// A number for every pixel, by what it shows.
/// number_of   (instance id, semantic id) -> number; asked again only where they change along a row
template <class NumberOf>
core::ImageU32 segment_numbers(const CameraFrame& facts, const NumberOf& number_of) {
  core::ImageU32 numbers(facts.instance_id.width(), facts.instance_id.height());
  // Neighbours mostly show the same.
  std::uint32_t last_instance = 0, last_class = 0xffffffffU, last_number = 0;
  for (std::size_t i = 0; i < numbers.data().size(); ++i) {
    const std::uint32_t instance = facts.instance_id.data()[i];
    const std::uint32_t pixel_class = facts.semantic_id.data()[i];
    if (instance != last_instance || pixel_class != last_class) {
      last_instance = instance;
      last_class = pixel_class;
      last_number = number_of(instance, pixel_class);
    }
    numbers.data()[i] = last_number;
  }
  return numbers;
}

/// Numbers as red + 256 green + 65536 blue.
core::Image8 image_of_segments(const core::ImageU32& numbers);

/// Fails where a sequence has more things than numbers are left for.
/// what     of the message: who wants to number them
/// throws   Input
void check_num_things(std::size_t num_things, const std::string& what);

}  // namespace terracast::capture
