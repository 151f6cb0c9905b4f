#include <cmath>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_flow_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "FlowSign", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) {
          for (Vector2d& v : flow.flow) v = -v;
        });
      },
      says({"flow has the opposite sign"}));
  add(
      "FlowOrder", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) {
          for (Vector2d& v : flow.flow) std::swap(v.x(), v.y());
        });
      },
      says({"u and v swapped"}));
  add(
      "FlowBackward", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f + 1, f); },
            [&](std::size_t f) { return flow_between(d, f, f + 1); });
      },
      says({"backward flow is stored as forward flow"}));
  add(
      "FlowToTheFrameAfter", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 2); },
            [&](std::size_t f) { return flow_between(d, f + 1, f); });
      },
      says({"flow is of the wrong frame", "frame + 2"}));
  add(
      "FlowScaled", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [&](Flow& flow) {
          for (Vector2d& v : flow.flow) v /= d.recording.cameras[0].width;
        });
      },
      says({"flow is scaled by 0.0015625"}, 1.0 / 640.0, 1e-6));
  add(
      "MasksInverted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [&](Flow& flow) {
          // V1 holds both masks as one: what is not valid is all the same.
          if (d.format == "tartanair_v1") flow.in_view = flow.covisible;
          flow.in_view.flip();
          flow.covisible.flip();
        });
      },
      says({"masks of flow are inverted"}));
  const auto scale_disparity = [](double factor) {
    return [factor](const RightDataset& d, const fs::path& folder) {
      const SceneCamera& camera = d.recording.cameras[0];
      const double product =
          camera.focal_px * (d.recording.cameras[1].offset_body - camera.offset_body).norm();
      for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
        core::Image16 counts(camera.width, camera.height);
        for (int y = 0; y < camera.height; ++y)
          for (int x = 0; x < camera.width; ++x)
            counts(x, y) = static_cast<std::uint16_t>(
                std::lround(256.0 * factor * product / d.recording.depth[0][f](x, y)));
        core::write_file(folder / sequence_path(d) / "disp_2" / (digits(f) + ".png"),
                         core::encode_png(counts));
      }
    };
  };
  add("DisparityDoubled", {"kitti"}, scale_disparity(2.0),
      says({"disparity is scaled by 2"}, 2.0, 1e-9));
  add("DisparityScaled", {"kitti"}, scale_disparity(1.03),
      says({"disparity is scaled by 1.0"}, 1.03, 2e-3));
}

}  // namespace terracast::test
