#include <gtest/gtest.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/mutations/edits.h"
#include "validate/check.h"

/// Orders of sequences that are longer than what a diagnosis looks at.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

/// Words of the causes of a flight of KITTI's of which each frame's colours are another's.
std::string causes_of_colors(const test::Recording& flight,
                             const std::vector<std::size_t>& frame_at, const fs::path& folder) {
  test::RightDataset d;
  d.format = "kitti";
  d.folder = folder;
  d.recording = flight;
  test::write_kitti(flight, folder);
  test::edit_colors(d, folder, 0,
                    [&](std::size_t c, std::size_t f) { return flight.color[c][frame_at[f]]; });
  test::list_files_again(folder);
  const core::Log log("validate", core::LogLevel::Off);
  run_validate_stage(folder, {}, folder / "../report", {log});
  std::string words;
  for (const std::string& line : cause_lines(folder / "../report")) words += line + "\n";
  return words;
}

TEST(OrderOfFrames, OfLongSequencesIsNamed) {
  constexpr std::size_t kFrames = 12;
  const test::Recording flight =
      test::record_island_flight(test::kitti_cameras(), kFrames, test::Path::Curved);
  std::vector<std::size_t> order;
  for (std::size_t f = 0; f < kFrames; ++f) order.push_back(f);
  std::vector<std::size_t> sorted = order, backwards = order;
  std::sort(sorted.begin(), sorted.end(),
            [](std::size_t a, std::size_t b) { return std::to_string(a) < std::to_string(b); });
  std::reverse(backwards.begin(), backwards.end());
  std::swap(order[5], order[6]);
  const test::ScratchFolder scratch;
  const std::string as_words = causes_of_colors(flight, sorted, scratch / "sorted/data");
  EXPECT_NE(as_words.find("their numbers are sorted as words"), std::string::npos) << as_words;
  const std::string as_reversed = causes_of_colors(flight, backwards, scratch / "backwards/data");
  EXPECT_NE(as_reversed.find("the last frame comes first"), std::string::npos) << as_reversed;
  const std::string as_swapped = causes_of_colors(flight, order, scratch / "swapped/data");
  EXPECT_NE(as_swapped.find("those of frames 5 and 6 are exchanged"), std::string::npos)
      << as_swapped;
}

}  // namespace
}  // namespace terracast::validate
