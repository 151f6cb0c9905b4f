#include <fmt/format.h>

#include "tests/validate/mutations/edits.h"

/// What belongs to one frame stands at another: all frames backwards, or two of them exchanged.
namespace terracast::test {

namespace {

/// The frame whose data stand at a frame.
using FrameAt = std::size_t (*)(const RightDataset& d, std::size_t f);

std::size_t backwards(const RightDataset& d, std::size_t f) {
  return d.recording.body_world.size() - 1 - f;
}
std::size_t last_two_exchanged(const RightDataset& d, std::size_t f) {
  const std::size_t last = d.recording.body_world.size() - 1;
  return f == last ? last - 1 : f + 1 == last ? last : f;
}

}  // namespace

void add_order_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list, true);
  const auto colors_of = [](FrameAt frame_at) {
    return [frame_at](const RightDataset& d, const fs::path& folder) {
      edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
        return d.recording.color[c][frame_at(d, f)];
      });
    };
  };
  const auto exchanged = [](const char* what) {
    return [what](const RightDataset& d) {
      const std::size_t last = d.recording.body_world.size() - 1;
      return Expected{
          {what, fmt::format("in another order: those of frames {} and {} are exchanged", last - 1,
                             last)},
          std::nullopt,
          0.0};
    };
  };
  // Of three frames the first and the last change places.
  const auto reversed = [](const char* what) {
    return says({what, "in another order: the last frame comes first"});
  };
  add("ColorsReversed", kAll, colors_of(backwards), reversed("colours"));
  add("ColorsExchanged", kAll, colors_of(last_two_exchanged), exchanged("colours"));
  const auto depths_of = [](FrameAt frame_at) {
    return [frame_at](const RightDataset& d, const fs::path& folder) {
      for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
        for (std::size_t f = 0; f < d.recording.body_world.size(); ++f)
          if (!depth_file(d, c, f).empty())
            copy_over(d.folder / depth_file(d, c, frame_at(d, f)), folder / depth_file(d, c, f));
    };
  };
  add("DepthsReversed", kAll, depths_of(backwards), reversed("depths"));
  add("DepthsExchanged", kAll, depths_of(last_two_exchanged), exchanged("depths"));
  add(
      "FlowReversed", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        const auto first_of = [&](std::size_t f) { return d.recording.body_world.size() - 2 - f; };
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, first_of(f), first_of(f) + 1); },
            [&](std::size_t f) { return flow_between(d, first_of(f) + 1, first_of(f)); });
      },
      reversed("flow"));
  const auto poses_of = [](FrameAt frame_at) {
    return [frame_at](const RightDataset& d, const fs::path& folder) {
      write_poses(d, folder,
                  [&](std::size_t c, std::size_t f) { return true_pose(d, c, frame_at(d, f)); });
    };
  };
  add("PosesReversed", kAll, poses_of(backwards), reversed("poses"));
  // Each image has the pose of the next one in the file, which has all cameras of a frame in a row.
  add(
      "PosesOfImagesPermuted", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t num_cameras = d.recording.cameras.size();
        const std::size_t num_images = num_cameras * d.recording.body_world.size();
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          const std::size_t next = (f * num_cameras + c + 1) % num_images;
          return true_pose(d, next % num_cameras, next / num_cameras);
        });
      },
      says({"poses of images.bin are permuted",
            "that of rig/cam0, frame 0 stands at rig/cam2, frame 5"}));
}

}  // namespace terracast::test
