#include "batch/dataset/dataset_card.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "batch/dataset/ground_cells.h"
#include "batch/dataset/index.h"
#include "batch/dataset/licence.h"
#include "batch/dataset/markdown.h"
#include "batch/dataset/reading.h"
#include "batch/dataset/url_path.h"
#include "core/bytes_text.h"
#include "core/json.h"
#include "core/printable.h"

namespace terracast::batch {

namespace {

/// Text as YAML reads it; JSON's is a part of it.
std::string yaml_text(const std::string& text) {
  return core::Json(core::printable(text)).text(-1);
}

/// 12345678 as "12 345 678".
std::string count_text(std::int64_t count) {
  std::string digits = fmt::format("{}", count < 0 ? -count : count);
  for (std::size_t at = digits.size(); at > 3; at -= 3) digits.insert(at - 3, " ");
  return (count < 0 ? "-" : "") + digits;
}

/// Three digits; whole numbers where they are large.
std::string value_text(double value) {
  const bool is_count = std::abs(value) >= 999.5 && std::abs(value) < 1e9;
  return is_count ? count_text(std::llround(value)) : fmt::format("{:.3g}", value);
}

std::string degrees_text(double lat_deg, double lon_deg) {
  return fmt::format("{:.4f}° {}, {:.4f}° {}", std::abs(lat_deg), lat_deg < 0.0 ? "S" : "N",
                     std::abs(lon_deg), lon_deg < 0.0 ? "W" : "E");
}

std::string metres_text(double distance_m) {
  return distance_m >= 1000.0 ? fmt::format("{:.4g} km", distance_m / 1000.0)
                              : fmt::format("{:.4g} m", distance_m);
}

struct Totals {
  std::int64_t num_frames = 0;
  std::int64_t num_images = 0;
  double track_length_m = 0.0;
  std::uint64_t num_bytes = 0;
};

class Card {
 public:
  explicit Card(const DatasetFacts& facts) : facts_(facts), groups_(group_files(facts)) {
    for (const SequenceFacts& sequence : facts.sequences) {
      totals_.num_frames += sequence.num_frames;
      totals_.num_images += sequence.num_images();
      totals_.track_length_m += sequence.track_length_m;
    }
    for (const FileFacts& file : facts.files) totals_.num_bytes += file.num_bytes;
    for (const FileGroup& group : groups_) formats_.insert(group.format);
  }

  std::string text() const {
    std::string text = front_matter();
    text += "# " + markdown_text(title()) + "\n\n";
    if (!facts_.publication.description.empty())
      text += markdown_lines(facts_.publication.description) + "\n";
    text += summary();
    text += section("Where", where());
    text += section("Cameras", cameras());
    text += section("Formats", formats());
    text += section("Splits", splits());
    text += section("What was checked", checks());
    text += section("More pictures", pictures());
    text += section("Licences", licences());
    text += section("How to verify", verify());
    text += section("How it was made", making());
    if (!facts_.publication.cite_as.empty())
      text += section("How to cite", markdown_code(facts_.publication.cite_as));
    return text;
  }

 private:
  std::string title() const {
    return facts_.publication.title.empty() ? facts_.publication.name : facts_.publication.title;
  }

  static std::string section(const char* name, const std::string& text) {
    return text.empty() ? "" : fmt::format("\n## {}\n\n{}", name, text);
  }

  std::string front_matter() const {
    const Publication& publication = facts_.publication;
    const LicenceNames licence = licence_names(publication.licence);
    std::string text = "---\npretty_name: " + yaml_text(title()) + "\n";
    text += "license: " + licence.hugging_face + "\n";
    if (licence.hugging_face == "other") {
      text +=
          "license_name: " +
          yaml_text(publication.licence.empty() ? "licences-of-the-sources" : publication.licence) +
          "\n";
      text += "license_link: " +
              yaml_text(publication.licence_url.empty() ? "README.md" : publication.licence_url) +
              "\n";
    }
    text += fmt::format("size_categories:\n- {}\n", size_category());
    text += "task_categories:\n- depth-estimation\n";
    std::set<std::string_view> tags = {"aerial", "camera-poses", "geospatial", "synthetic"};
    for (const std::string& format : formats_)
      for (const std::string_view tag : reading_of(format).tags) tags.insert(tag);
    text += fmt::format("tags:\n- {}\n", fmt::join(tags, "\n- "));
    text += fmt::format("configs:\n- config_name: sequences\n  data_files: {}\n", kIndexFile);
    return text + "---\n\n";
  }

