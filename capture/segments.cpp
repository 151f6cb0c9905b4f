#include "capture/segments.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::capture {
namespace {

/// A segment while its columns are walked.
struct Walked {
  Segment segment;
  std::uint32_t end = 0;  ///< of its last run, counted along the columns
};

void add_run(Walked& walked, std::uint32_t begin, std::uint32_t end) {
  MaskRuns& runs = walked.segment.runs;
  if (!runs.empty() && begin == walked.end) {
    runs.back() += end - begin;
  } else {
    runs.push_back(begin - walked.end);
    runs.push_back(end - begin);
  }
  walked.end = end;
}

void add_column(Segment& segment, int x, int first_y, int last_y) {
  if (segment.area == 0) {
    segment.left = segment.right = x;
    segment.top = first_y;
    segment.bottom = last_y;
  }
  segment.area += last_y - first_y + 1;
  segment.right = x;
  segment.top = std::min(segment.top, first_y);
  segment.bottom = std::max(segment.bottom, last_y);
}

}  // namespace

std::map<std::uint32_t, Segment> segments_of(const core::ImageU32& numbers) {
  std::map<std::uint32_t, Walked> all;
  const auto height = static_cast<std::uint32_t>(numbers.height());
  for (int x = 0; x < numbers.width(); ++x) {
    for (int y = 0; y < numbers.height();) {
      const std::uint32_t number = numbers(x, y);
      int end_y = y + 1;
      while (end_y < numbers.height() && numbers(x, end_y) == number) ++end_y;
      if (number != 0) {
        Walked& walked = all[number];
        const std::uint32_t column = static_cast<std::uint32_t>(x) * height;
        add_column(walked.segment, x, y, end_y - 1);
        add_run(walked, column + static_cast<std::uint32_t>(y),
                column + static_cast<std::uint32_t>(end_y));
      }
      y = end_y;
    }
  }
  std::map<std::uint32_t, Segment> segments;
  for (auto& [number, walked] : all) {
    const auto num_pixels = static_cast<std::uint32_t>(numbers.num_pixels());
    if (walked.end < num_pixels) walked.segment.runs.push_back(num_pixels - walked.end);
    segments.emplace(number, std::move(walked.segment));
  }
  return segments;
}

core::Image8 image_of_segments(const core::ImageU32& numbers) {
  core::Image8 image(numbers.width(), numbers.height(), 3);
  for (std::size_t i = 0; i < numbers.data().size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      image.data()[3 * i + c] = static_cast<std::uint8_t>(numbers.data()[i] >> (8 * c));
  return image;
}

void check_num_things(std::size_t num_things, const std::string& what) {
  if (num_things >= kMostSegments - kFirstThingSegment)
    core::fail(core::ErrorKind::Input, "{}: {} objects; panoptic images number {}", what,
               num_things, kMostSegments - kFirstThingSegment);
}

}  // namespace terracast::capture
