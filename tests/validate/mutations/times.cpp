#include <fmt/format.h>

#include <array>

#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_time_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  const auto edit_times = [](const RightDataset& d, const fs::path& folder,
                             const std::function<double(double)>& change) {
    if (d.format == "kitti") {
      const fs::path file = folder / sequence_path(d) / "times.txt";
      std::vector<std::string> lines = lines_of(file);
      for (std::string& line : lines) line = fmt::format("{:e}", change(std::stod(line)));
      write_lines(file, lines);
    } else {
      edit_georeference(d, folder, [&](std::array<double, 8>& row) { row[0] = change(row[0]); });
    }
  };
  add(
      "TimesInMilliseconds", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [](double time_s) { return 1000.0 * time_s; });
      },
      says({"times", "are in ms where seconds are meant"}, 1000.0, 0.0));
  add(
      "TimesShifted", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [&](double time_s) { return time_s + 1.0 / d.recording.rate_hz; });
      },
      says({"times", "shifted by 1 frame"}, 1.0, 1e-6));
  add(
      "TimesOfOtherRate", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [](double time_s) { return 1.25 * time_s; });
      },
      says({"times", "1.25"}, 1.25, 1e-6));
}

}  // namespace terracast::test
