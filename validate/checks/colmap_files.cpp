#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/readers/colmap_database.h"
#include "validate/readers/georegistration.h"

/// What COLMAP's programs begin with beside the model: database.db, rig_config.json and
/// the names of georegistration.txt, against the binary model as it stands and georeference.csv.
namespace terracast::validate {

namespace {

/// Half a step of 13 decimals of a degree and of 6 of a metre, and the rounding of a double of 180 there.
constexpr double kPlaceRounding_deg = 0.5e-13 + 3e-14;
constexpr double kPlaceRounding_m = 0.5e-6 + 1e-9;

std::string folder_of(const std::string& image) { return image.substr(0, image.rfind('/')); }

/// The row of georeference.csv that an image is of; null: none.
const Georeference* georeference_of(const Sequence& sequence, const std::string& image) {
  const int index = sequence.camera_index(folder_of(image));
  const std::size_t slash = image.rfind('/');
  if (index < 0 || slash == std::string::npos) return nullptr;
  const auto& rows = sequence.cameras[static_cast<std::size_t>(index)].georeference;
  std::size_t frame = 0;
  const char* end = image.data() + image.size();
  if (std::from_chars(image.data() + slash + 1, end, frame).ec != std::errc()) return nullptr;
  return frame < rows.size() && rows[frame] ? &*rows[frame] : nullptr;
}

bool is_place_of(const Georeference& row, double lat_deg, double lon_deg, double height_m) {
  return std::abs(row.place.lat_deg - lat_deg) <= kPlaceRounding_deg &&
         std::abs(row.place.lon_deg - lon_deg) <= kPlaceRounding_deg &&
         std::abs(row.place.height_m - height_m) <= kPlaceRounding_m;
}

std::int64_t highest_of(const auto& table) { return table.empty() ? 0 : table.rbegin()->first; }

void compare_database_cameras(const ColmapDatabase& database, const ColmapModel& model,
                              FileContradictions& found) {
  found.expect(database.cameras.size() == model.cameras.size(),
               "database.db: {} cameras, {} in the model", database.cameras.size(),
               model.cameras.size());
  for (const auto& [id, camera] : model.cameras) {
    const auto other = database.cameras.find(id);
    found.expect(other != database.cameras.end() && other->second == camera,
                 "database.db: camera {} is another in the model", id);
    const auto focal = database.prior_focal_lengths.find(id);
    found.expect(focal != database.prior_focal_lengths.end() && focal->second == 1,
                 "database.db: the focal length of camera {} does not count as known", id);
  }
}

void compare_database_images(const Sequence& sequence, const ColmapDatabase& database,
                             const ColmapModel& model, FileContradictions& found) {
  found.expect(database.images.size() == model.images.size() &&
                   database.pose_priors.size() == model.images.size(),
               "database.db: {} images and {} priors, {} images in the model",
               database.images.size(), database.pose_priors.size(), model.images.size());
  for (const auto& [id, image] : model.images) {
    const auto other = database.images.find(id);
    found.expect(other != database.images.end() && other->second.name == image.name &&
                     other->second.camera_id == image.camera_id && !other->second.has_rotation,
                 "database.db: image {} is another in the model", id);
    const Georeference* row = georeference_of(sequence, image.name);
    if (row == nullptr || other == database.images.end()) continue;
    const auto& place = other->second.prior;
    found.expect(is_place_of(*row, place[0], place[1], place[2]),
                 "database.db: prior_tx to prior_tz of image {} are not its place in "
                 "georeference.csv",
                 id);
    const auto prior = database.pose_priors.find(id);
    found.expect(prior != database.pose_priors.end(),
                 "database.db: image {} has no row in pose_priors", id);
    if (prior == database.pose_priors.end()) continue;
    const std::vector<double>& position = prior->second.position;
    found.expect(prior->second.coordinate_system == 0 && position.size() == 3 &&
                     position == std::vector<double>(place.begin(), place.end()),
                 "database.db: the row of pose_priors of image {} is another place than in images",
                 id);
    const std::vector<double>& covariance = prior->second.covariance;
    found.expect(covariance.size() == 9 && std::all_of(covariance.begin(), covariance.end(),
                                                       [](double v) { return std::isnan(v); }),
                 "database.db: the prior of image {} has a covariance; places are exact", id);
  }
}

void compare_database(const Sequence& sequence, const ColmapDatabase& database,
                      const ColmapModel& model, FileContradictions& found) {
  compare_database_cameras(database, model, found);
  compare_database_images(sequence, database, model, found);
  found.expect(database.version == 3800, "database.db: version {}, not COLMAP 3.8's 3800",
               database.version);
  found.expect(database.other_tables.empty(),
               "database.db: {} has rows, though no program has worked with the dataset",
               database.other_tables.empty() ? "" : database.other_tables.front());
  const std::map<std::string, std::int64_t> highest = {{"cameras", highest_of(model.cameras)},
                                                       {"images", highest_of(model.images)}};
  found.expect(database.highest_ids == highest, "database.db: sqlite_sequence has other last ids");
}

/// Turns alike, of either sign of the quaternion; doubles of components up to 1.
bool is_same_turn(const std::array<double, 4>& a, const std::vector<double>& b) {
  constexpr double kTurnRounding = 1e-15;
  if (b.size() != a.size()) return false;
  const double sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0.0 ? -1.0 : 1.0;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (!(std::abs(a[k] - sign * b[k]) <= kTurnRounding)) return false;
  return true;
}

void compare_rig_camera(const core::Json& stated, const ColmapSensor& sensor, bool is_reference,
                        const ColmapModel& model, FileContradictions& found) {
  const auto camera = model.cameras.find(sensor.id);
  const auto image = std::find_if(model.images.begin(), model.images.end(), [&](const auto& one) {
    return one.second.camera_id == sensor.id;
  });
  if (camera == model.cameras.end() || image == model.images.end()) return;
  const std::string folder = folder_of(image->second.name);
  found.expect(stated.at("image_prefix").string() == folder + "/" &&
                   stated.at("camera_model_name").string() == camera->second.model &&
                   stated.at("camera_params").numbers() == camera->second.parameters,
               "rig_config.json: prefix, model or parameters of {} are not the model's",
               core::first_letters(folder, 60));
  if (is_reference) {
    found.expect(stated.has("ref_sensor") && stated.at("ref_sensor").boolean(),
                 "rig_config.json: {} is not called the reference",
                 core::first_letters(folder, 60));
    return;
  }
  const auto& t = sensor.sensor_from_rig.translation;
  found.expect(is_same_turn(sensor.sensor_from_rig.rotation_wxyz,
                            stated.at("cam_from_rig_rotation").numbers()) &&
                   stated.at("cam_from_rig_translation").numbers() ==
                       std::vector<double>(t.begin(), t.end()),
               "rig_config.json: the pose of {} is not that of rigs.bin",
               core::first_letters(folder, 60));
}

void compare_rig_config(const core::Json& config, const ColmapModel& model,
                        FileContradictions& found) {
  found.expect(config.is_array() && config.size() == model.rigs.size(),
               "rig_config.json: other rigs than the model's {}", model.rigs.size());
  std::size_t rig_index = 0;
  for (const auto& [id, rig] : model.rigs) {
    if (rig_index >= config.size()) return;
    const core::Json& cameras = config.at(rig_index++).at("cameras");
    found.expect(cameras.size() == rig.sensors.size(),
                 "rig_config.json: {} cameras in rig {}, {} in the model", cameras.size(), id,
                 rig.sensors.size());
    for (std::size_t k = 0; k < std::min(cameras.size(), rig.sensors.size()); ++k)
      compare_rig_camera(cameras.at(k), rig.sensors[k], k == 0, model, found);
  }
}

/// A line an image, in the order of their numbers: the first line's place is where model_aligner has its origin. Places
/// are the check `georegistration`'s.
void compare_georegistration(const std::filesystem::path& file, const std::string& path,
                             const ColmapModel& model, FileContradictions& found) {
  const auto lines = read_georegistration_lines(file, path);
  found.expect(lines.size() == model.images.size(), "georegistration.txt: {} lines for {} images",
               lines.size(), model.images.size());
  auto line = lines.begin();
  for (const auto& [id, image] : model.images) {
    if (line == lines.end()) return;
    found.expect(line->first == image.name, "georegistration.txt: {} where the model has {}",
                 core::first_letters(line->first, 60), core::first_letters(image.name, 60));
    ++line;
  }
}

class ColmapFilesChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    constexpr const char* kName = "colmap_files";
    if (!sequence.binary_model) return {skipped_result(kName, "the format has no such files")};
    Findings ignored;  // the reader has told of what is damaged in the model
    const ColmapModel model = read_colmap_binary(dataset.root / sequence.path / "sparse/0",
                                                 sequence.path + "/sparse/0", ignored);
    FileContradictions found;
    int num_files = 0;
    const auto compare = [&](const char* name, const auto& with) {
      const std::string path = sequence.path + "/" + name;
      if (!dataset.files.contains(path)) return;
      ++num_files;
      try {
        with(dataset.root / path, path);
      } catch (const core::Error& error) {
        if (error.kind() == core::ErrorKind::Interrupted) throw;
        found.expect(false, "{}", error.message());
      }
    };
    compare("database.db", [&](const auto& file, const std::string& path) {
      compare_database(sequence, read_colmap_database(file, path), model, found);
    });
    compare("rig_config.json", [&](const auto& file, const std::string&) {
      compare_rig_config(core::Json::read(file), model, found);
    });
    compare("georegistration.txt", [&](const auto& file, const std::string& path) {
      compare_georegistration(file, path, model, found);
    });
    if (num_files == 0)
      return {skipped_result(kName, "no database.db, rig_config.json or georegistration.txt")};
    CheckResult result = found.result(kName);
    result.summary = fmt::format(
        "Cameras, images, rigs and priors of {} files for COLMAP's programs, against the binary "
        "model and georeference.csv: {} comparisons.",
        num_files, found.num_compared);
    result.reason =
        "They state the model's own numbers as doubles, and places with the decimals of "
        "georeference.csv.";
    result.detects = "one number, name or row that is another";
    return {result};
  }
};

}  // namespace

std::unique_ptr<Checker> make_colmap_files_check(const ValidateOptions&) {
  return std::make_unique<ColmapFilesChecker>();
}

}  // namespace terracast::validate
