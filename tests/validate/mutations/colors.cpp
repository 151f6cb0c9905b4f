#include <fmt/format.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_color_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "ChannelOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // TartanAir holds colours once: there one of two cameras is wrong.
        edit_colors(d, folder, is_tartan(d) ? 1 : 0, [&](std::size_t c, std::size_t f) {
          return with_channels_swapped(d.recording.color[c][f]);
        });
      },
      says({"blue, green, red (BGR)"}));
  add(
      "ColorsShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][f == 0 ? 0 : f - 1];
        });
      },
      says({"colours", "shifted by 1 frame", "frame before"}, -1.0, 0.0));
  add(
      "FrameDropped", {"kitti", "kitti_raw", "colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.body_world.size() - 1;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][c > 0 || f < 2 ? f : std::min(f + 1, last)];
        });
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("frame 2 of {} is dropped", d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });
  add(
      "FrameTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        copy_over(d.folder / color_file(d, 0, 1), folder / color_file(d, 0, 2));
      },
      [](const RightDataset& d) {
        return Expected{
            {fmt::format("image of {}, frame 2 is duplicated", d.recording.cameras[0].name),
             "that of frame 1"},
            std::nullopt,
            0.0};
      });
  add(
      "FrameOfOtherSequence", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // Another place looks like none of these: this one upside down does as well.
        core::Image8 other = d.recording.color[0][2];
        for (int y = 0; y < other.height(); ++y)
          for (int x = 0; x < other.width(); ++x)
            for (int k = 0; k < 3; ++k)
              other(x, y, k) =
                  d.recording.color[0][2](other.width() - 1 - x, other.height() - 1 - y, k);
        core::write_file(folder / color_file(d, 0, 2), core::encode_png(other));
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("image of {}, frame 2 does not belong there",
                                     d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });
  add(
      "Jpeg", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // Half the table's steps: quality 75.
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return compressed(d.recording.color[c][f], 0.5);
        });
      },
      says({"JPEG"}));
  add(
      "ColorLevels", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          core::Image8 image = d.recording.color[c][f];
          for (std::uint8_t& value : image.data()) value &= 0xf0;
          return image;
        });
      },
      says({"colours are quantised"}));
}

}  // namespace terracast::test
