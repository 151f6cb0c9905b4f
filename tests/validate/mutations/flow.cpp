#include <cmath>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_flow_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list), add_in_one(list, true);
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
  for (const int axis : {0, 1})
    add(
        axis == 0 ? "FlowSignOfU" : "FlowSignOfV", kFlow,
        [axis](const RightDataset& d, const fs::path& folder) {
          edit_flows(d, folder, [&](Flow& flow) {
            for (Vector2d& v : flow.flow) v[axis] = -v[axis];
          });
        },
        says({axis == 0 ? "flow has the opposite sign in u" : "flow has the opposite sign in v"}));
  // Where there is no frame before the first, a frame stands for it.
  add(
      "FlowToTheFrameBefore", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f == 0 ? 0 : f - 1); },
            [&](std::size_t f) { return flow_between(d, f + 1, f); });
      },
      says({"flow is of the wrong frame", "frame - 1"}));
  add(
      "FlowOfTheNextPair", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f + 1, f + 2); },
            [&](std::size_t f) {
              const std::size_t last = d.recording.body_world.size() - 1;
              return f + 2 > last ? flow_between(d, last, f) : flow_between(d, f + 2, f + 1);
            });
      },
      says({"flow is of the wrong frame", "that of the next pair"}));
  add(
      "FlowOfThePairBefore", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder,
            [&](std::size_t f) {
              return f == 0 ? flow_between(d, 0, 0) : flow_between(d, f - 1, f);
            },
            [&](std::size_t f) {
              return f == 0 ? flow_between(d, 0, 0) : flow_between(d, f, f - 1);
            });
      },
      says({"flow is of the wrong frame", "that of the pair of frames before"}));
  add(
      "FlowScaled", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [&](Flow& flow) {
          for (Vector2d& v : flow.flow) v /= d.recording.cameras[0].width;
        });
      },
      says({"flow is scaled by 0.0015625"}, 1.0 / 640.0, 1e-6));
  add_in_one(
      "FlowOffset", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) {
          for (Vector2d& v : flow.flow) v += Vector2d(0.5, -0.25);
        });
      },
      says({"flow is off by (0.5, -0.25) px everywhere"}, std::hypot(0.5, 0.25), 1e-3));
  add_in_one(
      "FlowOneColumnOff", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        const auto width = static_cast<std::size_t>(d.recording.cameras[0].width);
        edit_flows(d, folder, [&](Flow& flow) {
          const std::vector<Vector2d> right = flow.flow;
          for (std::size_t i = 0; i < right.size(); ++i)
            flow.flow[i] = right[i % width == 0 ? i : i - 1];
        });
      },
      says({"flow stands 1 pixel to the right of where it belongs"}, 1.0, 0.0));
  add_in_one(
      "BackwardFlowIsMinusForward", {"tartanair"},
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 1); },
            [&](std::size_t f) {
              Flow flow = flow_between(d, f, f + 1);
              for (Vector2d& v : flow.flow) v = -v;
              return flow;
            });
      },
      says({"backward flow is minus the forward flow of the same pixels"}));
  for (const bool is_one : {true, false})
    add_in_one(
        is_one ? "MasksAllOne" : "MasksAllZero", kFlow,
        [is_one](const RightDataset& d, const fs::path& folder) {
          edit_flows(d, folder, [&](Flow& flow) {
            flow.in_view.assign(flow.in_view.size(), is_one);
            flow.covisible.assign(flow.covisible.size(), is_one);
          });
        },
        says({is_one ? "masks of flow are all one" : "masks of flow are all zero"}));
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
  add(
      "CovisibleMasksInverted", {"tartanair"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) { flow.covisible.flip(); });
      },
      says({"co-visible masks of flow are inverted"}));
  add(
      "ViewMasksInverted", {"tartanair"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) { flow.in_view.flip(); });
      },
      says({"field-of-view masks of flow are inverted"}));
  add(
      "MasksSwapped", {"tartanair"},
      [](const RightDataset& d, const fs::path& folder) {
        const auto with_masks_of = [](Flow flow, const Flow& other) {
          flow.in_view = other.in_view;
          flow.covisible = other.covisible;
          return flow;
        };
        write_flows(
            d, folder,
            [&](std::size_t f) {
              return with_masks_of(flow_between(d, f, f + 1), flow_between(d, f + 1, f));
            },
            [&](std::size_t f) {
              return with_masks_of(flow_between(d, f + 1, f), flow_between(d, f, f + 1));
            });
      },
      says({"masks of forward and backward flow are swapped"}));
  const auto write_disparity = [](std::size_t c, double factor) {
    return [=](const RightDataset& d, const fs::path& folder) {
      const SceneCamera& camera = d.recording.cameras[0];
      const double product =
          camera.focal_px * (d.recording.cameras[1].offset_body - camera.offset_body).norm();
      for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
        core::Image16 counts(camera.width, camera.height);
        for (int y = 0; y < camera.height; ++y)
          for (int x = 0; x < camera.width; ++x)
            counts(x, y) = static_cast<std::uint16_t>(
                std::lround(256.0 * factor * product / d.recording.depth[c][f](x, y)));
        core::write_file(folder / sequence_path(d) / "disp_2" / (digits(f) + ".png"),
                         core::encode_png(counts));
      }
    };
  };
  add("DisparityDoubled", {"kitti"}, write_disparity(0, 2.0),
      says({"disparity is scaled by 2"}, 2.0, 1e-9));
  add("DisparityInWholePixels", {"kitti"}, write_disparity(0, 1.0 / 256.0),
      says({"disparity is scaled by", "whole pixels are stored where 1/256 px are meant"},
           1.0 / 256.0, 1e-9));
  add_in_one("DisparityOfTheRightCamera", {"kitti"}, write_disparity(1, 1.0),
             says({"disparity is that of the right image"}));
  add("DisparityScaled", {"kitti"}, write_disparity(0, 1.03),
      says({"disparity is scaled by 1.0"}, 1.03, 2e-3));
}

}  // namespace terracast::test
