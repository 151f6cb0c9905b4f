#include <fmt/format.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_color_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list), add_in_one(list, true);
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
      "ColorsShiftedBack", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.body_world.size() - 1;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][std::min(f + 1, last)];
        });
      },
      says({"colours", "shifted by 1 frame", "frame after"}, 1.0, 0.0));
  add(
      "ColorsOfOneCameraShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 1, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][c > 1 || f == 0 ? f : f - 1];
        });
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("colours of {} are shifted by 1 frame: each is that of the "
                                     "frame before",
                                     d.recording.cameras[1].name)},
                        -1.0,
                        0.0};
      });
  add(
      "ChannelOrderOfOneCamera", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 1, [&](std::size_t c, std::size_t f) {
          return c > 1 ? d.recording.color[c][f] : with_channels_swapped(d.recording.color[c][f]);
        });
      },
      [](const RightDataset& d) {
        // KITTI's grey images show which of the two colour cameras is wrong.
        return Expected{{fmt::format("colours of {} stand in the order blue, green, red",
                                     d.recording.cameras[1].name)},
                        std::nullopt,
                        0.0};
      });
  // In one order all images agree with each other: plants tell, if they are as red as leaves in sunlight. The ground
  // that stands for them is nearly grey: it gets three quarters of its blue.
  add_in_one(
      "ChannelOrderOfAllCameras", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          core::Image8 image = d.recording.color[c][f];
          for (std::size_t i = 2; i < image.data().size(); i += 3)
            image.data()[i] = static_cast<std::uint8_t>(image.data()[i] * 3 / 4);
          return with_channels_swapped(std::move(image));
        });
        core::write_file(folder / "Hills/seg_label_map.json",
                         std::string_view(R"({"name_map": {"sky": 0, "grass": 1, "water": 2}})"));
      },
      says({"colours of all cameras stand in the order blue, green, red (BGR)"}));
  add_in_one(
      "ImagesHalfAPixelOff", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return shifted_by_half(d.recording.color[c][f]);
        });
      },
      says({"images of ", "are shifted by (0.5", "px against depth and poses"}, std::sqrt(0.5),
           0.06));
  for (const bool is_left_right : {true, false})
    add(
        is_left_right ? "ImagesMirrored" : "ImagesUpsideDown", kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
            const core::Image8& right = d.recording.color[c][f];
            core::Image8 image = right;
            for (int y = 0; y < image.height(); ++y)
              for (int x = 0; x < image.width(); ++x)
                for (int k = 0; k < 3; ++k)
                  image(x, y, k) = is_left_right ? right(image.width() - 1 - x, y, k)
                                                 : right(x, image.height() - 1 - y, k);
            return image;
          });
        },
        says({"images of ", is_left_right ? " are mirrored left to right" : " stand upside down"}));
  add(
      "FrameDropped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // TartanAir's three frames lose the second, the others the third.
        const std::size_t last = d.recording.body_world.size() - 1;
        const std::size_t dropped = is_tartan(d) ? 1 : 2;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          if (c > 0 || f < dropped) return d.recording.color[c][f];
          return f == last ? d.next_color : d.recording.color[c][f + 1];
        });
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("frame {} of {} is dropped", is_tartan(d) ? 1 : 2,
                                     d.recording.cameras[0].name)},
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
  // Whether neighbours stand on both sides of it or on one.
  struct Place {
    const char* name;
    int frame;  ///< -1: the last
  };
  for (const Place& place :
       {Place{"FrameOfOtherSequence", 1}, Place{"FirstFrameOfOtherSequence", 0},
        Place{"LastFrameOfOtherSequence", -1}}) {
    const auto frame_of = [=](const RightDataset& d) {
      return place.frame < 0 ? d.recording.body_world.size() - 1
                             : static_cast<std::size_t>(place.frame);
    };
    add(
        place.name, kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          // Another place looks like none of these: this one after half a turn does as well.
          const core::Image8& own = d.recording.color[0][frame_of(d)];
          core::Image8 other = own;
          for (int y = 0; y < other.height(); ++y)
            for (int x = 0; x < other.width(); ++x)
              for (int k = 0; k < 3; ++k)
                other(x, y, k) = own(other.width() - 1 - x, other.height() - 1 - y, k);
          core::write_file(folder / color_file(d, 0, frame_of(d)), core::encode_png(other));
        },
        [=](const RightDataset& d) {
          return Expected{{fmt::format("image of {}, frame {} does not belong there",
                                       d.recording.cameras[0].name, frame_of(d))},
                          std::nullopt,
                          0.0};
        });
  }
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
