#include "validate/readers/colmap_database.h"

#include <sqlite3.h>

#include <cstring>
#include <functional>
#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/colmap_camera_kinds.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostDatabaseBytes = std::size_t{1} << 30;

/// A row of a query.
class DatabaseRow {
 public:
  explicit DatabaseRow(sqlite3_stmt* statement) : statement_(statement) {}
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  double number(int column) const { return sqlite3_column_double(statement_, column); }
  bool is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
  std::string text(int column) const {
    const unsigned char* text = sqlite3_column_text(statement_, column);
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
  }
  std::vector<double> doubles(int column) const {
    const void* data = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    std::vector<double> values(size / sizeof(double));
    if (!values.empty()) std::memcpy(values.data(), data, values.size() * sizeof(double));
    return values;
  }

 private:
  sqlite3_stmt* statement_;
};

/// The bytes of a database, opened in memory: the file stays as it is.
class DatabaseBytes {
 public:
  DatabaseBytes(std::vector<std::byte> bytes, std::string name)
      : bytes_(std::move(bytes)), name_(std::move(name)) {
    sqlite3* handle = nullptr;
    check(sqlite3_open_v2(":memory:", &handle, SQLITE_OPEN_READWRITE, nullptr));
    handle_.reset(handle);
    const auto size = static_cast<sqlite3_int64>(bytes_.size());
    check(sqlite3_deserialize(handle, "main", reinterpret_cast<unsigned char*>(bytes_.data()), size,
                              size, SQLITE_DESERIALIZE_READONLY));
  }

  void each_row(const std::string& sql,
                const std::function<void(const DatabaseRow&)>& visit) const {
    sqlite3_stmt* prepared = nullptr;
    check(sqlite3_prepare_v2(handle_.get(), sql.c_str(), -1, &prepared, nullptr));
    const std::unique_ptr<sqlite3_stmt, Finish> statement(prepared);
    int status = SQLITE_ROW;
    while ((status = sqlite3_step(prepared)) == SQLITE_ROW) visit(DatabaseRow(prepared));
    check(status);
  }

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close(handle); }
  };
  struct Finish {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  void check(int status) const {
    if (status != SQLITE_OK && status != SQLITE_DONE)
      fail(ErrorKind::Input, "{}: {}", name_,
           handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(status));
  }

  std::vector<std::byte> bytes_;
  std::string name_;
  std::unique_ptr<sqlite3, Close> handle_;
};

void read_database_cameras(const DatabaseBytes& database, ColmapDatabase& content) {
  database.each_row(
      "SELECT camera_id, model, width, height, params, prior_focal_length FROM cameras",
      [&](const DatabaseRow& row) {
        const std::int64_t model = row.integer(1);
        const bool is_known =
            model >= 0 && model < static_cast<std::int64_t>(kColmapCameraKinds.size());
        ColmapCamera& camera = content.cameras[row.integer(0)];
        camera.model =
            is_known ? kColmapCameraKinds[static_cast<std::size_t>(model)].name : "unknown";
        camera.width_px = row.integer(2);
        camera.height_px = row.integer(3);
        camera.parameters = row.doubles(4);
        content.prior_focal_lengths[row.integer(0)] = row.integer(5);
      });
}

void read_database_images(const DatabaseBytes& database, ColmapDatabase& content) {
  database.each_row(
      "SELECT image_id, name, camera_id, prior_tx, prior_ty, prior_tz, "
      "COALESCE(prior_qw, prior_qx, prior_qy, prior_qz) FROM images",
      [&](const DatabaseRow& row) {
        content.images[row.integer(0)] = {row.text(1),
                                          row.integer(2),
                                          {row.number(3), row.number(4), row.number(5)},
                                          !row.is_null(6)};
      });
  database.each_row(
      "SELECT image_id, position, coordinate_system, position_covariance FROM pose_priors",
      [&](const DatabaseRow& row) {
        content.pose_priors[row.integer(0)] = {row.doubles(1), row.integer(2), row.doubles(3)};
      });
}

}  // namespace

ColmapDatabase read_colmap_database(const std::filesystem::path& file, const std::string& name) {
  const DatabaseBytes database(core::read_file(file, kMostDatabaseBytes), name);
  ColmapDatabase content;
  read_database_cameras(database, content);
  read_database_images(database, content);
  for (const char* table : {"keypoints", "descriptors", "matches", "two_view_geometries"})
    database.each_row(std::string("SELECT COUNT(*) FROM ") + table, [&](const DatabaseRow& row) {
      if (row.integer(0) > 0) content.other_tables.emplace_back(table);
    });
  database.each_row("SELECT name, seq FROM sqlite_sequence", [&](const DatabaseRow& row) {
    content.highest_ids[row.text(0)] = row.integer(1);
  });
  database.each_row("PRAGMA user_version",
                    [&](const DatabaseRow& row) { content.version = row.integer(0); });
  return content;
}

}  // namespace terracast::validate
