#include "batch/dataset/describe_dataset.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "batch/dataset/croissant.h"
#include "batch/dataset/dataset_card.h"
#include "batch/dataset/histogram.h"
#include "batch/dataset/index.h"
#include "batch/dataset/sequence_map.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/sha256.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::Json;

/// Writes files of a dataset and keeps what they are.
class DatasetFiles {
 public:
  explicit DatasetFiles(const fs::path& folder) : folder_(folder) {}

  void write(const std::string& path, const std::string& text) {
    core::write_file(folder_ / path, text);
    files.push_back({path, text.size(), core::sha256(text)});
  }
  void write(const std::string& path, const core::Image8& image) {
    const std::vector<std::byte> bytes = core::encode_png(image, 6);
    core::write_file(folder_ / path, bytes);
    files.push_back({path, bytes.size(), core::sha256(bytes)});
  }

  std::vector<FileFacts> files;

 private:
  fs::path folder_;
};

/// Edges of a histogram that hold all values, not at once where there are none.
Histogram histogram_of(Histogram::Axis axis, const std::vector<SequenceSummary>& sequences,
                       const std::vector<double> SequenceSummary::*values) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (const SequenceSummary& sequence : sequences)
    for (const double value : sequence.*values) {
      least = std::min(least, value);
      greatest = std::max(greatest, value);
    }
  if (!(least <= greatest)) least = greatest = 0.0;
  const double step = std::pow(10.0, std::floor(std::log10(std::max(greatest - least, 1.0))));
  axis.least = std::floor(least / step) * step;
  axis.greatest = std::max(std::ceil(greatest / step) * step, axis.least + step);
  Histogram histogram(axis);
  for (const SequenceSummary& sequence : sequences)
    for (const double value : sequence.*values)
      histogram.add(value, sequence.facts.split,
                    static_cast<double>(sequence.facts.num_frames) /
                        static_cast<double>((sequence.*values).size()));
  return histogram;
}

/// What is the same of several sequences, once.
template <class Facts, class Key>
std::vector<Facts> distinct(const std::vector<Facts>& all, const Key& key) {
  std::map<decltype(key(all.front())), Facts> known;
  for (const Facts& facts : all) known.emplace(key(facts), facts);
  std::vector<Facts> result;
  for (auto& [name, facts] : known) result.push_back(std::move(facts));
  return result;
}

Json statistics_json(const DatasetFacts& facts, const std::vector<const Histogram*>& histograms) {
  std::int64_t num_frames = 0;
  std::int64_t num_images = 0;
  double track_length_m = 0.0;
  double duration_s = 0.0;
  for (const SequenceFacts& sequence : facts.sequences) {
    num_frames += sequence.num_frames;
    num_images += sequence.num_images();
    track_length_m += sequence.track_length_m;
    duration_s += sequence.duration_s;
  }
  std::uint64_t num_bytes = 0;
  for (const FileFacts& file : facts.files) num_bytes += file.num_bytes;
  Json json = Json::object();
  json.set("runs", static_cast<std::int64_t>(facts.runs.size()))
      .set("sequences", static_cast<std::int64_t>(facts.sequences.size()))
      .set("frames", num_frames)
      .set("images", num_images)
      .set("bytes", num_bytes)
      .set("track_length_m", track_length_m)
      .set("duration_s", duration_s);
  Json distributions = Json::array();
  for (const Histogram* histogram : histograms) distributions.push(histogram->json());
  json.set("distributions", std::move(distributions));
  return json;
}

}  // namespace

std::vector<FileFacts> describe_dataset(DatasetParts parts, const fs::path& folder,
                                        const core::Log& log) {
  std::vector<SequenceSummary>& sequences = parts.sequences;
  std::vector<SplitSequence> to_split;
  for (const SequenceSummary& sequence : sequences)
    to_split.push_back({sequence.facts.id(), sequence.facts.num_frames, &sequence.ground});
  const SplitAssignment assignment = assign_splits(to_split, parts.options.splits);
  DatasetFacts facts{.publication = parts.options.publication,
                     .runs = {},
                     .sequences = {},
                     .places = {},
                     .cameras = {},
                     .splits = parts.options.splits,
                     .within_m = parts.options.reach_m(),
                     .split_words = assignment.words,
                     .checks = worst_checks(parts.reports),
                     .files = std::move(parts.files),
                     .plots = {},
                     .making = std::move(parts.making)};
  std::set<std::string> runs;
  std::vector<MapTrack> tracks;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    SequenceSummary& sequence = sequences[i];
    sequence.facts.split = assignment.splits[i];
    sequence.facts.group = assignment.groups[i];
    runs.insert(sequence.facts.run);
    facts.sequences.push_back(sequence.facts);
    facts.places.push_back(sequence.place);
    facts.cameras.insert(facts.cameras.end(), sequence.cameras.begin(), sequence.cameras.end());
    tracks.push_back({.world = sequence.place.world,
                      .split = sequence.facts.split,
                      .places = sequence.track,
                      .ground = &sequence.ground});
  }
  facts.runs.assign(runs.begin(), runs.end());
  facts.places = distinct(facts.places, [](const PlaceFacts& place) {
    return std::tuple(place.world, place.ground, place.origin.lat_deg, place.origin.lon_deg);
  });
  facts.cameras = distinct(facts.cameras, [](const CameraFacts& camera) { return camera; });

  const Histogram heights = histogram_of({.title = "height above ground", .unit = "m"}, sequences,
                                         &SequenceSummary::heights_m);
  const Histogram speeds =
      histogram_of({.title = "speed", .unit = "m/s"}, sequences, &SequenceSummary::speeds_mps);
  DatasetFiles files(folder);
  const auto add_plot = [&](const std::string& path, const std::string& title,
                            const core::Image8& image) {
    files.write(path, image);
    facts.plots.push_back({path, title});
  };
  add_plot("plots/map.png", "Where the sequences are, by split",
           draw_sequence_map(tracks, parts.options.splits.margin_m));
  add_plot("plots/height_above_ground.png", "Frames by height above ground", heights.draw());
  add_plot("plots/speed.png", "Frames by speed", speeds.draw());
  files.write(std::string(kIndexFile), index_lines(facts.sequences));
  for (const Split split : {Split::Train, Split::Val, Split::Test})
    files.write(fmt::format("splits/{}.txt", split_name(split)),
                split_lines(facts.sequences, split));
  files.write("statistics.json", statistics_json(facts, {&heights, &speeds}).text() + "\n");
  facts.files.insert(facts.files.end(), files.files.begin(), files.files.end());
  files.write("README.md", dataset_card(facts));
  facts.files.push_back(files.files.back());  // Croissant's, and its own are not in it
  files.write("croissant.json", croissant(facts).text() + "\n");
  log.info("{}", facts.split_words);
  const std::vector<std::string> gaps = croissant_gaps(facts);
  if (!gaps.empty())
    log.warn("croissant.json: Croissant requires {} too, which [dataset] does not state",
             fmt::join(gaps, ", "));
  return files.files;
}

}  // namespace terracast::batch