  /// What Hugging Face sorts datasets by; an image is what counts here.
  std::string size_category() const {
    static constexpr std::array kNames = {"1K", "10K", "100K", "1M", "10M", "100M", "1B"};
    std::int64_t limit = 1000;
    for (std::size_t i = 0; i < kNames.size(); ++i, limit *= 10)
      if (totals_.num_images < limit)
        return i == 0 ? "n<1K" : fmt::format("{}<n<{}", kNames[i - 1], kNames[i]);
    return "n>1T";
  }

  std::string summary() const {
    return markdown_table({"runs", "sequences", "frames", "images", "track", "worlds", "size"},
                          {{count_text(static_cast<std::int64_t>(facts_.runs.size())),
                            count_text(static_cast<std::int64_t>(facts_.sequences.size())),
                            count_text(totals_.num_frames), count_text(totals_.num_images),
                            metres_text(totals_.track_length_m),
                            count_text(static_cast<std::int64_t>(facts_.places.size())),
                            core::bytes_text(static_cast<double>(totals_.num_bytes))}},
                          std::vector<bool>(7, true)) +
           fmt::format(
               "\nRendered, not photographed: ray-cast worlds with exact depth, flow, poses and "
               "visibility. A frame is an instant, at which each camera takes an image; an image "
               "is "
               "counted once, whatever the formats that it is in. [`{0}`]({0}) has a line for each "
               "sequence.\n",
               kIndexFile);
  }

  std::string picture(const PlotFacts& plot) const {
    return fmt::format("![{}]({})\n\n", markdown_text(plot.title), url_path(plot.path));
  }

  std::string where() const {
    std::string text;
    if (!facts_.plots.empty()) text += picture(facts_.plots.front());
    std::map<std::string, std::pair<std::int64_t, std::int64_t>> flown;  // sequences, frames
    for (const SequenceFacts& sequence : facts_.sequences) {
      ++flown[sequence.world].first;
      flown[sequence.world].second += sequence.num_frames;
    }
    std::vector<PlaceFacts> places = facts_.places;
    std::sort(places.begin(), places.end(), [](const PlaceFacts& a, const PlaceFacts& b) {
      return std::tie(a.world, a.ground) < std::tie(b.world, b.ground);
    });
    std::vector<std::vector<std::string>> rows;
    for (const PlaceFacts& place : places)
      rows.push_back({markdown_text(place.world),
                      degrees_text(place.origin.lat_deg, place.origin.lon_deg),
                      metres_text(place.size_m) + " a side",
                      place.ground == "earth" ? "measured" : "made from a seed",
                      count_text(flown[place.world].first), count_text(flown[place.world].second)});
    return text +
           markdown_table({"world", "middle (WGS84)", "square", "ground", "sequences", "frames"},
                          rows, {false, false, true, false, true, true});
  }

  std::string cameras() const {
    std::vector<CameraFacts> cameras = facts_.cameras;
    std::sort(cameras.begin(), cameras.end());
    cameras.erase(std::unique(cameras.begin(), cameras.end()), cameras.end());
    std::vector<std::vector<std::string>> rows;
    for (const CameraFacts& camera : cameras) {
      const std::string focal =
          camera.focal_x_px <= 0.0 ? "–"
          : camera.focal_x_px == camera.focal_y_px
              ? fmt::format("{:.6g} px", camera.focal_x_px)
              : fmt::format("{:.6g}, {:.6g} px", camera.focal_x_px, camera.focal_y_px);
      rows.push_back({markdown_text(camera.rig), markdown_text(camera.camera),
                      markdown_text(camera.model),
                      fmt::format("{} x {} px", camera.width_px, camera.height_px), focal});
    }
    return markdown_table({"rig", "camera", "model", "size", "focal length"}, rows,
                          {false, false, false, true, true}) +
           "\nAll cameras of a frame stand on one body. Each dataset's `dataset.json` has their "
           "places on it.\n";
  }

