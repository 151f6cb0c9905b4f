#include "validate/readers/colmap_database.h"

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "validate/readers/colmap_camera_kinds.h"
#include "validate/readers/sqlite.h"

namespace terracast::validate {

namespace {

constexpr std::size_t kMostDatabaseBytes = std::size_t{1} << 30;

void read_database_cameras(const SqliteDatabase& database, ColmapDatabase& content) {
  database.each_row(
      "SELECT camera_id, model, width, height, params, prior_focal_length FROM cameras",
      [&](const SqliteRow& row) {
        const std::int64_t model = row.integer(1);
        const bool is_known =
            model >= 0 && model < static_cast<std::int64_t>(kColmapCameraKinds.size());
        ColmapCamera& camera = content.cameras[row.integer(0)];
        camera.model =
            is_known ? kColmapCameraKinds[static_cast<std::size_t>(model)].name : "unknown";
        camera.width_px = row.integer(2);
        camera.height_px = row.integer(3);
        camera.parameters = row.numbers<double>(4);
        content.prior_focal_lengths[row.integer(0)] = row.integer(5);
      });
}

void read_database_images(const SqliteDatabase& database, ColmapDatabase& content) {
  database.each_row(
      "SELECT image_id, name, camera_id, prior_tx, prior_ty, prior_tz, "
      "COALESCE(prior_qw, prior_qx, prior_qy, prior_qz) FROM images",
      [&](const SqliteRow& row) {
        content.images[row.integer(0)] = {row.text(1),
                                          row.integer(2),
                                          {row.number(3), row.number(4), row.number(5)},
                                          !row.is_null(6)};
      });
  database.each_row(
      "SELECT image_id, position, coordinate_system, position_covariance FROM pose_priors",
      [&](const SqliteRow& row) {
        content.pose_priors[row.integer(0)] = {row.numbers<double>(1), row.integer(2),
                                               row.numbers<double>(3)};
      });
}

}  // namespace

ColmapDatabase read_colmap_database(const std::filesystem::path& file, const std::string& name) {
  const auto database = SqliteDatabase::of_bytes(core::read_file(file, kMostDatabaseBytes), name);
  ColmapDatabase content;
  read_database_cameras(database, content);
  read_database_images(database, content);
  for (const char* table : {"keypoints", "descriptors", "matches", "two_view_geometries"})
    // Whether there is any row: counting those of a file whose pages lead to the same ones again and again has no end.
    database.each_row(fmt::format("SELECT 1 FROM {} LIMIT 1", table),
                      [&](const SqliteRow&) { content.other_tables.emplace_back(table); });
  database.each_row("SELECT name, seq FROM sqlite_sequence", [&](const SqliteRow& row) {
    content.highest_ids[row.text(0)] = row.integer(1);
  });
  database.each_row("PRAGMA user_version",
                    [&](const SqliteRow& row) { content.version = row.integer(0); });
  return content;
}

}  // namespace terracast::validate
