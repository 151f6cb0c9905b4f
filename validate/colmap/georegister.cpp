#include <fmt/format.h>

#include "core/atomic_file.h"
#include "validate/checks/checker.h"
#include "validate/colmap/features.h"
#include "validate/text.h"

/// The exported model, moved, turned and scaled as a free reconstruction would be, is brought back
/// to its places by COLMAP's model_aligner and the exported georegistration.txt; then every camera
/// must stand where georeference.csv says, by the validator's own WGS84.
namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

/// A similarity far from the identity, as the 4 x 4 matrix that model_transformer reads.
std::string away_text() {
  Eigen::Matrix4d away = Eigen::Matrix4d::Identity();
  away.topLeftCorner<3, 3>() =
      0.0137 * Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7).normalized().toRotationMatrix();
  away.topRightCorner<3, 1>() = Eigen::Vector3d(3.25, -1.75, 12.5);
  std::string text;
  for (int row = 0; row < 4; ++row)
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", away(row, 0), away(row, 1),
                        away(row, 2), away(row, 3));
  return text;
}

/// The place of the first line, where model_aligner puts the origin of its ENU.
Geodetic first_place(const fs::path& file) {
  const std::string text = core::read_text_file(file);
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.empty()) throw ColmapFailure("georegistration.txt is empty");
  const std::vector<std::string_view> words = split_blanks(lines[0].text);
  if (words.size() != 4)
    throw ColmapFailure("georegistration.txt:1: not a name with latitude, longitude and height");
  return {parse_number(words[1], "georegistration.txt:1"),
          parse_number(words[2], "georegistration.txt:1"),
          parse_number(words[3], "georegistration.txt:1")};
}

}  // namespace

std::vector<CheckResult> run_colmap_georegister(const ColmapJob& job) {
  const fs::path exported = job.folder() / "sparse/0";
  const fs::path places = job.folder() / "georegistration.txt";
  if (!fs::is_regular_file(places)) throw ColmapFailure("georegistration.txt is missing");
  const ColmapCommand aligner{"model_aligner",
                              {"--ref_is_gps", "1", "--alignment_type", "enu", "--robust_alignment",
                               "1", "--robust_alignment_max_error", "0.1"}};
  const std::string away = away_text();
  const std::string key = job.program.version() + away + aligner.key() +
                          files_key({places, exported / "cameras.bin", exported / "images.bin",
                                     exported / "points3D.bin"});
  const fs::path made = job.work.made("georegister", key, [&](const fs::path& folder) {
    const fs::path moved = folder / "moved";
    core::write_file(moved / "transform.txt", away);
    const double timeout_s = 300.0 + static_cast<double>(job.shots.size());
    job.program.run({"model_transformer"},
                    {"--input_path", exported.string(), "--output_path", moved.string(),
                     "--transform_path", (moved / "transform.txt").string()},
                    "georegister_moved.log", timeout_s);
    job.program.run(aligner,
                    {"--input_path", moved.string(), "--output_path", folder.string(),
                     "--ref_images_path", places.string()},
                    "georegister.log", timeout_s);
  });
  const ColmapModel model = read_made_model(made);
  const Pose ecef_from_enu = ecef_from_local(first_place(places));

  CheckResult result = colmap_result("colmap_georegister_position", 0.0, 0.01, "m");
  std::size_t num_compared = 0;
  for (const Shot& shot : job.shots) {
    const auto& georeference = shot.camera->georeference[static_cast<std::size_t>(shot.frame)];
    const auto image = model.images.find(shot.image_id);
    if (!georeference) continue;
    if (image == model.images.end()) {
      note_worst(result, 1e9, shot.name + " is missing");
      continue;
    }
    const Eigen::Vector3d centre_ecef =
        ecef_from_enu * image->second.camera_from_world.pose().inverse().translation;
    note_worst(result, (centre_ecef - ecef_from_geodetic(georeference->place)).norm(), shot.name);
    ++num_compared;
  }
  if (num_compared == 0) throw ColmapFailure("georeference.csv holds none of the model's images");
  result.ok = result.is_within_bound();
  result.summary = fmt::format(
      "Largest distance of {} cameras, aligned by georegistration.txt, from georeference.csv.",
      num_compared);
  result.reason = "The file holds places to a micrometre; COLMAP's solver leaves less than 1 mm.";
  result.detects = "heights above another datum, latitude and longitude swapped, one frame of time";
  return {result};
}

}  // namespace terracast::validate