  std::string formats() const {
    std::vector<std::vector<std::string>> rows;
    for (const std::string& format : formats_) {
      std::int64_t num_files = 0;
      std::uint64_t num_bytes = 0;
      for (const FileGroup& group : groups_)
        if (group.format == format) {
          num_files += group.num_files;
          num_bytes += group.num_bytes;
        }
      const FormatReading reading = reading_of(format);
      rows.push_back({markdown_text(reading.title), fmt::format("`{}/<run>/`", format),
                      count_text(num_files), core::bytes_text(static_cast<double>(num_bytes)),
                      std::string(reading.words)});
    }
    return markdown_table({"format", "folder", "files", "size", "how to read it"}, rows,
                          {false, false, true, true, false}) +
           "\nIn each, `dataset.json` states the conventions (frames, units, pixel centres, sky), "
           "`georeference.csv` the place of every camera on WGS84, and `bounds.csv` what depth and "
           "flow may err by.\n";
  }

  std::string splits() const {
    std::vector<std::vector<std::string>> rows;
    for (std::size_t k = 0; k < kSplitNames.size(); ++k) {
      std::int64_t num_sequences = 0;
      std::int64_t num_frames = 0;
      std::int64_t num_images = 0;
      std::set<int> groups;
      for (const SequenceFacts& sequence : facts_.sequences) {
        if (sequence.split != static_cast<Split>(k)) continue;
        ++num_sequences;
        num_frames += sequence.num_frames;
        num_images += sequence.num_images();
        groups.insert(sequence.group);
      }
      const double share = totals_.num_frames == 0 ? 0.0
                                                   : 100.0 * static_cast<double>(num_frames) /
                                                         static_cast<double>(totals_.num_frames);
      rows.push_back({fmt::format("[{0}](splits/{0}.txt)", kSplitNames[k]),
                      count_text(num_sequences), count_text(num_frames), count_text(num_images),
                      fmt::format("{:.1f} %", share),
                      count_text(static_cast<std::int64_t>(groups.size()))});
    }
    const std::string counted =
        std::isfinite(facts_.within_m)
            ? fmt::format(
                  "Ground counts as seen up to {} from the camera; what lies farther, in the "
                  "distance of an image, may be seen in another split too.",
                  metres_text(facts_.within_m))
            : "Ground counts as seen at any distance from the camera.";
    return markdown_table({"split", "sequences", "frames", "images", "share", "groups"}, rows,
                          {false, true, true, true, true, true}) +
           fmt::format(
               "\nNo ground that counts as seen is in two splits, and {} or more lie between that "
               "of "
               "different ones. {} It is counted in cells of about 100 m. Sequences whose ground "
               "hangs together are a group, which goes whole into one split. {}\n",
               metres_text(facts_.splits.margin_m), counted, markdown_text(facts_.split_words));
  }

  std::string checks() const {
    if (facts_.checks.empty()) return "";
    std::vector<CheckFacts> checks = facts_.checks;
    std::sort(checks.begin(), checks.end(),
              [](const CheckFacts& a, const CheckFacts& b) { return a.name < b.name; });
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> unseen;
    std::vector<std::string> failed;
    for (const CheckFacts& check : checks) {
      if (check.num_unseen > 0)
        unseen.push_back(fmt::format("{} ({})", markdown_text(check.name), check.num_unseen));
      if (check.num_failed > 0)
        failed.push_back(fmt::format("{} ({})", markdown_text(check.name), check.num_failed));
      if (check.num_measured == 0) continue;
      const bool is_known = check.value < 1e300;  // report.json's word for what is no number
      rows.push_back(
          {markdown_text(check.name), is_known ? value_text(check.value) : "no number",
           fmt::format("{} {}", check.is_lower_bound ? "≥" : "≤", value_text(check.bound)),
           markdown_text(check.unit), count_text(check.num_measured),
           markdown_text(check.format + "/" + check.run)});
    }
    std::string text =
        "`terracast validate` held every exported dataset against bounds, by readers and geometry "
        "that "
        "share no code with what wrote them, and against exact rays through the world. Of each "
        "check "
        "this is the value that used most of its bound, of all runs and formats.\n\n";
    if (failed.empty())
      text += "**Every bound holds.**\n\n";
    else
      text += fmt::format("**Bounds that do not hold, and in how many datasets: {}.**\n\n",
                          fmt::join(failed, ", "));
    text += markdown_table({"check", "worst", "bound", "unit", "measured in", "worst in"}, rows,
                           {false, true, true, false, true, false});
    if (!unseen.empty())
      text +=
          fmt::format("\nDatasets that show nothing of a check, though their format could: {}.\n",
                      fmt::join(unseen, ", "));
    return text;
  }

