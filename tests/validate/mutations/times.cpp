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
  struct Unit {
    const char* name;
    const char* words;
    double factor;
  };
  for (const Unit& unit :
       {Unit{"TimesInMilliseconds", "are in ms where seconds are meant", 1e3},
        Unit{"TimesInMicroseconds", "are in µs where seconds are meant", 1e6},
        Unit{"TimesInNanoseconds", "are in ns where seconds are meant", 1e9},
        Unit{"TimesInMinutes", "are in min where seconds are meant", 1.0 / 60.0}})
    add(
        unit.name, kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          edit_times(d, folder, [&](double time_s) { return unit.factor * time_s; });
        },
        says({"times", unit.words}, unit.factor, 1e-12));
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

  // KITTI holds times twice: those that the above leave alone, and both.
  const auto shift_both = [=](bool is_georeference, bool is_format) {
    return [=](const RightDataset& d, const fs::path& folder) {
      const double step_s = 1.0 / d.recording.rate_hz;
      if (is_georeference)
        edit_georeference(d, folder, [&](std::array<double, 8>& row) { row[0] += step_s; });
      if (!is_format) return;
      if (d.format == "kitti") {
        edit_times(d, folder, [&](double time_s) { return time_s + step_s; });
        return;
      }
      for (const char* unit : {"image_00", "image_01", "image_02", "image_03", "oxts"}) {
        const fs::path file = sequence_path(d) / fs::path(unit) / "timestamps.txt";
        std::vector<std::string> lines = lines_of(folder / file);
        for (std::string& line : lines)
          line = fmt::format("2024-06-21 10:00:{:012.9f}",
                             std::stod(line.substr(line.rfind(':') + 1)) + step_s);
        write_lines(folder / file, lines);
      }
    };
  };
  add(
      "TimesOfOtherFileShifted", kKitti,
      [=](const RightDataset& d, const fs::path& folder) {
        const bool is_georeference = d.format == "kitti";
        shift_both(is_georeference, !is_georeference)(d, folder);
      },
      [](const RightDataset& d) {
        return Expected{{d.format == "kitti" ? "georeference.csv: times are shifted by 1 frames"
                                             : "times are shifted by 1 frames"},
                        1.0,
                        1e-6};
      });
  add("AllTimesShifted", kKitti, shift_both(true, true),
      says({"times", "shifted by 1 frame", "georeference.csv"}, 1.0, 1e-6));
}

}  // namespace terracast::test
