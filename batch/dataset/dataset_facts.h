#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "batch/dataset/splits.h"
#include "capture/frame_reader.h"
#include "core/schema.h"
#include "geo/geodesy.h"

/// What a merged dataset is, as its card, its Croissant description and its index tell it. Nothing here
/// holds times of making, hosts, users or absolute paths: the same runs give the same bytes.
namespace terracast::batch {

/// What only people can say of a dataset. Empty: nobody has said it, and nothing is made up.
struct Publication {
  std::string name = "dataset";
  std::string title = {};  ///< empty: the name
  std::string description = {};
  std::string version = "1.0.0";
  std::string licence = {};      ///< SPDX identifier, such as CC-BY-4.0, or the licence's own name
  std::string licence_url = {};  ///< of a licence that SPDX does not list
  std::string url = {};
  std::vector<std::string> creators = {};
  std::string date_published = {};  ///< 2025-06-21
  std::string cite_as = {};         ///< BibTeX

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("name", name, "Short name of the dataset.");
    visit.key("title", title, "Title of its card; the name when left out.");
    visit.key("description", description, "What it is for, in a few sentences.");
    visit.key("version", version, "MAJOR.MINOR.PATCH.");
    visit.key("licence", licence,
              "Licence of the dataset: an SPDX identifier such as CC-BY-4.0, or its own name.");
    visit.key("licence_url", licence_url, "Where a licence stands that SPDX does not list.");
    visit.key("url", url, "Where the dataset is published.");
    visit.key("creators", creators, "Who publishes it.");
    visit.key("date_published", date_published, "Day of publication, such as 2025-06-21.");
    visit.key("cite_as", cite_as, "How to cite it, in BibTeX.");
  }
  /// throws   Config: an empty name, a version or a day that is none
  void validate() const;
};

/// A world that sequences fly in.
struct PlaceFacts {
  std::string world;
  std::string ground;                 ///< ground_identity()
  geo::Geodetic origin;               ///< of the world frame, the middle of its square
  double size_m = 0.0;                ///< side of the square
  std::vector<std::string> licences;  ///< of the sources, as the world's manifest states them
};

struct CameraFacts {
  std::string rig;
  std::string camera;
  std::string model;
  int width_px = 0;
  int height_px = 0;
  double focal_x_px = 0.0;  ///< 0: the model has none
  double focal_y_px = 0.0;
  auto operator<=>(const CameraFacts&) const = default;
};

struct SequenceFacts {
  std::string run;
  std::string sequence;
  std::string swept;  ///< the keys that the sweep gave its run: "world.seed = 4, …"
  Split split = Split::Train;
  int group = 0;  ///< of SplitAssignment::groups
  std::string world;
  std::vector<std::string> formats;  ///< in whose folders it is: <format>/<run>
  int num_frames = 0;
  int num_cameras = 0;
  std::string utc_start;
  double duration_s = 0.0;
  double track_length_m = 0.0;
  /// Of the body's track: where it begins, and its bounds. Across the 180 degree meridian
  /// west_deg > east_deg.
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  double south_deg = 0.0;
  double north_deg = 0.0;
  double west_deg = 0.0;
  double east_deg = 0.0;
  double lowest_m = 0.0;  ///< above the ellipsoid
  double highest_m = 0.0;
  std::int64_t num_ground_cells = 0;

  std::string id() const { return run + "/" + sequence; }
  std::int64_t num_images() const { return std::int64_t{num_frames} * num_cameras; }
};

/// What the capture of a sequence tells: all but split, group, formats, ground and what was swept.
SequenceFacts sequence_facts(const std::string& run, const capture::SequenceReader& sequence);

/// The cameras of a sequence.
std::vector<CameraFacts> camera_facts(const capture::SequenceInfo& sequence);

/// The worst that a check measured in any run and format.
struct CheckFacts {
  std::string name;
  std::string unit;
  double value = 0.0;
  double bound = 0.0;
  bool is_lower_bound = false;
  std::string run;  ///< where it was measured
  std::string format;
  int num_measured = 0;
  int num_failed = 0;
  int num_unseen = 0;  ///< datasets that show nothing of it though their format could
};

/// A file of the dataset.
struct FileFacts {
  std::string path;  ///< relative to the dataset's folder, with slashes
  std::uint64_t num_bytes = 0;
  std::string sha256;
};

struct PlotFacts {
  std::string path;
  std::string title;
};

/// How the runs were made.
struct MakingFacts {
  std::string program_version;
  std::vector<std::string> configs;        ///< their names
  std::vector<std::int64_t> seeds;         ///< of the runs
  std::optional<std::int64_t> sweep_seed;  ///< of what was drawn for the runs
  std::set<std::string> plugins = {};      ///< that took part: "mine 1.2 (MIT)"
};

struct DatasetFacts {
  Publication publication;
  std::vector<std::string> runs;
  std::vector<SequenceFacts> sequences;
  std::vector<PlaceFacts> places;
  std::vector<CameraFacts> cameras;
  SplitOptions splits;
  double within_m = 0.0;  ///< of GroundOptions
  std::string split_words;
  std::vector<CheckFacts> checks;
  std::vector<FileFacts> files;  ///< all but the card, croissant.json and SHA256SUMS
  std::vector<PlotFacts> plots;
  MakingFacts making;
};

/// Files of one folder `<format>/` that end alike.
struct FileGroup {
  std::string format;
  std::string extension;  ///< "png"; empty for files without one
  std::int64_t num_files = 0;
  std::uint64_t num_bytes = 0;
};

/// The exported files, by format and extension; a format is a folder that some sequence names.
std::vector<FileGroup> group_files(const DatasetFacts& facts);

}  // namespace terracast::batch
