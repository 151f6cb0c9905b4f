#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_file_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "FileTruncated", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const fs::path file = depth_file(d, 0, 1);
        std::string bytes = core::read_text_file(d.folder / file);
        bytes.resize(bytes.size() / 2);
        core::write_file(folder / file, bytes);
      },
      [](const RightDataset& d) {
        return Expected{{"a file does not hold what it should", depth_file(d, 0, 1).filename()},
                        std::nullopt,
                        0.0};
      });
  add(
      "FileMissing", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        fs::remove(folder / color_file(d, 0, 1));
      },
      [](const RightDataset& d) {
        return Expected{{"a file is missing", color_file(d, 0, 1).filename()}, std::nullopt, 0.0};
      });
  add(
      "FileExtra", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        core::write_file(folder / sequence_path(d) / "notes.txt", std::string_view("mine\n"));
      },
      says({"a file too many", "notes.txt"}), false);
  add(
      "FileChanged", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        core::Image8 image = d.recording.color[0][1];
        image(3, 2, 1) ^= 1;
        core::write_file(folder / color_file(d, 0, 1), core::encode_png(image));
      },
      [](const RightDataset& d) {
        return Expected{{"a file is not the one that was exported", color_file(d, 0, 1).filename()},
                        std::nullopt,
                        0.0};
      },
      false);
}

}  // namespace terracast::test
