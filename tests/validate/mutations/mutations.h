#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/validate/analytic_dataset.h"

/// A catalogue of corruptions of exported datasets: what a bug of an exporter, or of a user's own
/// conversion, would have written. All that a corruption does not touch stays right, and dataset.json
/// lists the files as they are then.
namespace terracast::test {

/// A right dataset of one format and path, in a folder of its own.
struct RightDataset {
  std::string format;
  Path path = Path::Curved;
  std::filesystem::path folder;
  Recording recording;
  Recording longer;         ///< the path with three frames more, without images
  core::Image8 next_color;  ///< of the first camera, in the frame after the last
};

/// EGM96 at the flights' place, 42.5 N 1.5 E: a node of its 15-minute grid.
constexpr double kUndulation_m = 52.828;

/// Records and writes one.
RightDataset write_right_dataset(const std::string& format, Path path,
                                 const std::filesystem::path& folder);

/// What the cause that is named must say.
struct Expected {
  std::vector<std::string> words;  ///< all of them, in one cause
  std::optional<double> size;      ///< of that cause
  double tolerance = 0.0;
};

struct Mutation {
  std::string name;
  std::vector<std::string> formats;  ///< that can hold it
  /// Corrupts a copy of the right dataset.
  std::function<void(const RightDataset&, const std::filesystem::path& folder)> corrupt;
  std::function<Expected(const RightDataset&)> expected;
  bool is_listed = true;  ///< in dataset.json's list of files
  /// Ordinary runs try it in one of its formats, by turns; recorded ones in all.
  bool is_in_one_format = false;
};

const std::vector<Mutation>& mutations();

/// Corruptions that a format cannot show, and why.
struct Unseeable {
  std::string mutation;
  std::string format;  ///< empty: every format that `mutations()` does not name for it
  std::string why;
  bool is_of_straight_flight = false;  ///< there alone
};
const std::vector<Unseeable>& unseeable_mutations();

/// Makes a corrupted copy of a right dataset in an empty folder.
void corrupt(const RightDataset& right, const Mutation& mutation,
             const std::filesystem::path& folder);

}  // namespace terracast::test