  std::string pictures() const {
    std::string text;
    for (std::size_t i = 1; i < facts_.plots.size(); ++i) text += picture(facts_.plots[i]);
    return text;
  }

  std::string licences() const {
    const Publication& publication = facts_.publication;
    std::string text;
    if (publication.licence.empty())
      text += "The dataset's own licence is not stated; those of its sources hold.\n\n";
    else
      text += fmt::format("The dataset: {}{}{}.\n\n", markdown_text(publication.licence),
                          publication.licence_url.empty() ? "" : ", ",
                          markdown_text(publication.licence_url));
    std::map<std::string, std::set<std::string>> worlds;  // by licence
    for (const PlaceFacts& place : facts_.places)
      for (const std::string& licence : place.licences) worlds[licence].insert(place.world);
    if (worlds.empty()) return text + "The worlds' manifests state no licence of a source.\n";
    text += "The sources of the worlds, as their manifests state them:\n\n";
    for (const auto& [licence, names] : worlds) {
      std::vector<std::string> shown;
      for (const std::string& name : names) shown.push_back(markdown_text(name));
      text += fmt::format("- {} ({})\n", markdown_text(licence.empty() ? "not stated" : licence),
                          fmt::join(shown, ", "));
    }
    return text;
  }

  static std::string verify() {
    return "    cd <this folder> && sha256sum -c --quiet SHA256SUMS\n\nsays nothing when every "
           "file is "
           "what it was when it was written.\n";
  }

  std::string making() const {
    const MakingFacts& making = facts_.making;
    std::string text = fmt::format("terracast {}", markdown_text(making.program_version));
    const std::set<std::string> configs(making.configs.begin(), making.configs.end());
    std::vector<std::string> names;
    for (const std::string& name : configs) names.push_back(markdown_text(name));
    if (!names.empty())
      text += fmt::format(", config{} {}", names.size() == 1 ? "" : "s", fmt::join(names, ", "));
    if (!making.seeds.empty()) text += fmt::format(", seeds {}", seed_text(making.seeds));
    if (making.sweep_seed)
      text += fmt::format(", draws of the sweep by seed {}", *making.sweep_seed);
    std::vector<std::string> plugins;
    for (const std::string& plugin : making.plugins) plugins.push_back(markdown_text(plugin));
    if (!plugins.empty())
      text += fmt::format(", with the plug-in{} {}", plugins.size() == 1 ? "" : "s",
                          fmt::join(plugins, ", "));
    return text +
           fmt::format(
               ". The same configs, seeds{} sources give the same bytes, this card included, "
               "on any number of machines.\n",
               plugins.empty() ? " and" : ", plug-ins and");
  }

  /// "1 to 40, 50".
  static std::string seed_text(const std::vector<std::int64_t>& seeds) {
    const std::set<std::int64_t> sorted(seeds.begin(), seeds.end());
    std::vector<std::string> ranges;
    for (auto first = sorted.begin(); first != sorted.end();) {
      auto last = first;
      while (std::next(last) != sorted.end() && *std::next(last) - *last == 1) ++last;
      ranges.push_back(*first == *last ? fmt::format("{}", *first)
                                       : fmt::format("{} to {}", *first, *last));
      first = std::next(last);
    }
    return fmt::format("{}", fmt::join(ranges, ", "));
  }

  const DatasetFacts& facts_;
  std::vector<FileGroup> groups_;
  std::set<std::string> formats_;
  Totals totals_;
};

}  // namespace

std::string dataset_card(const DatasetFacts& facts) { return Card(facts).text(); }

}  // namespace terracast::batch
