#include <fmt/format.h>

#include <cmath>

#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_label_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "ClassesPermuted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
            core::Image8 classes = d.recording.classes[c][f];
            for (std::uint8_t& value : classes.data())
              value = static_cast<std::uint8_t>((value + 1) % 3);
            write_classes(d, folder, c, f, classes);
          }
      },
      says({"classes of the segmentation are permuted", "the sky is called 'ground'"}));
  add(
      "ClassesOfOneFramePermuted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        core::Image8 classes = d.recording.classes[0][1];
        for (std::uint8_t& value : classes.data()) value = value == 0 ? 0 : value == 1 ? 2 : 1;
        write_classes(d, folder, 0, 1, classes);
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("classes of {}, frame 1", d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });

  add(
      "ObservationsHalfAPixelOff", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.colmap.observations_px = -0.5;
        write_colmap(d.recording, folder, mistake);
      },
      says({"observations", "(-0.5, -0.5) px", "whole numbers"}, std::sqrt(0.5), 1e-6));
  add(
      "TracksOfOtherFrame", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.colmap.are_observations_of_next_frame = true;
        write_colmap(d.recording, folder, mistake);
      },
      says({"points3D have another frame's tracks", "frame after"}, 1.0, 0.0));
}

}  // namespace terracast::test
