#include "core/atomic_file.h"
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
}

}  // namespace terracast::test
